"""Imposing another method's field: its medians per part.

What the other method does not tell (yield stress, friction, walls, contents) is borrowed from ours and marked so. A
part that the field does not resolve keeps our numbers altogether.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import Law, Material, MaterialField, MeasuredRange, Parts, Provenance, Scene, Structure
from corporeal.fields.field_registration import RegisteredPoints, register_points
from corporeal.fields.field_specification import UniformField, parse_field_specification
from corporeal.fields.sampled_field import SampledField
from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.materials import find_material
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

SAMPLE_REACH_SPACINGS = 3.0
"""A point takes the nearest sample's numbers within so many spacings."""
MIN_PART_COVERED_FRACTION = 0.5
"""Least share of a part's points that have a sample within reach."""
MAX_YOUNG_SPAN_DECADES = 2.0
"""Largest span of E within a part, p10 to p90, that is taken for one value [decades]."""
BAND_PERCENTILES = (10, 50, 90)
"""Percentiles."""


@dataclass(frozen=True)
class PartFieldNumbers:
    """What a field says of one part."""

    value: Mapping[str, float]
    """Field of ``types.Material`` → median, SI."""
    band: Mapping[str, tuple[float, float]]
    """The same → 10th and 90th percentile."""
    kind: str | None
    """What most of its points are taken for; None: not stated."""
    covered: float
    """Share of its points with a sample within reach, in [0, 1]."""
    decades: float
    """p10 to p90 of E [decades]; 0 where E is not stated."""
    unfit: str = ""
    """Why it does not tell the part, in a clause; empty: it does."""


def nearest_samples(
    field: RegisteredPoints, points: Float[np.ndarray, "M 3"]
) -> tuple[Int[np.ndarray, " M"], np.ndarray]:
    """Return the nearest sample of each point, and whether it is within reach."""
    distance, sample = KDTree(field.position).query(points)
    return np.asarray(sample), np.asarray(distance) <= SAMPLE_REACH_SPACINGS * field.spacing


def sum_up_per_part(
    field: SampledField,
    placed: RegisteredPoints,
    points: Float[np.ndarray, "M 3"],
    part_of_point: Int[np.ndarray, " M"],
) -> dict[int, PartFieldNumbers]:
    """Sum up a field over points spread on the surfaces of parts.

    Returns:
        Part → its numbers, for every part that has a point.
    """
    sample, near = nearest_samples(placed, points)
    found = {}
    for part in np.unique(part_of_point[part_of_point >= 0]).tolist():
        mine = part_of_point == part
        found[part] = _sum_up_part(field, sample[mine & near], float(near[mine].mean()))
    return found


def _sum_up_part(field: SampledField, sample: np.ndarray, covered: float) -> PartFieldNumbers:
    if covered < MIN_PART_COVERED_FRACTION:
        unfit = f"only {covered:.0%} of it lies near a point of the field"
        return PartFieldNumbers({}, {}, None, covered, 0.0, unfit)
    bands = {name: np.percentile(v[sample], BAND_PERCENTILES) for name, v in field.values.items()}
    decades = float(np.log10(bands["young_pa"][2] / bands["young_pa"][0])) if "young_pa" in bands else 0.0
    unfit = f"E spans {decades:.1f} decades within it" if decades > MAX_YOUNG_SPAN_DECADES else ""
    kind = None
    if field.kind is not None:
        names, count = np.unique(field.kind[sample], return_counts=True)
        kind = str(names[count.argmax()])
    return PartFieldNumbers(
        value={name: float(b[1]) for name, b in bands.items()},
        band={name: (float(b[0]), float(b[2])) for name, b in bands.items()},
        kind=kind,
        covered=covered,
        decades=decades,
        unfit=unfit,
    )


