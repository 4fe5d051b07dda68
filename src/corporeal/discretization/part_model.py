"""Construction of a part: solid, wall or sheet, with thickness, mass and filling."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Discretization, Material, MaterialField, PartDescription, ScanThickening, Structure
from corporeal.discretization.cavity import is_vessel, measure_cavity
from corporeal.discretization.mesh_kind import MAX_WALL_THICKNESS_FRACTION, MeshKind, wall_thickness_behind
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.object_filling import FillRecipe

GUESSED_SHEET_THICKNESS_FRACTION = 0.01
"""Default thickness of an open sheet, relative to its middle extent."""
THICKNESS_FROM_MESH = "as its mesh shows"
THICKNESS_FROM_NAME = "as objects of its name usually have"
THICKNESS_FROM_JUDGE = {
    "annotation": "as your annotation says",
    "recording": "as a recorded answer says",
    "model": "as a model says",
    "metadata": "as the file's metadata says",
    "evidence": "as fits the estimate of its mass",
}
"""The source of a wall's thickness."""
SAME_THICKNESS_TOLERANCE = 0.05
"""Relative difference of two thicknesses that needs no telling."""
MAX_BOTH_FACES_THICKNESS_RATIO = 4.0
"""A sheet drawn less than this many times as thick as it is shows both its faces: a plate, a blade. What is drawn
thicker shows its outside only: a cup that a scan has filled."""
NORMAL_90_PERCENT_WIDTH_SIGMAS = 3.29
"""Width of the interval that holds 90 % of a normal distribution, in standard deviations."""
MIN_EYE_LOG_SIGMA = 0.2
"""Standard deviation of the logarithm of a share that was judged by eye, at least [-]."""
MIN_HOLLOW_SHELL_CELLS = 6
"""A shell narrower than this many cells is filled through, with the shell's mass."""


@dataclass(frozen=True)
class VolumeLeeway:
    """One draw of the volume that a mesh leaves open.

    That is of solids, of what is behind a closed wall, and of a wall that is as thick as the mesh draws it, between two
    faces that a scan has moved apart.
    """

    larger: float = 1.0
    """Default factor of the volume enclosed by the surface of a scan [-]."""
    about: float = 1.0
    """The same for a stated ratio: without its mean [-]."""
    deviate: float = 0.0
    """Deviation of the stated ratio in its standard deviations."""

    def of(self, words: PartDescription) -> float:
        """Return the factor of what is described [-], whose likely share counts already."""
        if words.swelling is None:
            return self.larger
        return self.about * exp(self.deviate * swelling_log_sigma(words.swelling))


NO_VOLUME_LEEWAY = VolumeLeeway()


def swelling_log_sigma(said: ScanThickening) -> float:
    """Return the standard deviation of the logarithm of a judged share [-]."""
    return max(log(said.high / said.low) / NORMAL_90_PERCENT_WIDTH_SIGMAS, MIN_EYE_LOG_SIGMA)


@dataclass(frozen=True)
class PieceSpecification:
    """How one piece is built, of what, and in whose words."""

    structure: Structure
    material: Material
    words: PartDescription


@dataclass(frozen=True)
class HeldContents:
    """What is behind the wall of a filled part."""

    mass: float
    """[kg]"""
    room: float
    """Volume that it could take up [m³]."""
    fill: float
    """Share of it that it does, where it lies at the bottom; else 1 [-]."""
    lies: Float[np.ndarray, "N 3"]
    """Points evenly in it [m]."""
    level: float
    """Nothing of it is above this height [m]."""


@dataclass(frozen=True)
class PartModel:
    """How one part is made: its description and what its mesh shows, put together."""

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
    """Enclosed by the surface, of the sheets, and of what a vessel holds [m³]."""
    density: float
    """Mean density of its wall, or of all of it when it is solid [kg/m³]."""
    held: HeldContents | None = None
    """None: nothing but air behind the wall, or no wall."""
    pieces: tuple[str, ...] = ()
    """What shares its mesh, with the mass of each, in words."""
    shown: float = 0.0
    """Thickness that its mesh draws [m]; 0: it draws no wall with two faces."""
    whose: str = ""
    """Where its wall's thickness comes from, in a clause."""
    outside: bool = False
    """Whether its wall is assumed along its outside, since its inside was not seen."""
    leaves: float = 0.0
    """Of a crown in bulk: area of one side of its leaves [m²], by which it is weighed; else 0."""

    @property
    def mass(self) -> float:
        """All of it [kg]."""
        return self.body_mass + self.sheet_mass + (self.held.mass if self.held else 0.0)


