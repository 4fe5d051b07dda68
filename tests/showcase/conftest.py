"""Build every prop once; it takes seconds."""

import pytest

from corporeal.showcase.models import MODELS


@pytest.fixture(scope="session")
def models():
    return {name: make() for name, make in MODELS.items()}
