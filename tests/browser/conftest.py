"""One small run for all tests of the viewer."""

import pytest


@pytest.fixture(scope="session")
def small_run(tmp_path_factory):
    from viewer_server import a_run

    return a_run(tmp_path_factory.mktemp("viewer"))
