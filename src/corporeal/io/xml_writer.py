"""Writing of XML."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path
from typing import cast

import numpy as np


def xml_numbers(values: Iterable[float] | np.ndarray) -> str:
    """Write numbers in twelve digits with spaces between."""
    return " ".join(f"{x:.12g}" for x in np.ravel(np.asarray(values, dtype=float)))


def write_xml(path: Path, root: ET.Element) -> None:
    """Write a document, indented."""
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n', encoding="utf-8")


def xml_comment(text: str) -> ET.Element:
    """Return a comment; two dashes, which XML forbids in one, are parted."""
    while "--" in text:
        text = text.replace("--", "- -")
    closed = text.rstrip("-")
    return cast(ET.Element, ET.Comment(f" {closed} "))
