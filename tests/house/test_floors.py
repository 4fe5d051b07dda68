"""The house stands because every import points down."""

import ast
from collections import defaultdict
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import corporeal

ROOT = Path(corporeal.__file__).parent
FLOORS = [
    {"errors", "machine", "progress", "typed", "types", "version"},
    {"mpm"},  # a library of its own, whose laws the rest of the house asks
    {"findings"},
    {"geometry", "backends", "store"},
    {"formats"},
    {"materials", "vlm", "render", "showcase", "pool", "settle"}
    | {"splats", "features", "regions", "poses", "masking"},
    {"treatment", "fields", "reconstruction", "description"},
    {"settings"},  # of all verbs, read without what does them
    {"trajectory"},
    {"stages"},
    {"mixture"},
    {"results"},
    {"playback"},
    {"run_files"},
    {"pipeline"},
    {"corpus", "scene_building", "in_memory"},
    {"evaluation"},  # whose runs are jobs, as those of a corpus are
    {"export"},
    {"doctor", "terminal", "viewer"},
    {"cli"},
]
SOLVER = [
    {"constants", "records"},
    {"problem", "ledger", "laws", "warp_start"},
    {"physics"},
    # Laws and physics in C++, with the numbers of physics; and what bodies are made of.
    {"formulas", "substance"},
    {"state"},
    {"measure"},
    {"interaction", "joining", "splitting"},
    {"reference", "cpu", "cuda"},
]
"""Floors within ``mpm``: engines stand side by side and know nothing of one another."""
TWINS = {
    # One physics and three engines: who knows one room of the solver knows all.
    "engine.py": "the solver's rooms mirror one another",
    "program.py": "the solver's rooms mirror one another",
    "loads.py": "the solver's rooms mirror one another",
    "layout.py": "the solver's rooms mirror one another",
    "springs.py": "the solver's rooms mirror one another",
    "inclusions.py": "the solver's rooms mirror one another",
    "rigid.py": "the solver's rooms mirror one another",
    "contact.py": "the solver's rooms mirror one another; the library has measured pairs",
    "contact_impulses.py": "the solver's rooms mirror one another",
    # What a verb does stands in stages, how a person asks for it in cli.
    "export.py": "a verb, and how it is asked for",
    "assemble.py": "a verb, how it is asked for, and the same for a corpus",
    "capture.py": "a verb, and how it is asked for",
    "report.py": "a verb, and the same for a corpus",
    # A room makes something, and another judges what it made.
    "objects.py": "what finds objects, and what measures how well",
    "parts.py": "what finds parts, and what measures how well",
    "ensemble.py": "what draws values, and what simulates with them",
    "sizes.py": "what a model says of sizes, and what follows from it",
    # Both are what the field calls so.
    "hull.py": "the convex hull, and the visual hull",
    "meshes.py": "what reads models of all formats, and what is exported of a body",
    "mesh.py": "a mesh to measure, and a mesh to build models of",
    "shape.py": "distances from a mesh, and shapes that models are built of",
    "plan.py": "of a corpus, and of how parts enter a simulation",
    "words.py": "of names in files, and of a model's answers",
}
"""File names in more than one room, and why."""
SOURCES = sorted(ROOT.rglob("*.py"))


def name_of(path):
    """Dotted name of a module, or of a package for its ``__init__``."""
    words = ("corporeal", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(words).removesuffix(".__init__")


MODULES = {name_of(path): path for path in SOURCES}


@cache
def imported(path):
    """Modules of the house that a file imports: anywhere in it, and for type checkers alone."""
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


def floors(rooms):
    return {room: floor for floor, side_by_side in enumerate(rooms) for room in side_by_side}


def climbing(folder, rooms):
    """Imports between rooms of a folder that do not point down."""
    floor, inside = floors(rooms), ".".join(("corporeal", *folder.relative_to(ROOT).parts))
    for path in sorted(folder.rglob("*.py")):
        room = path.relative_to(folder).parts[0].removesuffix(".py")
        for module in imported(path):
            other = module.removeprefix(f"{inside}.").split(".")[0]
            if (
                room not in ("__init__", "__main__")
                and module.startswith(f"{inside}.")
                and other != room
            ):
                if floor[other] >= floor[room]:
                    yield f"{room} imports {other} ({name_of(path)})"


def rooms_of(folder):
    return {path.relative_to(folder).parts[0].removesuffix(".py") for path in folder.rglob("*.py")}


@pytest.mark.parametrize(
    ("folder", "rooms"), [(ROOT, FLOORS), (ROOT / "mpm", SOLVER)], ids=["house", "solver"]
)
def test_imports_point_down(folder, rooms):
    assert rooms_of(folder) - {"__init__", "__main__"} == set(floors(rooms))
    assert list(climbing(folder, rooms)) == []


def test_no_stage_imports_a_stage():
    stages = {name for name in MODULES if name.startswith("corporeal.stages.")}
    for name in stages:
        assert stages.isdisjoint(imported(MODULES[name])), name


def test_no_import_leads_back_to_where_it_came_from():
    """Not even imports for type checkers, or inside functions, go in circles."""
    graph = {name: set(imported(path)) - {name} for name, path in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' → '.join(reversed(error.args[1]))}")


def test_the_solver_could_leave_the_house():
    """The solver depends on the ground floor only, never on torch, models or stages."""
    for path in (ROOT / "mpm").rglob("*.py"):
        used = {module.split(".")[1] for module in imported(path) if "." in module}
        assert used <= {"mpm", *FLOORS[0]}, path


def test_a_file_name_stands_in_two_rooms_only_for_a_reason():
    homes = defaultdict(list)
    for path in SOURCES:
        homes[path.name].append(path)
    twins = {name for name, paths in homes.items() if len(paths) > 1}
    assert twins - {"__init__.py", "__main__.py"} == set(TWINS)


def test_every_test_file_has_a_name_of_its_own():
    """Pytest takes two files of one name, in folders without packages, for one module."""
    names = [path.name for path in Path(__file__).parents[1].rglob("test_*.py")]
    assert len(names) == len(set(names))
