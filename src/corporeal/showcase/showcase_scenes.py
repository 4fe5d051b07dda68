"""The ten showcase scenes: initial states and forces.

Metres, z up, floor at z = 0. An object that falls from far above starts lower, at the speed that it has there: the
video begins when something is about to happen. Nothing numerical is in a scene.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from corporeal.core.errors import UnknownChoiceError
from corporeal.core.types import (
    GRAVITY_M_S2,
    GRAVITY_VECTOR,
    STATED_MATTER_KEY,
    SUBSTANCE_KEY,
    Push,
    Scene,
    SceneObject,
    Surface,
)
from corporeal.showcase.prop_mesh import (
    ZERO_OFFSET,
    PropModel,
    PropPart,
    PropPoint,
    concatenate_meshes,
    mesh_difference,
)
from corporeal.showcase.prop_models import PROP_BUILDERS

ARMCHAIR_CUSHIONS = ("seat_cushion", "back_cushion")
"""Of the armchair."""


@dataclass(frozen=True)
class PlacedModel:
    """One model in a scene."""

    model: str
    """A name from ``PROP_BUILDERS``."""
    at: PropPoint = ZERO_OFFSET
    """Where its origin, the middle of its foot, stands [m]."""
    turn: PropPoint = ZERO_OFFSET
    """xyz Euler angles [degrees]."""
    velocity: PropPoint = ZERO_OFFSET
    """[m/s]"""
    push: Push | None = None
    without: tuple[str, ...] = ()
    """Parts that were taken away."""


@dataclass(frozen=True)
class ShowcaseComposition:
    """What stands where, what should be seen, and from where to look."""

    story: str
    """What should be seen, in one sentence."""
    models: tuple[PlacedModel, ...]
    view: PropPoint
    """Direction from the scene to the camera."""
    duration: float
    """[s]"""
    planted: dict[int, int] = field(default_factory=dict)
    """Place of an object that stands in another → place of that other, which makes room for it."""


def velocity_after_fall(height: float, gap: float) -> PropPoint:
    """Velocity [m/s] after falling from ``height`` down to ``gap`` above what will be hit [m].

    v = √(2 g (h - d))
    """
    return (0.0, 0.0, -round(math.sqrt(2 * GRAVITY_M_S2 * (height - gap)), 3))


def duck_on_mud() -> ShowcaseComposition:
    """Drop the duck from 1.2 m, out of a grown-up's hand, onto a heap of mud.

    The duck brings 0.9 J. Its foot, some 28 cm² once it has flattened a little, is carried by mud
    of cohesion c = 0.7 kPa with about 6.5 c (Prandtl's bearing capacity at φ = 5°), 13 N, and by
    the mud's inertia, ρ v², which at first is more. The mud flows and keeps an imprint of a
    few centimetres, in which the duck tips over and comes to rest on its beak.
    """
    duck = PlacedModel("rubber_duck", (0.0, 0.0, 0.245), (2, -3, 10), velocity_after_fall(1.2, 0.155))
    return ShowcaseComposition(
        "The mud yields under the duck and keeps its imprint; the duck ends undeformed.",
        (PlacedModel("mud_pile"), duck),
        view=(0.80, -0.62, 0.40),
        duration=1.0,
    )


def duck_on_can() -> ShowcaseComposition:
    """Throw the duck down onto an empty can that lies on its side.

    A can is strong along its axis (about 1 kN before it buckles) and weak across it: a plastic dent of depth δ in a
    tube takes P = 16 √(2π/3) m_p √(2 δ / t), m_p = σ_y t²/4 (Wierzbicki and Suh 1988). With 285 MPa and t = 0.1 mm that
    is 73 N at 1 mm and 230 N at 10 mm, which costs (2/3) P δ = 1.5 J. The duck, a vinyl sphere of R = 35 mm and wall h
    = 2 mm, pushes back with k ≈ 2.3 E h²/R = 2 N/mm (Reissner 1946) until its walls meet. Dropped from a table (0.6 J,
    50 N) it only bounces; thrown down at 6 m/s, as a child can, it has 1.4 J and pushes with 75 N, which in reality
    leaves a dent of a millimetre or two. The simulated dent is far deeper: a wall that the grid must thicken is softer
    in its plane. Its place and its rest are reliable, its depth is not.
    """
    can = PlacedModel("soda_can", (-0.0575, 0, 0.0331), (0, 90, 0))
    duck = PlacedModel("rubber_duck", (-0.005, 0.0, 0.24), (0, 0, -15), (0.0, 0.0, -6.0))
    return ShowcaseComposition(
        "The duck deforms and recovers; the can keeps a dent where it was hit.",
        (can, duck),
        view=(0.62, -0.80, 0.36),
        duration=1.4,
    )


def vase_ball_armchair() -> ShowcaseComposition:
    """Shove the vase into the ball so that it rolls against the armchair's stretcher.

    The shove of 18 m/s² for 0.1 s brings two kilograms to 1.3 m/s over 7 cm, against the floor's
    friction. That trips the vase, which topples after it gave its push: μ = 0.51 exceeds the
    radius of its foot over the height of its centre, 0.45. The ball goes off at 0.9 m/s, rolls
    half a metre and bounces. The chair stands askew, so that the ball leaves sideways and does
    not come back to the vase. It stands there without its cushions: they take no part, and their
    foam alone would be four fifths of all particles.
    """
    shove = Push((18.0, 0.0, 0.0), start=0.05, end=0.15)
    return ShowcaseComposition(
        "Force passes through a row of objects that part again: vase, ball, armchair.",
        (
            PlacedModel("vase", (-0.976, 0.0, 0.0), push=shove),
            PlacedModel("ball", (-0.689, 0.0, 0.0)),
            PlacedModel("armchair", (0.17, 0.225, 0.0), (0, 0, 210), without=ARMCHAIR_CUSHIONS),
        ),
        view=(-0.42, -0.92, 0.42),
        duration=1.5,
    )


def lamp_on_couch() -> ShowcaseComposition:
    """Let the lamp topple onto the couch, shade first over one arm."""
    return ShowcaseComposition(
        "The cushions give far and spring back; the lamp keeps its shape and lifts off again.",
        (PlacedModel("couch"), PlacedModel("floor_lamp", (0.14, 0.72, 1.02), (82, 0, 4))),
        view=(0.80, -0.62, 0.36),
        duration=2.0,
    )


def ficus_pushed() -> ShowcaseComposition:
    """Push the whole ficus with 3 m/s² for a quarter of a second."""
    return ShowcaseComposition(
        "The foliage sways and the pot stays put.",
        (PlacedModel("potted_ficus", push=Push((0.0, 3.0, 0.0), 0.1, 0.35)),),
        view=(0.80, -0.62, 0.36),
        duration=2.0,
    )


def tree_and_ball_in_sand() -> ShowcaseComposition:
    """Drop a ball from 1.2 m on a heap of sand that a sapling stands in, 0.1 m deep.

    A ball of 230 kg/m³ and D = 0.19 m leaves a crater of about .14/tan φ √(ρ_b/ρ_g) D^⅔ H^⅓
    (Uehara et al. 2003), 3 cm at φ = 33°.
    """
    return ShowcaseComposition(
        "Sand flows: the ball digs in, the heap slumps about the trunk.",
        (
            PlacedModel("sand_pile"),
            PlacedModel("small_tree", (-0.12, -0.09, 0.06)),
            PlacedModel("ball", (0.19, 0.14, 0.29), velocity=velocity_after_fall(1.2, 0.12)),
        ),
        view=(0.80, -0.62, 0.36),
        duration=1.5,
        planted={1: 0},
    )


def steel_and_rubber() -> ShowcaseComposition:
    """Drop two balls of one size side by side from half a metre."""
    return ShowcaseComposition(
        "The same fall, and different rebounds.",
        (
            PlacedModel("steel_ball", (0, -0.10, 0.25), velocity=velocity_after_fall(0.5, 0.25)),
            PlacedModel("rubber_ball", (0, 0.10, 0.25), velocity=velocity_after_fall(0.5, 0.25)),
        ),
        view=(0.80, -0.25, 0.20),
        duration=1.5,
    )


def water_knocked_over() -> ShowcaseComposition:
    """Knock a glass of water over with a wooden ball that strikes it just under its rim.

    The ball, 46 g at 4 m/s, brings 0.18 kg m/s; the glass with 170 g of water weighs 0.38 kg. About
    the edge of its foot the impact gives 0.18 × 0.085 = 16 g m²/s; to tip over it has to lift its
    centre from 4.5 cm over the floor to 5.5 cm from that edge, √(2 I m g 0.01) = 10 g m²/s with
    I ≈ 1.5 g m². A glass that lies on its side holds what is below its lower rim: at three fifths
    full hardly anything.
    """
    return ShowcaseComposition(
        "A glass of water falls over: water leaves it, and is heavier than the glass.",
        (PlacedModel("tumbler"), PlacedModel("wooden_ball", (-0.085, 0.004, 0.062), velocity=(4.0, 0.0, 0.0))),
        view=(0.30, -0.85, 0.42),
        duration=1.0,
    )


def honey_poured() -> ShowcaseComposition:
    """Let a column of honey fall out of its jar onto the floor.

    A viscous drop of volume V spreads as r = 0.894 (g V³ t/3ν)^⅛ (Huppert 1982): 113 cm³ of 10 Pa s are 12.6 cm across
    after 1 s.
    """
    return ShowcaseComposition(
        "Honey folds down and spreads, slower and slower.",
        (PlacedModel("honey", (0.0, 0.0, 0.02)),),
        view=(0.80, -0.62, 0.45),
        duration=1.2,
    )


def ketchup_stops() -> ShowcaseComposition:
    """Lift the cup off a portion of ketchup: it slumps and stops.

    Where the floor's yield stress and its own, which resists being stretched, hold its slope, its
    profile is h = π b/2 + √((π b/2)² + 2 b (R - r)) with b = τ_y/ρ g (Nye 1967): of 165 cm³ of
    25 Pa it is 12.5 cm across and 21 mm high. Without a yield stress it would not stop.
    """
    return ShowcaseComposition(
        "Ketchup slumps into a heap that stays.", (PlacedModel("ketchup"),), view=(0.80, -0.62, 0.40), duration=1.0
    )


SHOWCASE_SCENE_BUILDERS: dict[str, Callable[[], ShowcaseComposition]] = {
    "duck-on-mud": duck_on_mud,
    "duck-on-can": duck_on_can,
    "vase-ball-armchair": vase_ball_armchair,
    "lamp-on-couch": lamp_on_couch,
    "ficus-pushed": ficus_pushed,
    "tree-and-ball-in-sand": tree_and_ball_in_sand,
    "steel-and-rubber": steel_and_rubber,
    "water-knocked-over": water_knocked_over,
    "honey-poured": honey_poured,
    "ketchup-stops": ketchup_stops,
}


def build_showcase_scene(name: str) -> Scene:
    """Build a showcase scene.

    Raises:
        UnknownChoiceError: There is no scene of this name.
    """
    composition = _composition_of(name)
    return scene_of_models(name, place_models(composition), composition.models, composition.duration)


def scene_of_models(name: str, models: Sequence[PropModel], things: Sequence[PlacedModel], duration: float) -> Scene:
    """Put models, one per object, into a scene."""
    finishes = {id(p.finish): p.finish for m in models for p in m.parts}
    places = list(finishes)
    surfaces = tuple(
        _surface_of_part(part, k, places.index(id(part.finish)))
        for k, model in enumerate(models)
        for part in model.parts
    )
    objects = tuple(
        _scene_object_of_model(model, placed, _equal_models_before(models, k))
        for k, (model, placed) in enumerate(zip(models, things, strict=True))
    )
    return Scene(
        name=name,
        source="showcase",
        objects=objects,
        surfaces=surfaces,
        finishes=tuple(finishes.values()),
        gravity=GRAVITY_VECTOR,
        duration=duration,
        fps=60,
    )


def view_direction(name: str) -> PropPoint:
    """Direction from the scene to a camera that shows it well.

    Raises:
        UnknownChoiceError: There is no scene of this name.
    """
    return _composition_of(name).view


def place_models(composition: ShowcaseComposition) -> list[PropModel]:
    """Build the models and put them where they stand."""
    models = [
        _without_parts_of_model(PROP_BUILDERS[t.model](), t.without).moved(t.at, t.turn) for t in composition.models
    ]
    for inner, outer in composition.planted.items():
        models[outer] = _cut_room_in_heap(models[outer], models[inner])
    return models


def _without_parts_of_model(model: PropModel, missing: tuple[str, ...]) -> PropModel:
    return PropModel(model.name, tuple(p for p in model.parts if p.name not in missing))


def _cut_room_in_heap(heap: PropModel, guest: PropModel) -> PropModel:
    solid = guest.parts[0].mesh
    parts = tuple(
        PropPart(p.name, mesh_difference(p.mesh, concatenate_meshes([solid])), p.finish, p.substance, p.shell)
        for p in heap.parts
    )
    return PropModel(heap.name, parts)


def _composition_of(name: str) -> ShowcaseComposition:
    if name not in SHOWCASE_SCENE_BUILDERS:
        raise UnknownChoiceError("showcase scene", name, list(SHOWCASE_SCENE_BUILDERS))
    return SHOWCASE_SCENE_BUILDERS[name]()


def _equal_models_before(models: Sequence[PropModel], k: int) -> int:
    return sum(m.name == models[k].name for m in models[:k])


def _surface_of_part(part: PropPart, k: int, finish: int) -> Surface:
    mesh = part.mesh
    tinted = not np.allclose(mesh.colours, 1)
    return Surface(
        name=part.name,
        object=k,
        finish=finish,
        vertices=mesh.vertices,
        triangles=mesh.faces,
        normals=mesh.normals,
        uv=mesh.uv * [1, -1] + [0, 1],
        colours=mesh.colours if tinted else None,
        extras=_said_of_part(part),
    )


def _said_of_part(part: PropPart) -> dict:
    """Say of what a part is, and what is in it."""
    if not part.contents:
        return {SUBSTANCE_KEY: part.substance, "shell_thickness_m": part.shell}
    words = {"structure": "filled", "contents": part.contents, "fill": part.fill}
    return {SUBSTANCE_KEY: part.substance, STATED_MATTER_KEY: {"words": words}}


def _scene_object_of_model(model: PropModel, placed: PlacedModel, number: int) -> SceneObject:
    return SceneObject(
        name=f"{model.name}_{number}",
        class_name=model.name.replace("_", " "),
        real_extent=round(float(np.ptp(model.bounds(), axis=0).max()), 4),
        velocity=placed.velocity,
        push=placed.push,
        source="showcase",
        credit="The corporeal authors, Apache-2.0",
    )


def prop_scene(name: str) -> Scene:
    """Build one model as a scene of its own, standing on the floor.

    Raises:
        UnknownChoiceError: There is no model of this name.
    """
    if name not in PROP_BUILDERS:
        raise UnknownChoiceError("showcase model", name, list(PROP_BUILDERS))
    return scene_of_models(name, [PROP_BUILDERS[name]()], [PlacedModel(name)], duration=1.0)
