"""A sixth law works everywhere once it stands in its five places, and is missed where it is not.

The fifth place is its tests: those of laws and formulas take every law from the menu, and here run
against a copy of the package that has one more.
"""

import json
import os
import runpy
import shutil
import subprocess
import sys
from filecmp import dircmp
from pathlib import Path

import pytest

import corporeal

HERE = Path(__file__).parent
EXAMPLE = HERE.parents[1] / "examples" / "11_write_a_law.py"
NAME, MATERIAL = "saint_venant_kirchhoff", "saint_venant_rubber"
PLACES = {"materials/library.toml", "mpm/formulas/laws.h", f"mpm/laws/{NAME}.py", "core/types/material_field.py"}
SWING = """
import json, sys
from functools import partial
import swing
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cuda.engine import CudaEngine
from corporeal.mpm.reference.engine import ReferenceEngine
menu = {"reference": ReferenceEngine, "cpu": CpuEngine, "cuda": partial(CudaEngine, device="cpu")}
build = menu[sys.argv[1]]
print(json.dumps([swing.swing(name, build) for name in sys.argv[2:]]))
"""
CARDS = """
import sys
from corporeal.mpm.cuda import timestep
from corporeal.mpm.quiet_warp import wp
made = wp.compile_aot_module(timestep, arch=[86, 90, 120], module_dir=sys.argv[1])
print(*(path.name for path in made if path.stat().st_size > 10_000))
"""


def copied(place, without=None):
    """Write the law into a copy of the package, but for one place; return where to import from."""
    here, package = Path(corporeal.__file__).parent, place / "corporeal"
    shutil.copytree(here, package)
    runpy.run_path(str(EXAMPLE))["write_law"](package)
    if without:
        (package / without).unlink()
        if (here / without).exists():
            shutil.copy(here / without, package / without)
    return place


@pytest.fixture(scope="module")
def larger(tmp_path_factory):
    """Where a package with the law is."""
    return copied(tmp_path_factory.mktemp("larger"))


def run(place, *words):
    paths = (place, EXAMPLE.parent / "law", HERE.parents[1] / "benchmarks")
    return subprocess.run(
        [sys.executable, *map(str, words)],
        capture_output=True,
        text=True,
        cwd=HERE.parents[1],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths))},
    )


def said(place, *words):
    """Last line that a program prints which ends well."""
    done = run(place, *words)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()[-1]


def checked(place):
    """Run the tests of laws and formulas that concern the new law alone."""
    files = (HERE / "laws" / "test_elastic.py", HERE / "formulas" / "test_formulas.py")
    asked = ("-m", "pytest", "-n", 0, "-p", "no:cacheprovider", "-k", NAME.upper(), *files)
    return run(place, *asked)


def test_a_law_stands_in_four_files_and_no_others(larger):
    def differing(pair, folder=Path()):
        names = [*pair.diff_files, *pair.right_only]
        yield from (str(folder / name) for name in names if name != "__pycache__")
        for name, inner in pair.subdirs.items():
            yield from differing(inner, folder / name)

    pair = dircmp(Path(corporeal.__file__).parent, larger / "corporeal", ignore=["__pycache__"])
    assert set(differing(pair)) == PLACES


@pytest.mark.slow
def test_the_tests_of_laws_and_formulas_hold_for_it(larger):
    """Stress is the slope of the energy; C++ agrees to 2e-6 at both widths; waves are bounded."""
    done = checked(larger)
    assert done.returncode == 0, done.stdout[-2000:]
    assert done.stdout.count(".") >= 12


@pytest.mark.slow
def test_a_law_that_dispatch_forgets_fails_them(tmp_path):
    place = copied(tmp_path)
    menu = place / "corporeal" / "mpm" / "formulas" / "__init__.py"
    known = "k is not Law.HENCKY"
    assert known in menu.read_text()
    menu.write_text(menu.read_text().replace(known, f"{known} and k is not Law.{NAME.upper()}"))
    done = checked(place)
    assert done.returncode == 1
    assert "test_the_stress_of_every_law_is_that_of_float64" in done.stdout
    assert "test_the_stored_energy_is_that_of_numpy" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", *(pytest.param(e, marks=pytest.mark.slow) for e in ("cpu", "cuda"))])
def test_a_bar_of_it_swings_as_theory_and_rubber_do_in_every_engine(engine, larger):
    """On 16 cells a bar seems 3 % longer, whatever its law; an unstressed one would not turn."""
    ours, rubber = json.loads(said(larger, "-c", SWING, engine, MATERIAL, "rubber"))
    assert ours["period"] == pytest.approx(1.0, abs=0.04)
    assert ours["period"] == pytest.approx(rubber["period"], rel=2e-3)
    assert ours["stored"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_it_compiles_for_cards_without_one(larger, tmp_path):
    made = said(larger, "-c", CARDS, tmp_path).split()
    assert [name.split(".")[-2] for name in made] == ["sm86", "sm90", "sm120"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("without", "words"),
    {
        f"mpm/laws/{NAME}.py": f"there is no mpm/laws/{NAME}.py",
        "mpm/formulas/laws.h": f"laws.h has no struct Rule<{NAME.upper()}, R>",
        "core/types/material_field.py": f"KeyError: '{NAME.upper()}'",
        "materials/library.toml": f"Unknown material '{MATERIAL}'",
    }.items(),
)
def test_a_place_that_was_forgotten_is_named(without, words, tmp_path):
    done = run(copied(tmp_path, without), "-c", SWING, "reference", MATERIAL)
    assert done.returncode != 0
    assert words in done.stderr
