"""Structs shared by Python and C++, each declared once.

    TETHER = Record("Tether", ("double *", "anchor rate"), ("double[3]", "arm"), ("int", "count"))
    rows = np.zeros(4, TETHER.dtype)
    text = TETHER.text

What Python and the C++ compiler make of a declaration is asserted by the compiler for the size, and by a test for every
member.
"""

import re
from collections.abc import Sequence

import numpy as np

NUMPY_TYPE_NAMES = {
    "double": "f8",
    "float": "f4",
    "int": "i4",
    "long long": "i8",
    "unsigned long long": "u8",
    "unsigned char": "u1",
}
"""NumPy's name of each type of C++ that a record may hold."""
POINTER_DTYPE = "u8"
"""NumPy's name of a pointer, to whatever."""
_MEMBER_PATTERN = re.compile(r"(?P<kind>\w[\w ]*\w)(?P<pointer> \*)?(?P<shape>(\[\d+\])*)")


class NativeRecord:
    """One struct: its name, its layout in NumPy, and its text in C++."""

    def __init__(self, name: str, *rows: tuple[str, str], within: Sequence["NativeRecord"] = ()) -> None:
        """Declare a struct.

        Args:
            name: In C++.
            rows: Its members in order: a type, and the names of the members that have it. A type is one of
                ``NUMPY_TYPE_NAMES`` or of ``within``, or anything followed by `` *``; ``[n]`` after it makes arrays.
            within: Records that are members of this one.

        Raises:
            ValueError: A type is none of these.
        """
        self.name = name
        inner = NUMPY_TYPE_NAMES | {record.name: record.dtype for record in within}
        members = [(member, *_parsed_member(kind, inner)) for kind, names in rows for member in names.split()]
        self.dtype = np.dtype(members, align=True)
        self.text = _struct_text(name, rows, self.dtype)


def _parsed_member(kind: str, inner: dict[str, str | np.dtype]) -> tuple[str | np.dtype, tuple[int, ...]]:
    """Type and shape of a member in NumPy."""
    found = _MEMBER_PATTERN.fullmatch(kind)
    if found is None or not (found["pointer"] or found["kind"] in inner):
        known = ", ".join(inner)
        raise ValueError(f"A record cannot hold {kind!r}: take one of {known}, or a pointer.")
    shape = tuple(int(size) for size in re.findall(r"\d+", found["shape"]))
    return POINTER_DTYPE if found["pointer"] else inner[found["kind"]], shape


def _struct_text(name: str, rows: Sequence[tuple[str, str]], dtype: np.dtype) -> str:
    lines = [f"struct {name} {{"]
    for kind, names in rows:
        base, bracket, sizes = kind.partition("[")
        base, star, _ = base.partition(" *")
        pointer = star.strip()
        members = (f"{pointer}{member}{bracket}{sizes}" for member in names.split())
        lines.append(f"  {base} {', '.join(members)};")
    lines.append("};")
    size, step = f"sizeof({name}) == {dtype.itemsize}", f"alignof({name}) == {dtype.alignment}"
    lines.append(f'static_assert({size} && {step}, "{name} as mpm/native_records.py lays it out");')
    return "\n".join(lines) + "\n"
