"""The cases, in order, and about how long each takes."""

from collections.abc import Callable
from dataclasses import dataclass

from laws import bending, collisions, friction, grains, plastic, rest, rotation, shells, statics, touching, waves
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
        Case("1", collisions.any_collision, (5, 5)),
        Case("2", collisions.node_of_many_bodies, (2, 2)),
        Case("3", waves.free_bar, (1, 3)),
        Case("4", collisions.two_discs, (3, 12)),
        Case("5", waves.equal_bars, (6, 12)),
        Case("6", collisions.hertz_spheres, (14, 15)),
        Case("7", friction.sliding_block, (4, 8)),
        Case("8", friction.sticking_block, (2, 3)),
        Case("9", friction.tilted_block, (7, 9)),
        Case("10", friction.rolling_bodies, (7, 44)),
        Case("11", rest.bodies_at_rest, (4, 8)),
        Case("12a", statics.heavy_in_plane_strain, (5, 16)),
        Case("12b", statics.heavy_in_space, (8, 27)),
        Case("13", statics.self_weight, (1, 1)),
        Case("14", bending.cantilever, (7, 24)),
        Case("15", plastic.copper_bar, (7, 17)),
        Case("16", grains.sand, (5, 43)),
        Case("17", rotation.rotating_body, (2, 22)),
        Case("18", touching.newtons_cradle, (1, 2)),
        Case("19", touching.marble_at_rest, (30, 60)),
        Case("20", touching.plate_holds, (8, 24)),
        Case("21", shells.bending_strip, (2, 4)),
        Case("22", shells.stretched_strip, (1, 1)),
        Case("23", shells.twisted_tubes, (3, 8)),
        Case("24", shells.buckling_strip, (3, 8)),
        Case("25", shells.pinched_sphere, (6, 30)),
        Case("26", shells.inflated_sphere, (1, 1)),
        Case("27", shells.own_weight, (2, 4)),
        Case("28", shells.pressed_plate, (2, 4)),
        Case("29", shells.shells_on_grid, (4, 12)),
    )
}
