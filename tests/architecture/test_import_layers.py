"""Imports point down: every package imports packages of lower layers only."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import corporeal

ROOT = Path(corporeal.__file__).parent
PACKAGES = [
    {"core"},
    {"geometry", "jobs", "mpm"},  # mpm is a library of its own
    {"materials", "multiview", "showcase"},
    {"recognition"},
    {"discretization", "io", "render"},
    {"fields", "pool", "scene", "vlm"},
    {"description", "reconstruction"},
    {"simulation"},
    {"pipeline"},
    {"lab"},
    {"export"},
    {"viewer"},
    {"cli"},
]
"""Layers of the package, lowest first; packages of one layer do not import each other."""
SOLVER = [
    {"constants", "native_records"},
    {"problem", "ledger", "laws", "quiet_warp"},
    {"physics"},
    {"formulas", "material_table", "shells"},
    {"state"},
    {"diagnostics"},
    {"engines", "engine_interaction", "add_bodies", "split_body"},
    {"body_changes"},
    {"reference", "cpu", "cuda"},
]
"""Layers within ``mpm``: engines do not import each other."""
SOURCES = sorted(ROOT.rglob("*.py"))


def name_of(path):
    """Dotted name of a module, or of a package for its ``__init__``."""
    words = ("corporeal", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(words).removesuffix(".__init__")


MODULES = {name_of(path): path for path in SOURCES}


@cache
def imported(path):
    """Modules of the package that a file imports: anywhere in it, and for type checkers alone."""
    return tuple(_imported(path))


def _imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found = inner if inner in MODULES else node.module
                if found in MODULES:
                    yield found


def layers(packages):
    return {name: layer for layer, names in enumerate(packages) for name in names}


def upward_imports(folder, packages):
    """Imports between the packages of a folder that do not point down."""
    layer, inside = layers(packages), ".".join(("corporeal", *folder.relative_to(ROOT).parts))
    for path in sorted(folder.rglob("*.py")):
        package = path.relative_to(folder).parts[0].removesuffix(".py")
        for module in imported(path):
            other = module.removeprefix(f"{inside}.").split(".")[0]
            if package not in ("__init__", "__main__") and module.startswith(f"{inside}.") and other != package:
                if layer[other] >= layer[package]:
                    yield f"{package} imports {other} ({name_of(path)})"


def packages_of(folder):
    return {path.relative_to(folder).parts[0].removesuffix(".py") for path in folder.rglob("*.py")}


@pytest.mark.slow
@pytest.mark.parametrize(("folder", "packages"), [(ROOT, PACKAGES), (ROOT / "mpm", SOLVER)], ids=["package", "mpm"])
def test_imports_point_down(folder, packages):
    assert packages_of(folder) - {"__init__", "__main__"} == set(layers(packages))
    assert list(upward_imports(folder, packages)) == []


def test_no_stage_imports_a_stage():
    stages = {name for name in MODULES if name.startswith("corporeal.pipeline.stages.")}
    for name in stages:
        assert stages.isdisjoint(imported(MODULES[name])), name


def test_no_import_leads_back_to_where_it_came_from():
    """Not even imports for type checkers, or inside functions, go in circles."""
    graph = {name: set(imported(path)) - {name} for name, path in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' → '.join(reversed(error.args[1]))}")


def test_the_solver_depends_on_core_only():
    """The solver never depends on torch, models or stages."""
    for path in (ROOT / "mpm").rglob("*.py"):
        used = {module.split(".")[1] for module in imported(path) if "." in module}
        assert used <= {"mpm", "core"}, path


def test_engines_are_known_by_name_and_contract_only():
    """What runs an engine imports none: each on the menu must do for all."""
    engines = ("corporeal.mpm.cpu", "corporeal.mpm.cuda", "corporeal.mpm.reference")
    for package in ("lab", "pipeline", "simulation", "viewer"):
        for path in (ROOT / package).rglob("*.py"):
            assert not [m for m in imported(path) if m.startswith(engines)], path


def test_every_test_file_has_a_name_of_its_own():
    """Pytest takes two files of one name, in folders without packages, for one module."""
    names = [path.name for path in Path(__file__).parents[1].rglob("test_*.py")]
    assert len(names) == len(set(names))
