"""Shared by all tests: shapes are checked, and the network is refused."""

import gc
import os
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

# Several processes run the tests, and threads of BLAS that wait for a core spin: a product of
# 12,000 numbers took 8 ms of processor time, not .006. Workers of xdist read this before NumPy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("NUMBA_THREADING_LAYER", "workqueue")

import numpy as np
import pytest
from jaxtyping import install_import_hook

from corporeal.core.process_resources import keep_freed_memory, relax_garbage_collection

# Kernels are excluded: neither Warp nor numba can read a wrapped function.
install_import_hook(
    [
        "corporeal.core.types",
        "corporeal.mpm.problem",
        "corporeal.mpm.laws",
        "corporeal.mpm.material_table",
        "corporeal.pipeline.stages",
        "corporeal.io",
        "corporeal.reconstruction.features",
        "corporeal.core.store",
    ],
    "beartype.beartype",
)

# As the command line does; thousands of tests are a heap that each search for cycles would go through.
keep_freed_memory()
relax_garbage_collection()


def pytest_collection_finish():
    gc.freeze()


@pytest.fixture(autouse=True)
def no_network(monkeypatch):
    """Refuse every connection but those to this machine."""
    connect = socket.socket.connect

    def guarded(self, address):
        if self.family in (socket.AF_INET, socket.AF_INET6) and address[0] not in ("127.0.0.1", "::1", "localhost"):
            raise AssertionError(f"a test tried to reach {address}")
        return connect(self, address)

    monkeypatch.setattr(socket.socket, "connect", guarded)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def command(monkeypatch, capsys):
    """Type a command; returns its exit code and what it printed."""

    def type_(*words):
        from corporeal import cli

        monkeypatch.setattr(sys, "argv", ["corporeal", *map(str, words)])
        try:
            cli.main()
        except SystemExit as stop:
            return stop.code or 0, capsys.readouterr()
        return 0, capsys.readouterr()

    return type_


@pytest.fixture
def mesh_reader_in_process(monkeypatch, request):
    """Read meshes without a child process for each, which imports for a second what is imported here."""
    if "mesh_reader_child" in request.fixturenames:
        return
    from corporeal.io.mesh import mesh_loader, mesh_reader_process

    def run(command, **_):
        mesh_reader_process.main(*command[4:])
        return subprocess.CompletedProcess(command, 0, b"", b"")

    monkeypatch.setattr(mesh_reader_process, "_limit_resources", lambda: None)
    monkeypatch.setattr(mesh_loader, "subprocess", SimpleNamespace(**vars(subprocess) | {"run": run}))


@pytest.fixture
def mesh_reader_child():
    """Read meshes as users do: in a child process, within limits of time and memory."""


@pytest.fixture(scope="session")
def shared_assets():
    """Real objects that stand beside the checkout on some machines and never enter the project."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "assets"
    if not (folder / "manifest.csv").exists():
        pytest.skip("the real assets are not beside this checkout")
    return folder