def scale_part_mass(made: PartModel, factor: float) -> PartModel:
    """Return the same part with all of its masses, and what it holds, times a factor."""
    held = made.held and replace(made.held, mass=made.held.mass * factor)
    inner = made.structure.contents
    if inner is not None:
        inner = replace(inner, density=inner.density * factor)
    return replace(
        made,
        structure=replace(made.structure, contents=inner),
        body_mass=made.body_mass * factor,
        sheet_mass=made.sheet_mass * factor,
        density=made.density * factor,
        held=held,
    )


def infer_part_model(
    anatomy: MeasuredObject, member: MeasuredPart, field: MaterialField, rng: np.random.Generator
) -> PartModel:
    """Return how a part is made, with what is behind its wall and all that shares its mesh.

    Pieces share the mesh by their stated shares of its volume and surface; the part then weighs what they weigh
    together, and is otherwise as the piece that matters most.
    """
    whole = part_specification(member.part, field)
    made = infer_structure(member, whole)
    every = piece_specifications(member.part, field)
    makes = [infer_structure(member, row) for row in every]
    holds = [infer_held_contents(anatomy, member, m, row, rng) for m, row in zip(makes, every, strict=True)]
    body, sheet = sum(m.body_mass for m in makes), sum(m.sheet_mass for m in makes)
    alone = made.body_mass + made.sheet_mass
    density = made.density
    mean = density * (body + sheet) / alone if alone > 0 else density
    pieces = tuple(
        f"{p.words.name} of {p.material.name}, {m.mass + (h.mass if h else 0.0):.3g} kg"
        for m, h, p in zip(makes, holds, every, strict=True)
    )
    made = replace(made, body_mass=body, sheet_mass=sheet, density=mean)
    made = replace(made, pieces=pieces if len(every) > 1 else ())
    return part_with_contents(made, member, [h for h in holds if h])


def part_mass(
    member: MeasuredPart, field: MaterialField, room: float, leeway: VolumeLeeway = NO_VOLUME_LEEWAY
) -> float:
    """Mass of a part with what is in it [kg], as ``infer_part_model`` finds it.

    Args:
        member: The part.
        field: What it is made of.
        room: What goes into it, if it is a vessel [m³].
        leeway: What its mesh leaves open. Walls that are not as it draws them go with the area.
    """
    total = 0.0
    for piece in piece_specifications(member.part, field):
        made = infer_structure(member, piece)
        structure = piece.structure
        swells = structure.kind == "solid" or made.whose == THICKNESS_FROM_MESH
        total += made.mass * (leeway.of(piece.words) if swells else 1.0)
        if structure.contents is not None:
            larger = 1.0 if is_vessel(member) else leeway.larger
            inner = volume_behind_wall(member, made, piece, room) * larger
            total += structure.contents.density * structure.fill * inner
    return total


def part_specification(part: int, field: MaterialField) -> PieceSpecification:
    """Return how a part as a whole is built."""
    return PieceSpecification(field.structures[part], field.materials[part], field.words[part])


def piece_specifications(part: int, field: MaterialField) -> list[PieceSpecification]:
    """Return how each piece that shares a part's mesh is built: mostly the part alone."""
    pieces = field.pieces[part] if field.pieces else ()
    return [PieceSpecification(p.structure, p.material, p.words) for p in pieces] or [part_specification(part, field)]


def part_with_contents(made: PartModel, member: MeasuredPart, holds: Sequence[HeldContents]) -> PartModel:
    """Put what was found behind the walls of a part's pieces into one."""
    if not holds:
        return made
    held = HeldContents(
        mass=sum(h.mass for h in holds),
        room=sum(h.room for h in holds),
        fill=max(h.fill for h in holds),
        lies=np.concatenate([h.lies for h in holds]),
        level=max(h.level for h in holds),
    )
    beside = held.room if is_vessel(member) else 0.0
    return replace(made, held=held, volume=made.volume + beside)


