"""What tests of exports share: the bodies of a scene, and files changed by hand."""

from pathlib import Path

import numpy as np

from corporeal.export.export_target import ExportConfig, ExportRequest
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_run
from corporeal.geometry.rotation import matrix_from_quaternion


def asked_of(played, **settings):
    """What a writer is given of a run."""
    config = ExportConfig(**settings)
    motion = motion_of_run(played, config.at)
    return ExportRequest(physical_scene(played.prepared, motion), motion, config, played)


def rigid(asked):
    return [s for s in asked.scene.solids if s.rigid]


def soft(asked):
    return [s for s in asked.scene.solids if not s.rigid]


def turned(quaternion, points):
    """Rotate points by a quaternion (w, x, y, z)."""
    return np.asarray(points) @ matrix_from_quaternion(np.asarray(quaternion)).T


def replaced(path: Path, old: str, new: str) -> None:
    """Change a text file, once."""
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path} does not say {old}"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
