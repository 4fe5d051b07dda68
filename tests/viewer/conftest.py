"""One small run for all tests of the viewer, which need the extra `viewer`."""

from importlib.util import find_spec

import pytest

collect_ignore_glob = [] if find_spec("starlette") and find_spec("uvicorn") else ["test_*.py"]


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    from viewer_server import a_run

    return a_run(tmp_path_factory.mktemp("viewer"))
