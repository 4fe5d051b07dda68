"""Household objects of thin parts, dropped by 0.3 of their size: what does not move as measured is said to be grave."""

from dataclasses import replace

import pytest

import corporeal as co
from corporeal.core.types import NoteKind
from corporeal.pipeline.settings import Settings
from corporeal.simulation.audit_file import read_audit
from household_models import HOUSEHOLD, write_glb

DRAFT = Settings()
DRAFT = replace(DRAFT, fill=replace(DRAFT.fill, detail="draft"))
DROPPED = replace(DRAFT.assemble, drop=0.3)

pytestmark = pytest.mark.slow


@pytest.fixture
def audited(tmp_path):
    """Simulate an object as a person would give it, without pictures, and read its audit."""

    def run(name):
        write_glb(HOUSEHOLD[name](), tmp_path / f"{name}.glb")
        scene = co.load_scene(tmp_path / f"{name}.glb", DROPPED)
        co.simulate_scene(scene, DRAFT, tmp_path / "simulated")
        return read_audit(tmp_path / "simulated")

    return run


@pytest.mark.parametrize(
    ("name", "part", "least", "kinds"),
    [
        ("bookshelf", "bookshelf", 1e-5, {"unaccounted_energy"}),
        ("bin_on_castors", "castors", 1e-5, {"depth_below_support"}),
        ("bed", "mattress", 0.05, {"unaccounted_energy"}),
        ("cactus", "cactus", 0.0, {"deformation"}),
        ("pine", "foliage", 0.0, {"deformation"}),
    ],
)
def test_a_household_object_gives_a_grave_finding_with_part_ratio_and_effect(audited, name, part, least, kinds):
    """Of solids and thickened walls on one grid; with shell elements these have to be clean."""
    found = audited(name)
    grave = {f.part: f for f in found.findings if f.severity == "grave"}
    assert part in grave
    worst = grave[part]
    assert worst.stiffness_ratio is not None and least <= worst.stiffness_ratio < 0.5
    assert kinds <= {e.kind for e in worst.effects if e.grave}
    assert f": {part} is simulated with" in worst.sentence
    assert (f"{worst.stiffness_ratio:.2g} of" in worst.sentence) or "(0 of the measured)" in worst.sentence
    assert any(note == worst.sentence and note.kind is NoteKind.GRAVE for note in found.notes)