CHOSEN_BY_FIELD, CHOSEN_BY_LIBRARY = "field", "borrowed"
"""Who chose a value: the other method, or we, where it tells none."""
BORROWED_NUMBERS_NOTE = f"Values that the other method does not give are ours, marked {CHOSEN_BY_LIBRARY}."
POINTS_PER_PART = 400
"""Points on a part's surface that its numbers are summed up over."""
REGISTRATION_SURFACE_POINTS = 4000
"""Points on the surface that a field is registered with."""
LAW_OF_PIXIE_KIND: Mapping[str, tuple[Law, str]] = {
    "jelly": (Law.COROTATED, ""),
    "metal": (Law.VON_MISES, "steel"),
    "visplas": (Law.VON_MISES, "plasticine"),
    "sand": (Law.DRUCKER_PRAGER, "sand"),
    "snow": (Law.DRUCKER_PRAGER, "snow"),
}
"""Kind of Pixie → our law, and whose strength stands in where our own material has none. What is "stationary" keeps our
law and is judged like any part."""
FIELD_RANGE_SOURCE = "field"
"""Source of a band that a field spans, where the library has no range."""


def impose_field(found: MaterialField, scene: Scene, parts: Parts, spec: str) -> MaterialField:
    """Replace numbers by those of another field.

    Args:
        found: Ours.
        scene: In metres, +Z up.
        parts: Of its triangles.
        spec: See ``specification``; empty: nothing is replaced.

    Raises:
        UserError: The field cannot be used with this scene.
    """
    field = parse_field_specification(spec)
    if field is None:
        return found
    if isinstance(field, UniformField):
        return _with_uniform_field(found, field)
    numbers_of_part: dict[int, PartFieldNumbers] = {}
    methods: set[str] = set()
    for number in (None, *range(len(scene.objects))):
        path = field.of(None if number is None else scene.objects[number].name)
        if path is not None:
            sampled = field.read(path)
            methods.add(sampled.method)
            chosen = _SurfaceSamples(scene, parts, number)
            placed = register_points(sampled.position, chosen.surface, path)
            numbers_of_part |= sum_up_per_part(sampled, placed, chosen.points, chosen.part_of_point)
    if not numbers_of_part:
        names = ", ".join(thing.name for thing in scene.objects)
        raise UserError(f"{field.path} has no file for any object of the scene: {names}.")
    return _with_part_numbers(found, parts, numbers_of_part, methods.pop())


class _SurfaceSamples:
    """Points on the surface of one object or of all of them, with their parts."""

    def __init__(self, scene: Scene, parts: Parts, number: int | None) -> None:
        whole = join_meshes(scene.surfaces)
        own = np.ones(len(whole.triangles), bool) if number is None else (
            parts.object_of_point == number
        )  # fmt: skip
        self.surface = _sample_mesh(whole.only(own), REGISTRATION_SURFACE_POINTS)
        on_parts = [
            (k, _sample_mesh(whole.only(own & (parts.part_of_point == k)), POINTS_PER_PART))
            for k in np.unique(parts.part_of_point[own & (parts.part_of_point >= 0)]).tolist()
        ]
        self.points = np.concatenate([p for _, p in on_parts])
        self.part_of_point = np.repeat([k for k, _ in on_parts], [len(p) for _, p in on_parts])


def _sample_mesh(mesh: Mesh, count: int) -> np.ndarray:
    return sample_surface(mesh, count, np.random.default_rng(0))[0]


def _with_uniform_field(found: MaterialField, field: UniformField) -> MaterialField:
    note = f"Numbers are those of {field.method}: a baseline, not a prediction. {BORROWED_NUMBERS_NOTE}"
    reason = f"{field.method} has it so everywhere"
    made = [_replaced_value(m, dict(field.value), {n: reason for n in field.value}) for m in found.materials]
    if field.keeps_laws:
        return replace(found, materials=tuple(made), pieces=(), notes=(*found.notes, note))
    solid = Structure("solid", None, f"{field.method}: everything is solid.")
    return replace(
        found,
        materials=tuple(_elastic_material(m) for m in made),
        structures=(solid,) * len(made),
        pieces=(),
        notes=(*found.notes, note),
    )


