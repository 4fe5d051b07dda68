"""What the doctor says of the processor."""

import pytest

from corporeal.cli import doctor


@pytest.mark.parametrize(
    ("used", "there", "said"),
    [
        (1, 1, "1 core"),
        (2, 2, "2 cores"),
        (1, 2, "1 core of the 2 that the machine has"),
        (4, 64, "4 cores of the 64 that the machine has"),
    ],
)
def test_one_core_is_no_cores_and_fewer_than_there_are_are_reported(monkeypatch, used, there, said):
    monkeypatch.setattr(doctor, "usable_cores", lambda: used)
    monkeypatch.setattr(doctor.os, "cpu_count", lambda: there)
    (processor,) = (f for f in doctor.check_installation() if f.what == "processor")
    assert processor.found == said
