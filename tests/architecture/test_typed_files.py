"""What one file writes, another reads by the names of fields, not by strings.

Two patterns betray a dictionary that should be a dataclass: two string keys in a row, and string
keys on what a JSON file gave in a module that does not write such a file itself.
"""

import ast
from pathlib import Path

import pytest

import corporeal

ROOT = Path(corporeal.__file__).parent
SOURCES = sorted(ROOT.rglob("*.py"))
NESTED = {
    "export/animated_glb_reader.py": "attributes of a primitive, as glTF has them",
    "reconstruction/segment/part_attributes.py": "the table of colours beside it, written by hand",
}
"""Modules that may read two string keys in a row, and why."""
FOREIGN = {
    "viewer/commands.py": "orders of a page, of which nothing is trusted",
    "io/splat/sog.py": "meta.json of splats in SOG, a format of others",
    "materials/library.py": "libraries of materials, written by hand",
    "materials/library_lint.py": "libraries of materials, whose mistakes it finds",
    "reconstruction/segment/part_attributes.py": "the table of colours beside it, written by hand",
}
"""Modules that may read the keys of files which they do not write, and why."""
READERS, WRITERS = {"read_json", "load", "loads"}, {"write_json", "dump", "dumps"}


def called(node):
    """Last name of what a call calls: ``read_json`` of ``store.read_json(path)``."""
    if not isinstance(node, ast.Call):
        return None
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", None)


def parses(node):
    """Whether an expression is the content of a JSON or TOML file."""
    name = called(node)
    if name == "read_json":
        return True
    of = getattr(getattr(node, "func", None), "value", None)
    return name in READERS and getattr(of, "id", None) in ("json", "tomllib")


def holder(node):
    """What is read by a string key: ``x`` of ``x["a"]`` and of ``x.get("a")``; else None."""
    if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
        key, inside = node.slice, node.value
    elif called(node) == "get" and isinstance(node.func, ast.Attribute) and node.args:
        key, inside = node.args[0], node.func.value
    else:
        return None
    return inside if isinstance(key, ast.Constant) and isinstance(key.value, str) else None


def nested_reads(text):
    """Lines that read two string keys in a row."""
    nodes = ast.walk(ast.parse(text))
    return [n.lineno for n in nodes if (inside := holder(n)) is not None and holder(inside)]


def reads_of_parsed(text):
    """Lines that read a string key of what a file gave, in a text that writes no file."""
    if not any(name in text for name in ("read_json", "json", "tomllib")):
        return []  # nothing of it parses
    tree = ast.parse(text)
    if any(called(node) in WRITERS for node in ast.walk(tree)):
        return []
    lines = []
    for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
        nodes = list(ast.walk(function))
        parsed = {
            target.id
            for node in nodes
            if isinstance(node, ast.Assign) and parses(node.value)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for node in nodes:
            inside = holder(node)
            if inside is not None and (parses(inside) or getattr(inside, "id", None) in parsed):
                lines.append(node.lineno)
    return lines


def room(path):
    return path.relative_to(ROOT).as_posix()


RULES = pytest.mark.parametrize(
    ("find", "allowed"),
    [(nested_reads, NESTED), (reads_of_parsed, FOREIGN)],
    ids=["two keys in a row", "keys of a file"],
)


@pytest.mark.slow
@RULES
def test_what_another_file_wrote_is_read_by_the_names_of_fields(find, allowed):
    found = {room(path): find(path.read_text()) for path in SOURCES}
    found = {name: lines for name, lines in found.items() if lines and name not in allowed}
    assert not found, "Read it into a dataclass where it is written: typed(Kind, read_json(path))."


@RULES
def test_no_exception_outlives_its_reason(find, allowed):
    assert {name for name in allowed if not find((ROOT / name).read_text())} == set()


@pytest.mark.parametrize(
    "line", ['audit["outcome"]["objects"]', 'row.get("metrics")["ape"]', 'x["a"].get("b")', 'f()["a"]["b"]']
)
def test_two_keys_in_a_row_are_found(line):
    assert nested_reads(line) == [1]


@pytest.mark.parametrize("line", ['x["a"][0]', "x[0][1]", 'x["a"]', 'x["a"].b["c"]', 'x["a"] = 1'])
def test_one_key_and_numbers_are_not(line):
    assert nested_reads(line) == []


READ = "def f(path):\n    made = read_json(path)\n    return made['objects']\n"


def test_keys_of_a_file_are_found_where_it_is_not_written():
    assert reads_of_parsed(READ) == [3]
    assert reads_of_parsed("def f(path):\n    return store.read_json(path)['key']\n") == [2]
    assert reads_of_parsed(READ + "    write_json(path, {})\n") == []
    assert reads_of_parsed(READ.replace("read_json", "read_composition")) == []
