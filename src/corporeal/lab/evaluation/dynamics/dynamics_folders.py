"""Folders of an evaluation of dynamics.

``OUT/SCENE/METHOD/`` is a run as ``corporeal run`` leaves it, done up to simulate, so that
``pipeline.read_back`` reads it. The reference, ours at a finer detail, is a run like any other.
"""

from pathlib import Path
from typing import Literal

OURS_NAME = "ours"
BASELINE_NAMES = ("single", "capped", "one", "omniphysgs", "vomp", "pixie", "table")
METHOD_NAMES = (OURS_NAME, *BASELINE_NAMES)
ReferenceDetail = Literal["normal", "fine"]
"""Details of a reference."""
INPUT_FOLDER = "input"
"""Folder of a scene for the file that all of its runs read, where the scene has none."""
NUMBERS_FILE = "dynamics.json"
"""In a run's folder: what is compared of it."""


def run_folder(out: Path, scene: str, method: str) -> Path:
    """Return the folder of one method's run of one scene.

    Args:
        out: Of the evaluation.
        scene: Its name.
        method: One of ``METHOD_NAMES``.

    """
    return out / scene / method


def reference_folder(out: Path, scene: str, detail: ReferenceDetail) -> Path:
    """Return the folder of the run that a scene's other runs are compared with."""
    return out / scene / f"reference-{detail}"