def infer_held_contents(
    anatomy: MeasuredObject, member: MeasuredPart, made: PartModel, piece: PieceSpecification, rng: np.random.Generator
) -> HeldContents | None:
    """Describe what is behind a wall; None: nothing but air.

    m = ρ f (V - V_wall), with the share f of the room that the contents take up.
    """
    structure = piece.structure
    if structure.contents is None:
        return None
    room = measure_cavity(anatomy, member, made.thickness or made.sheet, rng)
    inner = volume_behind_wall(member, made, piece, room.volume)
    level = room.level(structure.fill) if structure.loose else np.inf
    lies = room.points[room.points[:, 2] <= level]
    mass = structure.contents.density * structure.fill * inner
    return HeldContents(mass, inner, structure.fill if structure.loose else 1.0, lies, level)


def volume_behind_wall(member: MeasuredPart, made: PartModel, piece: PieceSpecification, room: float) -> float:
    """Volume of the cavity inside a wall [m³]: all that its outer surface encloses, less the wall.

    Args:
        member: The part.
        made: How its wall is made.
        piece: How it is built.
        room: What goes into it, if it is a vessel [m³].
    """
    material, words = piece.material, piece.words
    own = words.volume_share - words.inner_share
    if is_vessel(member):
        return room * own
    return max(member.volume * own - made.body_mass / material.density, 0.0)


def infer_structure(member: MeasuredPart, piece: PieceSpecification) -> PartModel:
    """Return how thick a part's walls are and what they weigh.

    Solid: m = ρ V. Shell, or the wall of what is filled: m = ρ V (1 - (1 - A t / (n V))^n) with the area A of one face:
    not of the inside of a shade, whose outside counts; about ρ A t where it is thin. n says how its outside closes in
    (``Member.closing``). A wall whose mesh shows both faces is 2 V / A thick unless stated or judged otherwise: thin
    walls are drawn too thick, in scans as in models; of open ware from pictures, whose inside may be plain, only if the
    usual thickness of such walls is unknown. Such ware weighs ρ A t with the area of its outside
    (``open_ware.sheet_area``), whatever is drawn in its hollow. Open sheets weigh ρ A t. Of a piece, its shares of V
    and A count, less the volume of what lies inside it; a piece that the mesh lacks is not bounded by the mesh. Of what
    is packed of parts and air, the share that is matter counts; of what a scan draws too thick, the share that is real.
    """
    structure, material, words = piece.structure, piece.material, piece.words
    wall = member.build is MeshKind.WALL
    shown = _drawn_wall_thickness(member, words)
    stated = structure.thickness or material.shell_thickness
    guess = GUESSED_SHEET_THICKNESS_FRACTION * (member.size[1] or member.size[2])
    only_sheet = member.volume == 0
    sheet = (words.thickness or stated or guess) if member.sheet_area or only_sheet else 0.0
    thickness, whose, walled = 0.0, "", structure.kind != "solid"
    if walled:
        drawn = 0.0 if words.wall_unseen and stated else shown
        thickness, whose = choose_wall_thickness(structure, words, drawn, stated or 0.0, guess)
    elif wall:
        thickness, whose = shown, THICKNESS_FROM_MESH
    face = _face_area(member, words, walled or wall) * words.surface_share
    volume = member.volume * words.volume_share if not only_sheet else face * sheet
    narrowing = member.narrowing(thickness) if walled and not is_unseen_open_vessel(member, words) else 1.0
    if not wall and _draws_both_faces(words, volume, thickness * face):
        face, narrowing = 0.5 * face, 1.0
    sheets = member.sheet_area * words.surface_share
    if walled and not only_sheet:
        matter = min(face * thickness * narrowing, np.inf if words.missing or member.measured else volume)
    else:
        own = max(volume - member.volume * words.inner_share, 0.0)
        matter = _real_fraction(words) * structure.solidity * own
    if thickness > 0 or only_sheet:
        kind = "filled" if structure.kind == "filled" else "shell"
        simulated = replace(structure, kind=kind, thickness=thickness or sheet)
    else:
        simulated = Structure("solid", solidity=structure.solidity)
    return PartModel(
        structure=simulated,
        modelled=wall,
        thickness=thickness,
        sheet=sheet,
        body_mass=material.density * matter,
        sheet_mass=material.density * sheets * sheet,
        area=face + sheets,
        volume=volume + sheets * sheet,
        density=material.density * (1.0 if walled else _real_fraction(words) * structure.solidity),
        shown=shown,
        whose=whose,
        outside=is_unseen_open_vessel(member, words),
    )


