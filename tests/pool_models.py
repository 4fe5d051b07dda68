"""Models made by hand for pools: whole ones, and ones with one thing wrong each."""

import io

import numpy as np
from PIL import Image

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from glb_maker import Maker, pack


def ball(rings=24, radius=0.1, bumps=0.0):
    """A ball with a seam: vertices (V, 3), triangles (T, 3), texture coordinates (V, 2).

    There are 4 rings (rings - 1) triangles.
    """
    u, v = np.meshgrid(np.linspace(0, 1, 2 * rings + 1), np.linspace(0, 1, rings + 1))
    angle, down = 2 * np.pi * u, np.pi * v
    r = radius * (1 + bumps * np.sin(8 * angle) * np.sin(6 * down))
    corners = np.stack(
        [r * np.sin(down) * np.cos(angle), r * np.sin(down) * np.sin(angle), r * np.cos(down)], -1
    ).reshape(-1, 3)
    corners[: 2 * rings + 1] = 0, 0, radius
    corners[-2 * rings - 1 :] = 0, 0, -radius
    # The seam is closed exactly, as exporters leave it.
    grid = corners.reshape(rings + 1, 2 * rings + 1, 3)
    grid[:, -1] = grid[:, 0]
    k = np.arange(2 * rings * rings)
    a = k // (2 * rings) * (2 * rings + 1) + k % (2 * rings)
    c = a + 2 * rings + 1
    upper = np.stack([a, c, a + 1], 1)[2 * rings :]
    lower = np.stack([a + 1, c, c + 1], 1)[: -2 * rings]
    return corners, np.concatenate([upper, lower]), np.stack([u, v], -1).reshape(-1, 2)


def scene(vertices, triangles, uv=None, picture=None, normals=None, name="thing"):
    surface = Surface(name, 0, 0, vertices, triangles, uv=uv, normals=normals)
    finish = Finish("look", texture=picture, colour=(0.5, 0.5, 0.5, 1.0))
    thing = SceneObject(name, name, real_extent=1.0)
    return Scene(name, "made by hand", (thing,), (surface,), (finish,))


def checks(width, height, tiles=16):
    """A picture with more colours than a palette has."""
    y, x = np.mgrid[0:height, 0:width]
    odd = (x * tiles // width + y * tiles // height) % 2 * 255
    return np.stack([x * 255 // width, y * 255 // height, odd], -1).astype(np.uint8)


def glb(vertices, triangles, uv=None, picture=None, **asset):
    """Bytes of a GLB like anybody's; ``asset`` is what it says of itself."""
    made = Maker()
    made.json["asset"] |= asset
    attributes = {} if uv is None else {"TEXCOORD_0": made.accessor(np.asarray(uv, np.float32))}
    upright = np.asarray(vertices)[:, [0, 2, 1]] * (1, 1, -1)
    made.node(mesh=made.mesh(upright, np.asarray(triangles, np.uint32), attributes))
    if picture is not None:
        png = io.BytesIO()
        Image.fromarray(picture).save(png, "PNG")
        image = {"bufferView": made.view(png.getvalue()), "mimeType": "image/png"}
        look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        made.json |= {"images": [image], "textures": [{"source": 0}], "materials": [look]}
        made.primitive()["material"] = 0
    made.json["buffers"] = [{"byteLength": len(made.binary)}]
    return pack(made.json, made.binary)


def plain_ball(radius=0.1, rings=24, **asset):
    return glb(*ball(rings, radius)[:2], **asset)
