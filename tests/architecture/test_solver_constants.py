"""Every number of the method stands once: in ``mpm/constants.py``.

A number has a name where it is assigned to one in capitals, in Python or in C++. What is written
without a name may only be arithmetic: whole numbers and binary fractions, as coefficients of
splines and quadratures are. Laws keep their own numbers, each in its own file.
"""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

import corporeal.mpm

ROOT = Path(corporeal.mpm.__file__).parent
HOME = "constants.py"
LAYOUTS = ("cpu/layout.py", "cuda/layout.py")
"""Each engine numbers what lies in its own memory."""
OF_A_LAW = ("laws/", "formulas/laws.h")
TEXTS = {
    str(path.relative_to(ROOT)): path.read_text()
    for path in sorted(ROOT.rglob("*"))
    if path.suffix in (".py", ".h", ".cpp")
}
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
LITERAL = r"[-+]?(?:0[xX][\da-fA-F]+|(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
NAMED = re.compile(rf"\b([A-Z][A-Z0-9_]*)\s*=\s*({LITERAL})[fFlLuU]*(?=\s*[,;}}])")
DEFINED = re.compile(rf"#\s*define\s+([A-Z]\w*)\s+\(?({LITERAL})")
DECLARED = re.compile(r"\b(?:constexpr|const|enum)\b[^;{=]*[={][^;]*;")
FRACTION = re.compile(r"(?<![\w.])(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][-+]?\d+)?")


def whole(path):
    return path.endswith(".py")


def is_arithmetic(value):
    """Whether a number is a whole one or a binary fraction, none of them large."""
    return float(64 * value).is_integer() and abs(value) <= 64


# ---------------------------------------------------------------- in Python


def has_literal(node):
    """Whether an expression is made of numbers alone, wrapped or not: .5, wp.constant(D(.5)) …"""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return has_literal(node.operand)
    if isinstance(node, ast.BinOp):
        return has_literal(node.left) and has_literal(node.right)
    if isinstance(node, ast.Call):
        return len(node.args) == 1 and has_literal(node.args[0])
    return False


def assigned_in_python(text):
    """Give names in capitals that a module gives numbers, and the expressions."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                names = target.elts if isinstance(target, ast.Tuple) else [target]
                values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
                if len(values) != len(names):
                    values = [node.value] * len(names)
                for name, value in zip(names, values, strict=True):
                    if isinstance(name, ast.Name) and name.id.isupper() and has_literal(value):
                        yield name.id, value


def is_fraction(node):
    return any(isinstance(n, ast.Constant) and isinstance(n.value, float) for n in ast.walk(node))


def fractions_in_python(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, float):
            yield node.value


# ---------------------------------------------------------------- in C++


def assigned_in_cpp(text):
    """Give names in capitals that are constants with a number, and the numbers."""
    text = COMMENT.sub("", text)
    yield from DEFINED.findall(text)
    for declaration in DECLARED.findall(text):
        yield from NAMED.findall(declaration)


def fractions_in_cpp(text):
    for literal in FRACTION.findall(COMMENT.sub("", text)):
        yield float(literal)


# ---------------------------------------------------------------- the rules


def names(texts):
    """Files in which each name in capitals is given a number."""
    homes = defaultdict(list)
    for path, text in texts.items():
        found = assigned_in_python(text) if whole(path) else assigned_in_cpp(text)
        for name, _ in found:
            homes[name].append(path)
    return homes


def assigned_twice(texts):
    """Names that are given a number in several places, engines' own memory aside."""
    return {name: paths for name, paths in names(texts).items() if len(paths) > 1 and sorted(paths) != list(LAYOUTS)}


def named_elsewhere(texts):
    """Fractions that have a name outside of the numbers' home."""
    for path, text in texts.items():
        if path == HOME or path.startswith(OF_A_LAW):
            continue
        if whole(path):
            yield from ((path, name) for name, value in assigned_in_python(text) if is_fraction(value))
        else:
            yield from ((path, name) for name, value in assigned_in_cpp(text) if "." in value)


def unnamed(texts):
    """Numbers that are no arithmetic, and stand somewhere without a name."""
    for path, text in texts.items():
        if path == HOME or path.startswith(OF_A_LAW):
            continue
        found = fractions_in_python(text) if whole(path) else fractions_in_cpp(text)
        yield from ((path, value) for value in found if not is_arithmetic(value))


def test_no_number_is_given_a_name_twice():
    assert assigned_twice(TEXTS) == {}


def test_fractions_have_names_at_home_only():
    assert list(named_elsewhere(TEXTS)) == []


def test_numbers_without_a_name_are_arithmetic():
    assert list(unnamed(TEXTS)) == []


def test_the_numbers_are_found():
    """The rules above would hold of nothing at all."""
    homes = names(TEXTS)
    assert homes["WALL_REACH"] == homes["SWEEPS"] == [HOME]
    assert homes["XI"] == ["cpu/layout.py"]
    assert homes["PATIENCE"] == ["cpu/loops/step_loop.cpp"]
    assert len(homes) > 150


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("reference/contact.py", "WALL_REACH = 0.5"),
        ("reference/contact.py", "FIRST_BIAS, WALL_REACH = 0.1, 0.5"),
        ("cuda/contact.py", "WALL_REACH = wp.constant(0.51)"),
        ("cuda/contact.py", "WALL_REACH = wp.constant(D(0.51))"),
        ("cpu/loops/timestep.cpp", "constexpr double WALL_REACH = 0.51;"),
        ("cpu/loops/timestep.cpp", "const double A = 1, WALL_REACH = .51;"),
        ("formulas/contact.h", "static const float WALL_REACH = 0.51f;"),
        ("formulas/contact.h", "#define WALL_REACH 0.51f"),
        ("cpu/loops/timestep.cpp", "enum { NONE, SWEEPS = 10 };"),
        ("cpu/loops/timestep.cpp", "const int XI = 0;"),
        ("formulas/laws.h", "constexpr int SWEEPS = 10;"),
    ],
)
def test_a_planted_second_name_is_found(path, line):
    planted = TEXTS | {path: f"{TEXTS[path]}\n{line}\n"}
    assert set(assigned_twice(planted)) & {"WALL_REACH", "SWEEPS", "XI"}


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("physics/rigid.py", "NEAR_A_WALL = 0.5"),
        ("cuda/contact.py", "NEAR = wp.constant(D(0.5))"),
        ("cpu/loops/timestep.cpp", "constexpr double NEAR = 0.5, FAR = 2;"),
    ],
)
def test_a_planted_fraction_with_a_name_of_its_own_is_found(path, line):
    planted = TEXTS | {path: f"{TEXTS[path]}\n{line}\n"}
    assert [where for where, _ in named_elsewhere(planted)] == [path]


@pytest.mark.parametrize(
    ("path", "line", "value"),
    [
        ("physics/rigid.py", "def near(h): return h < 0.51", 0.51),
        ("cpu/loops/timestep.cpp", "if (h > 0.51f * dx) return;", 0.51),
        ("cpu/loops/timestep.cpp", "double fine = 2e-3 * dx;", 2e-3),
        ("formulas/loads.h", "double most = 1e+30f;", 1e30),
    ],
)
def test_a_planted_number_without_a_name_is_found(path, line, value):
    planted = TEXTS | {path: f"{TEXTS[path]}\n{line}\n"}
    assert list(unnamed(planted)) == [(path, value)]