def _drawn_wall_thickness(member: MeasuredPart, words: PartDescription) -> float:
    """Return the thickness of the wall that a mesh draws [m]; 0: none, or one that was guessed."""
    if member.build is not MeshKind.WALL or member.measured:
        return 0.0
    return 2 * _real_fraction(words) * member.volume / member.body_area


def _face_area(member: MeasuredPart, words: PartDescription, walled: bool) -> float:
    """Return the area of one face of a wall, or of all faces of what has none [m²]."""
    if not walled:
        return member.body_area
    return member.outer_sheet if is_unseen_open_vessel(member, words) else member.face_area


def _real_fraction(words: PartDescription) -> float:
    """Return the share of what the mesh draws of a part that the real part takes up [-]."""
    return words.swelling.likely if words.swelling else 1.0


MAX_PLATE_BEHIND_RATIO = 1.5
"""Half of a plate's surface has its other face nearer behind it than this, over 2 V/A; a rod's has it twice as far."""


def plate_thickness(member: MeasuredPart, made: PartModel, rng: np.random.Generator) -> float:
    """Thickness 2 V/A of a solid part that is a plate, flat or bent [m]; 0: it is none."""
    solid = made.structure.kind == "solid" and member.closed and member.volume > 0
    thickness = 2 * member.volume / member.body_area if solid else 0.0
    if not 0 < thickness < MAX_WALL_THICKNESS_FRACTION * member.size[1]:
        return 0.0
    behind = float(np.median(wall_thickness_behind(member.shape, rng)))
    return thickness if behind < MAX_PLATE_BEHIND_RATIO * thickness else 0.0


def plate_as_wall(made: PartModel, thickness: float) -> PartModel:
    """Take a solid plate of some thickness [m] for the wall that it is: its mesh shows both faces.

    It weighs the same. On a grid of cells wider than half its thickness only a wall keeps its bending stiffness and is
    felt by what touches it.
    """
    return replace(
        made,
        structure=replace(made.structure, kind="shell", thickness=thickness),
        modelled=True,
        thickness=thickness,
        area=made.volume / thickness,
        shown=thickness,
        whose=THICKNESS_FROM_MESH,
    )


def _draws_both_faces(words: PartDescription, volume: float, wall: float) -> bool:
    """Return whether the mesh draws both faces of an open sheet, whose wall along all would be so."""
    return _is_open_sheet(words) and not words.wall_unseen and 2 * volume < MAX_BOTH_FACES_THICKNESS_RATIO * wall


def is_unseen_open_vessel(member: MeasuredPart, words: PartDescription) -> bool:
    """Return whether a part is open ware whose hollow is not known: pictures showed its outside."""
    return words.wall_unseen and _is_open_sheet(words) and member.volume > 0


def _is_open_sheet(words: PartDescription) -> bool:
    """Return whether a part is described as an open sheet that covers nothing."""
    return words.structure == "sheet" and not (words.inner_share > 0 or words.missing)


def choose_wall_thickness(
    structure: Structure, words: PartDescription, shown: float, usual: float, guess: float
) -> tuple[float, str]:
    """Return a wall's thickness [m], and the first source that has it.

    Args:
        structure: How it is built.
        words: Its description.
        shown: What its mesh draws [m]; 0: nothing.
        usual: Usual thickness [m]; 0: unknown.
        guess: Default [m].
    """
    if words.thickness:
        whose = THICKNESS_FROM_JUDGE.get(words.built_by, "as is stated")
        return words.thickness, THICKNESS_FROM_NAME if words.wall_usual else whose
    by = thickness_judge(words)
    if by and structure.thickness:
        return structure.thickness, THICKNESS_FROM_JUDGE[by]
    if shown:
        return shown, THICKNESS_FROM_MESH
    return (usual, "as such walls usually are") if usual else (guess, "as guessed from its size")


