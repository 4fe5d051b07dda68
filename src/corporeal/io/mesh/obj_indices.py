"""Conversion of relative OBJ indices to absolute ones.

``f -3 -2 -1`` means the last three vertices *so far* (Wavefront, "Object Files", 1995: reference
numbers). Readers that count back from the end of the file join other vertices wherever vertices
and faces alternate.
"""

import re

INDEX_SLOT_OF_KEYWORD = {b"v": 0, b"vt": 1, b"vn": 2}
"""What corners refer to, by their place in ``v/vt/vn``."""
OBJ_ELEMENT_KEYWORDS = (b"f", b"fo", b"l", b"p")
RELATIVE_INDEX_PATTERN = re.compile(rb"(?m)^[ \t]*fo?[ \t](?:[^\r\n]*[ \t/])?-\d")
"""A face that counts back."""
LINE_CONTINUATION_PATTERN = re.compile(rb"\\[ \t]*(?:\r\n|\r|\n)")


def with_absolute_indices(data: bytes) -> bytes:
    """Return an OBJ in which no corner counts back; one that has none is returned as it is."""
    whole = LINE_CONTINUATION_PATTERN.sub(b" ", data) if b"\\" in data else data
    if RELATIVE_INDEX_PATTERN.search(whole) is None:
        return data
    so_far, lines = [0, 0, 0], []
    for line in whole.splitlines():
        words = line.split()
        kind = words[0] if words else b""
        if kind in INDEX_SLOT_OF_KEYWORD:
            so_far[INDEX_SLOT_OF_KEYWORD[kind]] += 1
        elif kind in OBJ_ELEMENT_KEYWORDS and b"-" in line:
            line = b" ".join([kind, *(_absolute_corner(word, so_far) for word in words[1:])])
        lines.append(line)
    return b"\n".join([*lines, b""])


def _absolute_corner(corner: bytes, so_far: list[int]) -> bytes:
    """Return a corner ``v/vt/vn``; what is no number stays, for the reader to refuse."""
    places = corner.split(b"/")
    for k, place in enumerate(places[: len(so_far)]):
        if re.fullmatch(rb"-\d{1,18}", place):
            places[k] = b"%d" % (so_far[k] + 1 + int(place))
    return b"/".join(places)
