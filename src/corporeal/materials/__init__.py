"""The measured library: what a material is like, in which range, and who measured it."""

from corporeal.materials.contact import Friction, combine, friction_between, restitution_between
from corporeal.materials.library import (
    Entry,
    citation,
    contents,
    counterpart,
    find,
    library,
    read,
    sources,
)
from corporeal.materials.lint import lint
from corporeal.materials.quantities import QUANTITIES, Quantity, si
from corporeal.materials.tables import markdown, materials_json, menu, show

__all__ = [
    "QUANTITIES",
    "Entry",
    "Friction",
    "Quantity",
    "citation",
    "combine",
    "contents",
    "counterpart",
    "find",
    "friction_between",
    "library",
    "lint",
    "markdown",
    "materials_json",
    "menu",
    "read",
    "restitution_between",
    "show",
    "si",
    "sources",
]