def thickness_judge(words: PartDescription) -> str:
    """Return the source that stated the thickness after seeing the object, or ""."""
    if "shell_thickness" in words.values:
        return "annotation"
    placed = words.placements.get("shell_thickness")
    return placed.chosen_by if placed is not None and placed.chosen_by in THICKNESS_FROM_JUDGE else ""


def fill_recipe(member: MeasuredPart, made: PartModel, treatment: Discretization, cell: float) -> FillRecipe:
    """Return where a part's material lies on this grid; leaves are one layer."""
    if treatment.kind == "foliage":
        return FillRecipe(0.0, 0.0, 0.0)
    if treatment.bending_young_pa > 0.0:
        return FillRecipe(0.0, 0.0, 0.0, shell=treatment.thickness or 0.0)
    simulated = treatment.thickness or max(made.thickness, 2 * cell)
    sheet = made.sheet
    if made.structure.kind == "shell" and treatment.kind == "shell":
        sheet = simulated
    if made.thickness == 0:
        return FillRecipe(np.inf, 0.0, sheet)
    if made.held:
        wall = max(made.thickness, 0.5 * cell)
        return FillRecipe(np.inf, wall, sheet, level=made.held.level, vessel=is_vessel(member))
    if made.structure.holds and not made.modelled:
        wall = max(made.thickness, 0.5 * cell)
        return FillRecipe(wall, wall, sheet)
    if made.modelled:
        thin = made.thickness < 0.99 * simulated and treatment.kind == "shell"
        return FillRecipe(0.0 if thin else np.inf, simulated, sheet)
    return FillRecipe(np.inf if is_porous_shell(member, cell) else simulated, simulated, sheet)


def is_porous_shell(member: MeasuredPart, cell: float) -> bool:
    """Whether a shell is too narrow for two walls with a hollow between them; sheets have none."""
    return member.volume > 0 and member.size[0] < MIN_HOLLOW_SHELL_CELLS * cell


def describe_held_contents(made: PartModel) -> str:
    """Describe in words what is behind the wall."""
    structure = made.structure
    if made.held is None or structure.contents is None:
        return ""
    litres = f"{made.held.room * 1e3:.3g} l"
    return (
        f", around {made.held.mass:.3g} kg of {structure.contents.name} that take up {structure.fill:.0%} of {litres}"
    )


def describe_wall(made: PartModel) -> str:
    """Describe in words how thick the wall is, by what source, and whether the mesh draws another."""
    if not made.thickness:
        return f"a wall {made.sheet * 1e3:.3g} mm thick"
    wall = f"a wall {made.thickness * 1e3:.3g} mm thick {made.whose}"
    if made.shown and abs(made.shown / made.thickness - 1) > SAME_THICKNESS_TOLERANCE:
        wall += f" (its mesh draws {made.shown * 1e3:.3g} mm)"
    if made.outside:
        wall += f" along the {made.area * 1e4:.3g} cm² of its outside: its inside was not seen"
    return wall


def describe_fill(member: MeasuredPart, made: PartModel, treatment: Discretization, cell: float) -> str:
    """Describe in words what the fill is."""
    springs = "leaves on springs" if treatment.kind == "foliage" else ""
    if made.leaves:
        shown = f"about {made.leaves:.2g} m² of leaves {made.sheet * 1e3:.3g} mm thick"
        return f"{springs or 'a crown'}, {shown}: its surface does not resolve single leaves"
    if springs:
        return springs
    if made.held:
        return f"{describe_wall(made)}{describe_held_contents(made)}"
    if member.volume == 0:
        return f"an open sheet, taken as {made.sheet * 1e3:.3g} mm thick"
    open_too = f", with open sheets {made.sheet * 1e3:.3g} mm thick" if member.sheet_area else ""
    if made.thickness == 0:
        return f"solid, {member.volume * 1e6:.4g} cm³ by winding number{open_too}"
    wall = describe_wall(made)
    if not made.modelled and is_porous_shell(member, cell):
        return f"{wall}, filled as a solid because it is narrow, with the wall's mass{open_too}"
    if treatment.kind == "shell" and treatment.thickness and treatment.thickness > made.thickness:
        return f"{wall}, simulated {treatment.thickness * 1e3:.3g} mm thick{open_too}"
    return f"{wall}{open_too}"
