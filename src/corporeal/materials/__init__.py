"""The measured library: what a material is like, in which range, and who measured it."""

from corporeal.materials.contact import (
    BlowLaw,
    Friction,
    Restitution,
    Striker,
    combine,
    friction_between,
    law_of_blows,
    restitution,
    restitution_between,
)
from corporeal.materials.entry import Entry
from corporeal.materials.library import (
    check,
    contents,
    counterpart,
    find,
    library,
    named,
    read,
    substances,
)
from corporeal.materials.lint import Problem
from corporeal.materials.listing import materials_json, menu, show
from corporeal.materials.quantities import QUANTITIES, Quantity, si
from corporeal.materials.reference_page import markdown
from corporeal.materials.shipped import citation, estimated, sources

__all__ = [
    "QUANTITIES",
    "BlowLaw",
    "Entry",
    "Friction",
    "Problem",
    "Quantity",
    "Restitution",
    "Striker",
    "check",
    "citation",
    "combine",
    "contents",
    "counterpart",
    "estimated",
    "find",
    "friction_between",
    "law_of_blows",
    "library",
    "markdown",
    "materials_json",
    "menu",
    "named",
    "read",
    "restitution",
    "restitution_between",
    "show",
    "si",
    "sources",
    "substances",
]
