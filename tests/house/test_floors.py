"""The house stands because every import points down."""

import ast
from pathlib import Path

import pytest

import corporeal

ROOT = Path(corporeal.__file__).parent
FLOORS = [
    {"errors", "machine", "types"},
    {"geometry", "backends", "store"},
    {"formats"},
    {"materials", "vlm", "render", "showcase", "mpm", "pool", "settle"}
    | {"splats", "features", "regions"},
    {"stages"},
    {"results"},
    {"pipeline"},
    {"corpus", "evaluation"},
    {"doctor", "terminal"},
    {"cli"},
]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
SOURCES = sorted(ROOT.rglob("*.py"))


def imported_modules(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            if node.module == "corporeal" or node.module.count(".") == 1:
                yield from (f"{node.module}.{alias.name}" for alias in node.names)


def rooms(path):
    for module in imported_modules(path):
        words = module.split(".")
        if words[0] == "corporeal" and len(words) > 1 and words[1] in FLOOR:
            yield words


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_point_down(path):
    here = path.relative_to(ROOT)
    room = here.parts[0].removesuffix(".py")
    if here.name == "__init__.py" and len(here.parts) == 1:
        return
    for words in rooms(path):
        other = words[1]
        assert FLOOR[other] < FLOOR[room] or other == room, f"{room} imports {other}"
        if room == other == "stages" and len(words) > 2:
            assert (ROOT / "stages" / f"{words[2]}.py").exists() is False, "a stage imports a stage"


def test_every_room_has_a_floor():
    found = {p.relative_to(ROOT).parts[0].removesuffix(".py") for p in SOURCES}
    assert found - {"__init__", "__main__"} <= set(FLOOR)


def test_the_solver_could_leave_the_house():
    """The solver depends on the ground floor only, never on torch, models or stages."""
    for path in (ROOT / "mpm").rglob("*.py"):
        assert {words[1] for words in rooms(path)} <= {"mpm", *FLOORS[0]}, path


def test_every_test_file_has_a_name_of_its_own():
    """Pytest takes two files of one name, in folders without packages, for one module."""
    names = [path.name for path in Path(__file__).parents[1].rglob("test_*.py")]
    assert len(names) == len(set(names))
