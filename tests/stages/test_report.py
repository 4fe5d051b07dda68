import pytest

from corporeal.stages.report import built, si, simulated
from corporeal.types import Law, Material, Structure, Treatment


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (2e11, "Pa", "200 GPa"),
        (7e6, "Pa", "7 MPa"),
        (0.002, "m", "2 mm"),
        (1e-4, "m", "100 µm"),
        (0.0, "Pa", "0 Pa"),
        (7850.0, "kg/m³", "7850 kg/m³"),
        (0.5235987756, "rad", "30°"),
        (0.3, "", "0.3"),
    ],
)
def test_a_number_is_written_as_a_person_would(value, unit, said):
    assert si(value, unit) == said


def treated(kind, young):
    numbers = {"poisson": 0.3, "density": 1.0, "yield_stress": None, "thickness": None}
    numbers |= {"strain": 0.0, "impact_speed": 0.0, "wave_speed": 1.0, "step": 1.0, "why": ""}
    return Treatment(kind=kind, young_real=1e9, young=young, **numbers)


def test_the_real_stiffness_stands_beside_the_simulated_one():
    assert simulated(treated("rigid", 1e9)) == "rigid"
    assert simulated(treated("deformable", 1e9)) == "1 GPa (as real)"
    assert simulated(treated("shell", 1e6)) == "1 MPa (0.001 × real)"


def test_what_is_inside_is_told_with_how_it_is_built():
    soup = Material("soup", Law.NEO_HOOKEAN, 300.0, 0.49, 1050.0)
    assert built(Structure("filled", 2e-4, contents=soup, fill=0.9)) == "filled with soup"
    assert built(Structure("shell", 2e-4)) == "shell"
