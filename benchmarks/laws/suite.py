"""The cases, in order, and about how long each takes."""

from collections.abc import Callable
from dataclasses import dataclass

from laws import bending, collisions, friction, grains, plastic, rest, rotation, statics, waves
from laws.outcome import Outcome


@dataclass(frozen=True)
class Case:
    """One row of the suite."""

    number: str
    run: Callable[[bool], Outcome]
    """Takes whether to be quick."""
    seconds: tuple[float, float]
    """About, on one core: quick, and in full."""


CASES = {
    case.number: case
    for case in (
        Case("1", collisions.any_collision, (6, 6)),
        Case("2", collisions.node_of_many_bodies, (1, 2)),
        Case("3", waves.free_bar, (1, 4)),
        Case("4", collisions.two_discs, (5, 15)),
        Case("5", waves.equal_bars, (8, 16)),
        Case("6", collisions.hertz_spheres, (12, 20)),
        Case("7", friction.sliding_block, (8, 8)),
        Case("8", friction.sticking_block, (3, 3)),
        Case("9", friction.tilted_block, (6, 9)),
        Case("10", friction.rolling_bodies, (10, 40)),
        Case("11", rest.bodies_at_rest, (5, 15)),
        Case("12a", statics.heavy_in_plane_strain, (5, 20)),
        Case("12b", statics.heavy_in_space, (8, 30)),
        Case("13", statics.self_weight, (3, 4)),
        Case("14", bending.cantilever, (8, 25)),
        Case("15", plastic.copper_bar, (5, 15)),
        Case("16", grains.sand, (10, 30)),
        Case("17", rotation.rotating_body, (3, 20)),
    )
}
