"""What passes between functions has a name."""

import ast
from pathlib import Path

import pytest

import corporeal

ROOT = Path(corporeal.__file__).parent
SOURCES = sorted(str(path.relative_to(ROOT)) for path in ROOT.rglob("*.py"))


def mixed(annotation, aliases=()):
    """Tuples in an annotation, and names of such, that pack values of unlike types."""
    for node in ast.walk(annotation):
        if isinstance(node, ast.Name) and node.id in aliases:
            yield node.id
        of_tuple = isinstance(node, ast.Subscript) and ast.unparse(node.value) == "tuple"
        if of_tuple and isinstance(node.slice, ast.Tuple):
            types = {ast.unparse(element) for element in node.slice.elts} - {"..."}
            if len(types) > 1:
                yield ast.unparse(node)


def packed(text):
    """Parameters of a file's functions that are tuples of unlike types."""
    tree = ast.parse(text)
    aliases = {
        target.id
        for node in tree.body
        if isinstance(node, ast.Assign) and any(mixed(node.value))
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            a = function.args
            for parameter in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg):
                if parameter is not None and parameter.annotation is not None:
                    found = ", ".join(mixed(parameter.annotation, aliases))
                    if found:
                        yield f"line {parameter.lineno}: {parameter.arg}: {found}"


@pytest.mark.parametrize(
    "text",
    [
        "def f(at: tuple[str, int]): ...",
        "class C:\n    def f(self, *, pairs: list[tuple[int, np.ndarray]] | None = None): ...",
        "Rows = list[tuple[str, float]]\ndef f(rows: Rows): ...",
        "def f(shapes: tuple[tuple[int, int, int], tuple[int, int]]): ...",
    ],
)
def test_a_parameter_that_packs_unlike_values_is_found(text):
    assert list(packed(text))


@pytest.mark.parametrize(
    "text",
    [
        "def f(size: tuple[int, int]): ...",
        "def f(cameras: tuple[Camera, ...]): ...",
        "def f(x: dict[str, tuple[float, float]]) -> tuple[int, str]: ...",
    ],
)
def test_extents_and_sequences_of_one_kind_may_pass(text):
    assert not list(packed(text))


@pytest.mark.slow
def test_no_parameter_is_a_tuple_of_unlike_values():
    """A small frozen dataclass says what each of them is."""
    found = {name: list(packed((ROOT / name).read_text())) for name in SOURCES}
    found = {name: lines for name, lines in found.items() if lines}
    assert found == {}
