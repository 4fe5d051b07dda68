"""Gaussians over time as OpenUSD: ``splats.usda``, one field of particles for each object.

Schema: UsdVol's ParticleField3DGaussianSplat (OpenUSD 26.03 and later). Scales, opacities and
harmonics as 3D Gaussian splatting has them: standard deviations [m], opacity in [0, 1], and the
coefficients of each particle one after the other, colour = 0.5 + Σ sh Y.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.types import Gaussians
from corporeal.core.version import __version__
from corporeal.export.motion import Motion, on_disk
from corporeal.export.solids import PhysicalScene
from corporeal.export.usd_geometry import WORLD
from corporeal.geometry.harmonics import DEGREES
from corporeal.io.usd_bodies import KEY
from corporeal.io.usd_text import Layer, Prim, custom_data, floats, text, title, vectors
from corporeal.simulation.moving_gaussians import MovingGaussians

NAME = "splats.usda"
SIGMAS = 3.0
"""Of the largest standard deviation: how far a box reaches around the means."""
MOVING = {"positions": ("point3f[]", 3), "orientations": ("quatf[]", 4), "scales": ("float3[]", 3)}
"""Attribute that is sampled → its type and width."""
DIGITS = partial(vectors, digits=6)


def write_splats(
    scene: PhysicalScene,
    motion: Motion,
    moving: MovingGaussians,
    owner: Int[np.ndarray, " N"],
    folder: Path,
) -> None:
    """Write all Gaussians: those of objects with samples, those of none standing still.

    Args:
        scene: Its objects' names and materials.
        motion: At whose frames the Gaussians are posed.
        moving: All Gaussians, bound to the material points.
        owner: Object of each; -1: of none.
        folder: Where ``splats.usda`` goes.

    """
    held = _posed(motion, moving)
    world = Prim("Xform", WORLD, metadata=[title(scene.title)])
    rest = np.flatnonzero(owner < 0)
    if len(rest):
        field = world.add(_field("background", moving.gaussians, rest))
        for name, values in zip(MOVING, _arrays(moving.gaussians), strict=True):
            field.set(MOVING[name][0], name, DIGITS(values[rest]))
        field.set("float3[]", "extent", _box(moving.gaussians.mean[rest], moving.gaussians.scale))
    for solid in scene.solids:
        own = np.flatnonzero(owner == solid.number)
        if not len(own):
            continue
        parts = {"parts": [scene.matter[k].provenance for k in solid.parts]}
        about = [title(solid.title), custom_data(KEY, solid.provenance | parts)]
        thing = world.add(Prim("Xform", solid.name, metadata=about))
        field = thing.add(_field("splats", moving.gaussians, own))
        for name, (kind, _) in MOVING.items():
            field.stream(kind, name, partial(_rows, held[name], own))
        boxes = partial(_boxes, held, own)
        field.stream("float3[]", "extent", boxes)
        if moving.gaussians.sh.shape[1] > 1:  # what looks different from all sides turns along
            colours = partial(_colours, motion, moving, own)
            field.stream("float3[]", "radiance:sphericalHarmonicsCoefficients", colours)
    layer = Layer(
        WORLD,
        float(scene.fps),
        len(motion.time) - 1,
        comment=f"Written by corporeal {__version__}.",
        prims=[world],
    )
    with (folder / NAME).open("w", encoding="utf-8", newline="\n") as file:
        layer.write(file)


def _posed(motion: Motion, moving: MovingGaussians) -> dict[str, np.ndarray]:
    """Pose all Gaussians at every frame; they stay on the disk."""
    count, frames = moving.gaussians.count, len(motion.time)
    held = {name: on_disk((frames, count, width)) for name, (_, width) in MOVING.items()}
    for k, frame in enumerate(motion.frames):
        for rows, values in zip(held.values(), _arrays(moving.at(frame)), strict=True):
            rows[k] = values
    return held


def _arrays(gaussians: Gaussians) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what ``MOVING`` names."""
    return gaussians.mean, gaussians.rotation, gaussians.scale


def _field(name: str, gaussians: Gaussians, own: np.ndarray) -> Prim:
    prim = Prim("ParticleField3DGaussianSplat", name)
    prim.set("float[]", "opacities", floats(gaussians.opacity[own]))
    sh = gaussians.sh[own]
    degree = DEGREES[sh.shape[1]]
    prim.set("uniform int", "radiance:sphericalHarmonicsDegree", str(degree))
    if degree == 0 or name == "background":
        kind, numbers = "float3[]", DIGITS(sh.reshape(-1, 3))
        prim.set(kind, "radiance:sphericalHarmonicsCoefficients", numbers)
    prim.set("uniform token", "sortingModeHint", text("zDepth"))
    return prim


def _rows(held: np.ndarray, own: np.ndarray) -> Iterator[str]:
    return (DIGITS(frame[own]) for frame in held)


def _boxes(held: dict[str, np.ndarray], own: np.ndarray) -> Iterator[str]:
    for mean, scale in zip(held["positions"], held["scales"], strict=True):
        yield _box(mean[own], scale[own])


def _box(mean: np.ndarray, scale: np.ndarray) -> str:
    margin = SIGMAS * float(scale.max())
    return vectors(np.array([mean.min(axis=0) - margin, mean.max(axis=0) + margin]))


def _colours(motion: Motion, moving: MovingGaussians, own: np.ndarray) -> Iterator[str]:
    return (DIGITS(moving.at(frame).sh[own].reshape(-1, 3)) for frame in motion.frames)
