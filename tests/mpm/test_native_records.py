"""Structs lie in C++ where NumPy lays them out."""

import numpy as np
import pytest

from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.program import COMPILE_OPTIONS
from corporeal.mpm.native_records import NUMPY_TYPE_NAMES, NativeRecord
from corporeal.mpm.quiet_warp import wp

wp.set_module_options(COMPILE_OPTIONS)

RECORDS = (*layout.STEP_RECORDS, *layout.CONTACT_RECORDS, layout.SORTING_RECORD, layout.READING_RECORD)
MIXED = NativeRecord(
    "Mixed",
    ("unsigned char", "tag"),
    ("double[2][3]", "matrix"),
    ("int", "count"),
    ("void *", "there"),
    ("float[3]", "arm"),
    ("long long", "large"),
    ("Post", "post"),
    within=(layout.POST_RECORD,),
)
"""One member of each type, in an order that leaves holes."""


def described(dtype):
    """Offset and size of every member, then size and alignment of the whole."""
    members = [(offset, kind.itemsize) for kind, offset in dtype.fields.values()]
    return np.array([*members, (dtype.itemsize, dtype.alignment)])


def questions(records):
    """C++ text that answers the same of some structs."""
    asked = []
    for record in records:
        for member in record.dtype.names:
            here = f"(({record.name} *)0)->{member}"
            asked += [f"__builtin_offsetof({record.name}, {member})", f"sizeof({here})"]
        asked += [f"sizeof({record.name})", f"alignof({record.name})"]
    answers = "\n".join(f"out[{i}] = (int){text};" for i, text in enumerate(asked))
    return "".join(record.text for record in records) + f"int *out = (int *)given.data;\n{answers}"


@wp.func_native(questions((*RECORDS, MIXED)))
def ask(given: wp.array(dtype=wp.int32)): ...


@wp.kernel
def answer(given: wp.array(dtype=wp.int32)):
    ask(given)


@pytest.fixture(name="compiled", scope="module")
def what_the_compiler_says():
    rows = [len(record.dtype.names) + 1 for record in (*RECORDS, MIXED)]
    out = wp.zeros(2 * sum(rows), dtype=wp.int32, device="cpu")
    wp.launch(answer, 1, [out], device="cpu")
    split = np.split(out.numpy().reshape(-1, 2), np.cumsum(rows)[:-1])
    return dict(zip([*RECORDS, MIXED], split, strict=True))


@pytest.mark.parametrize("record", [*RECORDS, MIXED], ids=lambda record: record.name)
def test_members_lie_where_numpy_puts_them(record, compiled):
    assert np.array_equal(compiled[record], described(record.dtype))


def test_a_layout_without_holes_would_be_distinguished_from_it(compiled):
    packed = np.dtype([(n, MIXED.dtype.fields[n][0]) for n in MIXED.dtype.names])
    assert not np.array_equal(compiled[MIXED], described(packed))


def test_every_thread_has_a_cache_line_of_its_own():
    assert layout.POST_RECORD.dtype.itemsize == 64
    offset = {name: layout.THREAD_POOL_RECORD.dtype.fields[name][1] for name in ("epoch", "done", "post")}
    assert all(place % 64 == 0 for place in offset.values())


@pytest.mark.parametrize("kind", ["short", "double **", "double[n]", "Post", ""])
def test_what_a_record_cannot_hold_is_refused(kind):
    with pytest.raises(ValueError, match="cannot hold"):
        NativeRecord("Odd", (kind, "a"))


def test_a_record_holds_every_type_that_it_names():
    for kind, name in NUMPY_TYPE_NAMES.items():
        assert NativeRecord("One", (kind, "a")).dtype["a"] == np.dtype(name)
