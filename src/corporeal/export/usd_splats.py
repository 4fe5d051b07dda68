"""Gaussians over time as OpenUSD: ``splats.usda``, one field of particles for each object.

Schema: UsdVol's ParticleField3DGaussianSplat (OpenUSD 26.03 and later). Scales, opacities and harmonics as 3D Gaussian
splatting has them: standard deviations [m], opacity in [0, 1], and the coefficients of each particle one after the
other, colour = 0.5 + Σ sh Y.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.store import write_json
from corporeal.core.types import Gaussians
from corporeal.core.version import __version__
from corporeal.export.export_target import ExportRequest, NothingToWriteError, WrittenTarget
from corporeal.export.exported_solids import PhysicalScene
from corporeal.export.scene_motion import SceneMotion, disk_array
from corporeal.export.usd_geometry import WORLD_PRIM
from corporeal.geometry.spherical_harmonics import SH_DEGREE_OF_COUNT
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.io.usd.usd_bodies import CUSTOM_DATA_KEY
from corporeal.io.usd.usda_writer import (
    UsdLayer,
    UsdPrim,
    usda_custom_data,
    usda_display_name,
    usda_floats,
    usda_string,
    usda_vectors,
)
from corporeal.simulation.moving_gaussians import MovingGaussians, moving_gaussians

SPLATS_FILE_NAME = "splats.usda"
BOX_SIGMAS = 3.0
"""Of the largest standard deviation: how far a box reaches around the means."""
SAMPLED_ATTRIBUTES = {"positions": ("point3f[]", 3), "orientations": ("quatf[]", 4), "scales": ("float3[]", 3)}
"""Attribute that is sampled → its type and width."""
write_vectors = partial(usda_vectors, digits=6)


def write_splats(
    scene: PhysicalScene, motion: SceneMotion, moving: MovingGaussians, owner: Int[np.ndarray, " N"], folder: Path
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
    world = UsdPrim("Xform", WORLD_PRIM, metadata=[usda_display_name(scene.title)])
    rest = np.flatnonzero(owner < 0)
    if len(rest):
        field = world.add(_field("background", moving.gaussians, rest))
        for name, values in zip(SAMPLED_ATTRIBUTES, _arrays(moving.gaussians), strict=True):
            field.set(SAMPLED_ATTRIBUTES[name][0], name, write_vectors(values[rest]))
        field.set("float3[]", "extent", _box(moving.gaussians.mean[rest], moving.gaussians.scale))
    for solid in scene.solids:
        own = np.flatnonzero(owner == solid.number)
        if not len(own):
            continue
        parts = {"parts": [scene.matter[k].provenance for k in solid.parts]}
        about = [usda_display_name(solid.title), usda_custom_data(CUSTOM_DATA_KEY, solid.provenance | parts)]
        thing = world.add(UsdPrim("Xform", solid.name, metadata=about))
        field = thing.add(_field("splats", moving.gaussians, own))
        for name, (kind, _) in SAMPLED_ATTRIBUTES.items():
            field.stream(kind, name, partial(_rows, held[name], own))
        boxes = partial(_boxes, held, own)
        field.stream("float3[]", "extent", boxes)
        if moving.gaussians.sh.shape[1] > 1:  # what looks different from all sides turns along
            colours = partial(_colours, motion, moving, own)
            field.stream("float3[]", "radiance:sphericalHarmonicsCoefficients", colours)
    layer = UsdLayer(
        WORLD_PRIM,
        float(scene.fps),
        len(motion.time) - 1,
        comment=f"Written by corporeal {__version__}.",
        prims=[world],
    )
    with (folder / SPLATS_FILE_NAME).open("w", encoding="utf-8", newline="\n") as file:
        layer.write(file)


def _posed(motion: SceneMotion, moving: MovingGaussians) -> dict[str, np.ndarray]:
    """Pose all Gaussians at every frame; they stay on the disk."""
    count, frames = moving.gaussians.count, len(motion.time)
    held = {name: disk_array((frames, count, width)) for name, (_, width) in SAMPLED_ATTRIBUTES.items()}
    for k, frame in enumerate(motion.frames):
        for rows, values in zip(held.values(), _arrays(moving.at(frame)), strict=True):
            rows[k] = values
    return held


def _arrays(gaussians: Gaussians) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what ``SAMPLED_ATTRIBUTES`` names."""
    return gaussians.mean, gaussians.rotation, gaussians.scale


def _field(name: str, gaussians: Gaussians, own: np.ndarray) -> UsdPrim:
    prim = UsdPrim("ParticleField3DGaussianSplat", name)
    prim.set("float[]", "opacities", usda_floats(gaussians.opacity[own]))
    sh = gaussians.sh[own]
    degree = SH_DEGREE_OF_COUNT[sh.shape[1]]
    prim.set("uniform int", "radiance:sphericalHarmonicsDegree", str(degree))
    if degree == 0 or name == "background":
        kind, numbers = "float3[]", write_vectors(sh.reshape(-1, 3))
        prim.set(kind, "radiance:sphericalHarmonicsCoefficients", numbers)
    prim.set("uniform token", "sortingModeHint", usda_string("zDepth"))
    return prim


def _rows(held: np.ndarray, own: np.ndarray) -> Iterator[str]:
    return (write_vectors(frame[own]) for frame in held)


def _boxes(held: dict[str, np.ndarray], own: np.ndarray) -> Iterator[str]:
    for mean, scale in zip(held["positions"], held["scales"], strict=True):
        yield _box(mean[own], scale[own])


def _box(mean: np.ndarray, scale: np.ndarray) -> str:
    margin = BOX_SIGMAS * float(scale.max())
    return usda_vectors(np.array([mean.min(axis=0) - margin, mean.max(axis=0) + margin]))


def _colours(motion: SceneMotion, moving: MovingGaussians, own: np.ndarray) -> Iterator[str]:
    return (write_vectors(moving.at(frame).sh[own].reshape(-1, 3)) for frame in motion.frames)


FRAME_FILE_PATTERN = "frame_{:04d}.ply"
MATERIALS_FILE_NAME = "video.json"


def write_splat_sequence(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``frame_0000.ply`` and so on, ``splats.usda``, and ``video.json`` with the materials.

    Raises:
        NothingToWriteError: The scene was made of surfaces, or nothing moves.
    """
    played = asked.played
    if played is None or played.reconstruction is None:
        raise NothingToWriteError("The scene was made of surfaces: it has no Gaussians.")
    moving = moving_gaussians(played.reconstruction, played.prepared)
    for number, frame in enumerate(asked.motion.frames):
        write_splat_ply(folder / FRAME_FILE_PATTERN.format(number), moving.at(frame))
    owner = played.reconstruction.object_of_gaussian
    write_splats(asked.scene, asked.motion, moving, owner, folder)
    about = {
        "fps": asked.scene.fps,
        "time_s": asked.motion.time,
        "up": "+Z",
        "credits": asked.scene.credits,
        "parts": [m.provenance for m in asked.scene.matter],
    }
    write_json(folder / MATERIALS_FILE_NAME, about)
    return WrittenTarget(("Gaussians of no object stand still.",))
