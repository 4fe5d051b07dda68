"""Whoever ends a search for poses is shown no stack of it."""

import subprocess
import sys

import pytest

pytest.importorskip("pycolmap")

ASKED = """
import os, signal
from corporeal.reconstruction.sfm.sfm_run import require_pycolmap
require_pycolmap()
os.kill(os.getpid(), signal.SIGTERM)
"""


def test_a_search_for_poses_that_is_asked_to_end_prints_no_stack():
    ended = subprocess.run([sys.executable, "-c", ASKED], capture_output=True, text=True)
    assert ended.returncode == -15
    assert ended.stderr == ""
