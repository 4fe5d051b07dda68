"""Records: structs that Python lays out and C++ text works in, each declared once.

    TETHER = Record("Tether", ("double *", "anchor rate"), ("double[3]", "arm"), ("int", "count"))
    rows = np.zeros(4, TETHER.dtype)
    text = TETHER.text

What Python and the C++ compiler make of a declaration is asserted by the compiler for the size, and
by a test for every member.
"""

import re
from collections.abc import Sequence

import numpy as np

KINDS = {
    "double": "f8",
    "float": "f4",
    "int": "i4",
    "long long": "i8",
    "unsigned long long": "u8",
    "unsigned char": "u1",
}
"""NumPy's name of each type of C++ that a record may hold."""
ADDRESS = "u8"
"""NumPy's name of a pointer, to whatever."""
_TYPE = re.compile(r"(?P<kind>\w[\w ]*\w)(?P<pointer> \*)?(?P<shape>(\[\d+\])*)")


class Record:
    """One struct: its name, its layout in NumPy, and its text in C++."""

    def __init__(self, name: str, *rows: tuple[str, str], within: Sequence["Record"] = ()) -> None:
        """Declare a struct.

        Args:
            name: In C++.
            rows: Its members in order: a type, and the names of the members that have it. A type is
                one of ``KINDS`` or of ``within``, or anything followed by `` *``; ``[n]`` after it
                makes arrays.
            within: Records that are members of this one.

        Raises:
            ValueError: A type is none of these.

        """
        self.name = name
        inner = KINDS | {record.name: record.dtype for record in within}
        members = [
            (member, *_parsed(kind, inner)) for kind, names in rows for member in names.split()
        ]
        self.dtype = np.dtype(members, align=True)
        self.text = _text(name, rows, self.dtype)


def _parsed(kind: str, inner: dict[str, str | np.dtype]) -> tuple[str | np.dtype, tuple[int, ...]]:
    """Type and shape of a member in NumPy."""
    found = _TYPE.fullmatch(kind)
    if found is None or not (found["pointer"] or found["kind"] in inner):
        known = ", ".join(inner)
        raise ValueError(f"A record cannot hold {kind!r}: take one of {known}, or a pointer.")
    shape = tuple(int(size) for size in re.findall(r"\d+", found["shape"]))
    return ADDRESS if found["pointer"] else inner[found["kind"]], shape


def _text(name: str, rows: Sequence[tuple[str, str]], dtype: np.dtype) -> str:
    lines = [f"struct {name} {{"]
    for kind, names in rows:
        base, bracket, sizes = kind.partition("[")
        base, star, _ = base.partition(" *")
        pointer = star.strip()
        members = (f"{pointer}{member}{bracket}{sizes}" for member in names.split())
        lines.append(f"  {base} {', '.join(members)};")
    lines.append("};")
    size, step = f"sizeof({name}) == {dtype.itemsize}", f"alignof({name}) == {dtype.alignment}"
    lines.append(f'static_assert({size} && {step}, "{name} as mpm/records.py lays it out");')
    return "\n".join(lines) + "\n"
