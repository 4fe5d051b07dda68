"""Gaussians over time: a PLY a frame, which viewers of splats play as a sequence, and OpenUSD."""

from pathlib import Path

from corporeal.core.store import write_json
from corporeal.export.export_target import ExportRequest, NothingToWriteError, WrittenTarget
from corporeal.export.usd_splats import write_splats
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.simulation.moving_gaussians import moving_gaussians

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
