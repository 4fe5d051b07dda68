"""How a part is made: solid, wall or sheet, how thick, how heavy, and where its matter lies."""

from dataclasses import dataclass

import numpy as np

from corporeal.geometry.anatomy import Build
from corporeal.geometry.packing import Recipe
from corporeal.geometry.survey import Member
from corporeal.types import Material, PartWords, Structure, Treatment

SHEET_SHARE = 0.01
"""Thickness of an open sheet, of its middle extent, where nobody states it."""
POROUS_CELLS = 6
"""A shell narrower than this many cells is filled through, with the shell's mass."""


@dataclass(frozen=True)
class Make:
    """How one part is made: what was said about it and what its mesh shows, put together."""

    structure: Structure
    """As simulated: a solid whose mesh turns out to be a wall is a shell here."""
    modelled: bool
    """Whether the mesh shows both faces of the wall."""
    thickness: float
    """Of the wall [m]; 0: solid."""
    sheet: float
    """Thickness of open sheets [m]."""
    body_mass: float
    """Of what its surface encloses [kg]."""
    sheet_mass: float
    """Of its open sheets [kg]."""
    area: float
    """One side [m²]."""
    volume: float
    """Enclosed by the surface, and of the sheets [m³]."""

    @property
    def mass(self) -> float:
        """All of it [kg]."""
        return self.body_mass + self.sheet_mass


def decide(member: Member, structure: Structure, material: Material, words: PartWords) -> Make:
    """Say how thick a part's walls are and what it weighs.

    Solid: m = ρ V. Shell: m = ρ min(A t, V) with the area A of one face. A wall whose mesh shows
    both faces is 2 V / A thick unless somebody stated otherwise. Open sheets weigh ρ A t.
    """
    wall = member.build is Build.WALL
    shown = 2 * member.volume / member.body_area if wall else 0.0
    stated = structure.thickness or material.shell_thickness
    guess = SHEET_SHARE * (member.size[1] or member.size[2])
    only_sheet = member.volume == 0
    sheet = (words.thickness or stated or guess) if member.sheet_area or only_sheet else 0.0
    thickness = 0.0
    if structure.kind == "shell":
        thickness = words.thickness or shown or stated or guess
    elif wall:
        thickness = shown
    face = member.body_area * (0.5 if wall else 1.0)
    volume = member.volume if not only_sheet else face * sheet
    if structure.kind == "shell" and not only_sheet:
        matter = min(face * thickness, volume)
    else:
        matter = volume
    if thickness > 0 or only_sheet:
        simulated = Structure("shell", thickness or sheet, structure.reason)
    else:
        simulated = Structure("solid")
    return Make(
        structure=simulated,
        modelled=wall,
        thickness=thickness,
        sheet=sheet,
        body_mass=material.density * matter,
        sheet_mass=material.density * member.sheet_area * sheet,
        area=face + member.sheet_area,
        volume=volume + member.sheet_area * sheet,
    )


def recipe(member: Member, made: Make, treatment: Treatment, cell: float) -> Recipe:
    """Say where a part's matter lies on this grid; leaves are one layer."""
    if treatment.kind == "foliage":
        return Recipe(0.0, 0.0, 0.0)
    simulated = treatment.thickness or max(made.thickness, 2 * cell)
    sheet = made.sheet
    if made.structure.kind == "shell" and treatment.kind == "shell":
        sheet = simulated
    if made.thickness == 0:
        return Recipe(np.inf, 0.0, sheet)
    if made.modelled:
        thin = made.thickness < 0.99 * simulated and treatment.kind == "shell"
        return Recipe(0.0 if thin else np.inf, simulated, sheet)
    return Recipe(np.inf if is_porous(member, cell) else simulated, simulated, sheet)


def is_porous(member: Member, cell: float) -> bool:
    """Whether a shell is too narrow for two walls with a hollow between them."""
    return member.size[0] < POROUS_CELLS * cell


def how_filled(member: Member, made: Make, treatment: Treatment, cell: float) -> str:
    """Say in words what the fill is."""
    if treatment.kind == "foliage":
        return "leaves on springs"
    if member.volume == 0:
        return f"an open sheet, taken as {made.sheet * 1e3:.3g} mm thick"
    open_too = f", with open sheets {made.sheet * 1e3:.3g} mm thick" if member.sheet_area else ""
    if made.thickness == 0:
        return f"solid, {member.volume * 1e6:.4g} cm³ by winding number{open_too}"
    shown = " as its mesh shows" if made.modelled else ""
    wall = f"a wall {made.thickness * 1e3:.3g} mm thick{shown}"
    if not made.modelled and is_porous(member, cell):
        return f"{wall}, filled through because it is narrow, with the wall's mass{open_too}"
    if treatment.kind == "shell" and treatment.thickness and treatment.thickness > made.thickness:
        return f"{wall}, simulated {treatment.thickness * 1e3:.3g} mm thick{open_too}"
    return f"{wall}{open_too}"
