"""Props are built once for each process, and every scene is simulated once for all of them."""

import fcntl

import pytest
from faulty_runs import sound_run

from corporeal.showcase.prop_models import PROP_BUILDERS


@pytest.fixture(scope="session")
def models():
    return {name: make() for name, make in PROP_BUILDERS.items()}


@pytest.fixture(scope="session")
def sound(tmp_path_factory, request):
    """Give the run of a scene of the showcase, as a user gets it without any option.

    Several processes run the tests; the first that asks simulates, and the others wait.
    """
    base = tmp_path_factory.getbasetemp()
    if hasattr(request.config, "workerinput"):
        base = base.parent

    def run(name):
        folder = base / "sound" / name
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            done = folder / "done"
            if not done.exists():
                sound_run(name, folder)
                done.touch()
        return folder / "ours"

    return run
