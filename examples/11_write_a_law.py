"""A law of one's own, written into a copy of the package at the four places of a law."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import corporeal as co
from corporeal.core.types import Law

PARTS = Path(__file__).parent / "law"
NAME = "saint_venant_kirchhoff"
NEXT = "\n\n@dataclass(frozen=True)\nclass Material:"  # what follows the laws' numbers


def write_law(package: Path) -> None:
    """Write the law's file, its twin in C++, its number and a material that follows it."""
    shutil.copy(PARTS / f"{NAME}.py", package / "mpm/laws")
    insert(package / "mpm/formulas/laws.h", "// Dispatch: ", (PARTS / "laws.h").read_text())
    insert(package / "core/types/material_field.py", NEXT, f"    {NAME.upper()} = {len(Law)}\n")
    insert(package / "materials/library.toml", "[gold]", (PARTS / "library.toml").read_text())


def insert(file: Path, before: str, text: str) -> None:
    """Insert text in front of a line of the file."""
    above, below = file.read_text().split(before, 1)  # a ValueError where it has no such line
    file.write_text(above + text + before + below)


def main() -> float:
    """Return the period of a bar of it over the theory's, 2L/c."""
    with tempfile.TemporaryDirectory() as place:
        package = shutil.copytree(Path(co.__file__).parent, Path(place) / "corporeal")
        write_law(package)
        asked = [sys.executable, str(PARTS / "swing.py"), "saint_venant_rubber"]
        said = json.loads(subprocess.check_output(asked, env=os.environ | {"PYTHONPATH": place}))
    print(f"the bar's period is {said['period']:.3f} of the theory's")
    return said["period"]


if __name__ == "__main__":
    main()
