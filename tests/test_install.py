"""`make install`: twice at once in one checkout, it is done once."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SLOW_PYTHON = """#!/bin/sh
echo begin >> log
sleep 1
echo end >> log
"""


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_two_installations_at_once_wait_for_each_other(tmp_path):
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "pyproject.toml").touch()
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(SLOW_PYTHON)
    # What compiles for the first run comes after that, and once, too.
    (python.parent / "corporeal").write_text("#!/bin/sh\necho compile >> log\n")
    for program in python.parent.iterdir():
        program.chmod(0o755)
    command = ["make", "install", f"PYTHON={sys.executable}"]
    both = [subprocess.Popen(command, cwd=tmp_path) for _ in range(2)]
    assert [one.wait(timeout=60) for one in both] == [0, 0]
    assert (tmp_path / "log").read_text().split() == ["begin", "end", "compile"]
