"""Bodies of simple shapes for the tests of settling."""

from functools import lru_cache

import numpy as np
import trimesh

from corporeal.geometry.convex_decomposition import decompose_convex
from corporeal.geometry.convex_hull import convex_hull_of
from corporeal.scene.settling_body import SettlingBody


def body(mesh, name="body", **more):
    vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
    return SettlingBody(name, vertices, triangles, decompose_convex(vertices, triangles), **more)


def convex(mesh, name):
    """A body that is its own hull: there is nothing to cut."""
    vertices, triangles = np.asarray(mesh.vertices, float), np.asarray(mesh.faces)
    return SettlingBody(name, vertices, triangles, (convex_hull_of(vertices, 0.0),))


@lru_cache
def box(*sides, name="box"):
    return convex(trimesh.creation.box(sides), name)


@lru_cache
def ball(radius, name="ball"):
    return convex(trimesh.creation.icosphere(2, radius), name)


@lru_cache
def bowl(radius=0.25, wall=0.01):
    """A half sphere with a wall, open above, on a flat foot."""
    angle = np.linspace(0.3, np.pi / 2, 10)
    outer = radius * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    inner = (radius - wall) * np.column_stack([np.sin(angle), -np.cos(angle)])
    inner[:, 1] += radius
    profile = np.concatenate([[[0, outer[0, 1]]], outer, inner[::-1], [[0, inner[0, 1]]]])
    return body(trimesh.creation.revolve(profile, sections=24), "bowl")


@lru_cache
def table(width=0.5, height=0.4, leg=0.04, top=0.03):
    """A plate on four legs."""
    plate = trimesh.creation.box([width, width, top])
    plate.apply_translation([0, 0, height - top / 2])
    parts = [plate]
    for x in (-1, 1):
        for y in (-1, 1):
            post = trimesh.creation.box([leg, leg, height - top])
            reach = (width - leg) / 2
            post.apply_translation([x * reach, y * reach, (height - top) / 2])
            parts.append(post)
    return body(trimesh.util.concatenate(parts), "table")