def _elastic_material(material: Material) -> Material:
    """Make a material fixed-corotated, which loses nothing."""
    grounds = {name: g for name, g in material.grounds.items() if name != "loss"}
    return replace(material, law=Law.COROTATED, loss=0.0, grounds=grounds)


@dataclass(frozen=True)
class _FieldUse:
    """How a field was used."""

    imposed: int
    outside: int
    """Values outside the library's ranges."""
    kept: tuple[str, ...]
    """Why parts kept our numbers, in clauses."""


def _with_part_numbers(
    found: MaterialField, parts: Parts, numbers_of_part: Mapping[int, PartFieldNumbers], method: str
) -> MaterialField:
    materials, pieces = list(found.materials), list(found.pieces)
    outside, kept = 0, []
    for k, part in enumerate(parts.catalogue):
        numbers = numbers_of_part.get(k)
        if numbers is None or numbers.unfit:
            clause = numbers.unfit if numbers else "the field has no file for it"
            kept.append(f"{part.name} ({clause})")
            continue
        ours = materials[k]
        materials[k] = _imposed_material(ours, part.name, numbers, method)
        outside += sum(n in ours.grounds and v not in ours.grounds[n].range for n, v in numbers.value.items())
        if pieces:
            pieces[k] = ()
    count = _FieldUse(len(materials) - len(kept), outside, tuple(kept))
    notes = (*found.notes, _field_note(method, count))
    return replace(found, materials=tuple(materials), pieces=tuple(pieces), notes=notes)


def _field_note(method: str, count: _FieldUse) -> str:
    all_of = count.imposed + len(count.kept)
    said = f"Numbers of {count.imposed} of {all_of} parts are those of {method}. {BORROWED_NUMBERS_NOTE}"
    if count.outside:
        said += f" Values outside our measured ranges, used all the same: {count.outside}."
    return said + (f" Ours are kept in: {'; '.join(count.kept)}." if count.kept else "")


def _imposed_material(ours: Material, part: str, numbers: PartFieldNumbers, method: str) -> Material:
    reasons = {}
    for name, (low, high) in numbers.band.items():
        reasons[name] = (
            f"median of {method} on this part (p10 to p90: {low:.3g} to {high:.3g}; "
            f"{numbers.covered:.0%} of its surface covered)"
        )
    made = _replaced_value(ours, dict(numbers.value), reasons)
    if numbers.kind == "fluid":
        raise UserError(
            f"{method} predicts a fluid for {part}, which cannot be simulated as a solid. Leave "
            "its "
            "points out of the file, and our numbers are kept."
        )
    law, stand_in = LAW_OF_PIXIE_KIND.get(numbers.kind or "", (None, ""))
    return made if law is None else _under_law(law, made, stand_in)


def _under_law(law: Law, material: Material, stand_in: str) -> Material:
    """Put a material under a law, with what it needs and has not from the library's own kind."""
    fields = CONSTITUTIVE_LAWS[law].fields
    lacking = [n for n in fields if getattr(material, n) is None]
    if not lacking:
        return replace(material, law=law)
    usual = find_material(stand_in).typical(f"{CHOSEN_BY_LIBRARY} from {stand_in}")
    grounds = {n: replace(usual[n], chosen_by=CHOSEN_BY_LIBRARY) for n in lacking if n in usual}
    values = {n: g.value for n, g in grounds.items()}
    return replace(material, law=law, grounds=material.grounds | grounds, **values)


def _replaced_value(ours: Material, value: Mapping[str, float], reasons: Mapping[str, str]) -> Material:
    grounds = {name: replace(g, chosen_by=CHOSEN_BY_LIBRARY) for name, g in ours.grounds.items()}
    for name, number in value.items():
        known = ours.grounds.get(name)
        span = known.range if known else MeasuredRange(number, number, number, FIELD_RANGE_SOURCE)
        grounds[name] = Provenance(number, span, CHOSEN_BY_FIELD, reasons[name])
    return replace(ours, grounds=grounds, **value)
