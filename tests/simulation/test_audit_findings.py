"""What a person sees at once is found in hand-made trajectories, and what follows from measured values is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corporeal.core.audit_data import SurfacePairCheck
from corporeal.core.types import (
    Discretization,
    Frame,
    Law,
    Material,
    MaterialField,
    NoteKind,
    PartDescription,
    Particles,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Trajectory,
    note_kind,
)
from corporeal.simulation.audit import energy_share_of_flows
from corporeal.simulation.audit_findings import audit_findings
from corporeal.simulation.audit_messages import finding_warnings
from corporeal.simulation.part_motion import largest_piece_sides, rest_links, separated_particles
from sample_ledger import ledger

CELL, FPS, G = 0.01, 50, 9.81
STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, yield_stress=3e8, restitution=0.6)
RUBBER = Material("rubber", Law.NEO_HOOKEAN, 2e6, 0.45, 1100.0, restitution=0.8)
HONEY = Material("honey", Law.FLUID, 0.0, 0.49, 1400.0, viscosity=10.0)
WOOD = Material("wood", Law.HENCKY, 1e10, 0.3, 600.0)
LEAVES = Material("leaves-flowers", Law.NEO_HOOKEAN, 3e8, 0.3, 800.0)
RIGID = Discretization("rigid", 2e11, 2e11, 0.3, 7850.0, None, None, 1e-4, 2.0, 0.0, np.inf, "")
SOLID = Discretization("deformable", 2e6, 2e6, 0.45, 1100.0, None, None, 0.04, 2.0, 60.0, 1e-4, "")
WALL = Discretization("shell", 2e11, 2e6, 0.3, 157.0, 3e4, 0.05, 0.002, 2.0, 100.0, 1e-4, "")
"""1 mm of steel made 50 mm thick, at a hundred-thousandth of E."""
SPRINGS = replace(SOLID, kind="foliage", young_pa=3e8, simulated_young_pa=0.0, strain=1e-4)


def block(size, low=0.0):
    """Points of a box of sides [m] over the origin, every half cell."""
    axes = [np.arange(CELL / 4, s, CELL / 2) for s in size]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return points - (size[0] / 2, size[1] / 2, -low)


def corners(points):
    """Corners of the box about points, with triangles that use each of them."""
    low, high = points.min(0) - CELL / 4, points.max(0) + CELL / 4
    vertices = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    return vertices, np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]])


class Run:
    """A made-up run of one object of several parts; ``moves(t, rest)`` says where its points are."""

    def __init__(self, parts, moves, duration=0.6, wall=0.0, rate=None, touched=0.3, stands=True, name="thing_0"):
        self.points = [points for points, _, _ in parts]
        rest = np.concatenate(self.points)
        part = np.repeat(np.arange(len(parts)), [len(p) for p in self.points])
        materials, treatments = tuple(m for _, m, _ in parts), tuple(t for _, _, t in parts)
        surfaces = tuple(Surface(f"part {k}", 0, 0, *corners(p)) for k, p in enumerate(self.points))
        self.scene = Scene("made up", "", (SceneObject(name, "thing", 0.2),), surfaces, (), fps=FPS, duration=duration)
        volume = np.full(len(rest), (CELL / 2) ** 3)
        density = np.array([t.density for t in treatments])[part]
        mass = [float((volume * density)[part == k].sum()) for k in range(len(parts))]
        self.particles = Particles(
            position=rest, velocity=np.zeros_like(rest), volume=volume, density=density,
            object=np.zeros(len(rest), dtype=np.int64), part=part, cell=CELL, treatments=treatments,
            surface=np.zeros((0, 3)), object_of_surface=np.zeros(0, dtype=np.int64), mass_real=tuple(mass),
            walls=tuple((wall if t.kind == "shell" else 0.0, 0.0) for t in treatments),
            rate=np.zeros(0) if rate is None else np.where(part == len(parts) - 1, rate, 0.0),
        )  # fmt: skip
        count = len(parts)
        self.field = MaterialField(
            materials,
            (Structure("solid"),) * count,
            tuple(PartDescription(f"part {k}", m.name) for k, m in enumerate(materials)),
            np.full((count + 1, count + 1), 0.5),
            np.full((count + 1, count + 1), 0.5),
        )
        time = np.arange(round(duration * FPS) + 1) / FPS
        path = [np.asarray(moves(t, rest)) for t in time]
        heavy = (volume * density)[:, None]
        whole = float(heavy.sum())
        centre = np.array([(heavy * x).sum(0) / whole for x in path])
        speed = np.diff(centre, axis=0, prepend=centre[:1]) * FPS
        first = np.full((len(time), 2, 2), np.nan)
        first[time >= touched, 0, 1] = first[time >= touched, 1, 0] = touched
        last = np.where(np.isfinite(first), time[:, None, None], np.nan) if stands else first
        self.trajectory = Trajectory(
            Path(), time,
            ledger(
                time, mass=np.full((len(time), 1), whole), centre=centre[:, None], momentum=whole * speed[:, None],
                kinetic=0.5 * whole * (speed**2).sum(1)[:, None], first_contact=first, last_contact=last,
            ),
            [Frame(float(t), x, np.broadcast_to(np.eye(3), (len(x), 3, 3))) for t, x in zip(time, path, strict=True)],
        )  # fmt: skip

    def findings(self, unbooked=0.0, surfaces=()):
        return audit_findings(self.scene, self.particles, self.field, self.trajectory, unbooked, surfaces)


def falls(t, rest, low=0.3):
    """Free fall from rest to the floor, 0.3 m deep, and rest there."""
    return rest - (0.0, 0.0, min(low, 0.5 * G * t**2))


def squeezed(share):
    """Falls; from the impact on its upper half is displaced sideways by a share of its height."""

    def moves(t, rest):
        now = falls(t, rest)
        height = np.ptp(rest[:, 2])
        up = (rest[:, 2] - rest[:, 2].min()) / height
        return now + np.outer(np.sin(np.pi * up) * (share * height if t > 0.26 else 0.0), (1.0, 0.0, 0.0))

    return moves


CUBE = block((0.1, 0.1, 0.1), low=0.3)
TALL = block((0.1, 0.04, 0.3), low=0.3)


# ------------------------------------------------------------------ what is as it should be


def turns(t, rest):
    """Falls as ``falls`` and turns about its middle."""
    angle, middle = 3.0 * t, rest.mean(0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return falls(t, (rest - middle) @ turn.T + middle)


def flattens(t, rest):
    """A ball's fall, dent and rebound: it loses a tenth of its height at 0.25 s and has it again at 0.3 s."""
    squeeze = 0.1 * max(0.0, 1.0 - abs(t - 0.26) / 0.04)
    low = rest[:, 2].min()
    now = rest.copy()
    now[:, 2] = low + (rest[:, 2] - low) * (1 - squeeze)
    now[:, :2] *= 1 + squeeze / 3
    height = 0.3 - 0.5 * G * t**2 if t < 0.247 else max(0.0, 1.4 * (t - 0.247) - 0.5 * G * (t - 0.247) ** 2)
    return now - (0.0, 0.0, 0.3 - height)


def spreads(t, rest):
    """A puddle."""
    flat = 1.0 if t < 0.25 else 0.1
    now = falls(t, rest)
    return np.stack([now[:, 0] / np.sqrt(flat), now[:, 1] / np.sqrt(flat), (now[:, 2]) * flat], axis=1)


@pytest.mark.parametrize(
    ("material", "treatment", "moves"),
    [
        pytest.param(STEEL, RIGID, turns, id="rigid drop"),
        pytest.param(RUBBER, SOLID, flattens, id="rubber ball"),
        pytest.param(HONEY, replace(SOLID, strain=1.0), spreads, id="liquid"),
    ],
)
def test_what_follows_from_measured_values_has_no_finding(material, treatment, moves):
    assert Run([(CUBE, material, treatment)], moves).findings(unbooked=0.05) == ()


def test_what_yields_may_be_dented_as_deep_as_its_energy_goes():
    """Plasticine of 10 kPa that fell from 0.3 m is flat at its foot; steel of 300 MPa cannot be."""
    clay = replace(STEEL, young_pa=5e6, density=1700.0, yield_stress=1e4)
    soft = replace(SOLID, young_pa=5e6, simulated_young_pa=5e6, density=1700.0, strain=0.01)
    moves = squeezed(0.15)
    assert Run([(CUBE, clay, soft)], moves).findings() == ()
    hard = replace(soft, young_pa=2e11, simulated_young_pa=2e11, density=7850.0, strain=1e-4)
    (found,) = Run([(CUBE, STEEL, hard)], moves).findings()
    assert (found.severity, found.effects[0].kind) == ("grave", "deformation")


# ------------------------------------------------------------------ stiffness


def test_a_thickened_wall_that_is_seen_to_buckle_is_grave_and_names_part_ratio_and_effect():
    (found,) = Run([(TALL, STEEL, WALL)], squeezed(0.2), wall=1e-3).findings()
    assert (found.object, found.part, found.severity) == ("thing_0", "part 0", "grave")
    assert found.causes == ("thickened wall",)
    assert found.stiffness_ratio == pytest.approx(1e-5)
    assert found.in_plane_ratio == pytest.approx(5e-4)
    seen = next(e for e in found.effects if e.kind == "deformation")
    assert seen.grave and 0.02 < seen.simulated < 0.08 and seen.expected < 0.01
    assert found.sentence.startswith(
        "thing_0: part 0 is simulated with 1e-05 of its measured Young's modulus, 0.0005 of"
    )
    assert f"deforms by {seen.simulated * 1e3:.3g} mm" in found.sentence
    assert [note_kind(w) for w in finding_warnings((found,))] == [NoteKind.GRAVE]


def test_the_same_ratio_without_an_effect_is_no_warning():
    (found,) = Run([(TALL, STEEL, WALL)], squeezed(0.001), wall=1e-3).findings()
    assert (found.severity, found.stiffness_ratio) == ("minor", pytest.approx(1e-5))
    assert finding_warnings((found,)) == []
    assert {"contact_time", "static_sag"} <= {e.kind for e in found.effects}
    wave = next(e for e in found.effects if e.kind == "contact_time")
    assert wave.expected == pytest.approx(2 * 0.295 * np.sqrt(7850 / 2e11), rel=0.02)
    assert wave.simulated == pytest.approx(2 * 0.295 * np.sqrt(157 / 2e6), rel=0.02)


@pytest.mark.parametrize(("young", "found"), [(1.1e6, 0), (9e5, 1)])
def test_a_part_is_named_from_a_factor_of_two_on(young, found):
    softer = replace(SOLID, simulated_young_pa=young)
    assert len(Run([(CUBE, RUBBER, softer)], falls).findings()) == found


def test_what_its_load_would_squash_is_grave_before_anything_moved():
    """A foot of 1e-4 of its stiffness under a load of steel."""
    foot, load = block((0.1, 0.1, 0.04)), block((0.1, 0.1, 0.2), low=0.04)
    soft = replace(SOLID, simulated_young_pa=2e2)
    findings = Run([(foot, RUBBER, soft), (load, STEEL, RIGID)], lambda t, rest: rest, touched=0.0).findings()
    (found,) = findings
    assert (found.part, found.severity) == ("part 0", "grave")
    sag = next(e for e in found.effects if e.kind == "static_sag")
    weight = 7850 * 0.1 * 0.1 * 0.2 * G + 1100 * 0.1 * 0.1 * 0.04 * G
    assert sag.expected == pytest.approx(0.035 * weight * 0.035 / (0.1 * 0.1 * 0.04 * 2e6), rel=0.03)
    assert sag.simulated == pytest.approx(0.035, abs=1e-3), "all of its height"


def test_a_solid_of_two_cells_is_told_and_one_of_ten_is_not():
    thin = block((0.1, 0.1, 0.02), low=0.3)
    (found,) = Run([(thin, RUBBER, SOLID)], falls).findings()
    assert found.causes == ("few cells",) and found.cells_across == pytest.approx(1.5)
    assert found.severity == "minor"
    assert "1.5 grid cells across" in found.sentence
    assert Run([(CUBE, RUBBER, SOLID)], falls).findings() == ()


# ------------------------------------------------------------------ outcomes


@pytest.mark.parametrize(("deeper", "grave"), [(0.004, False), (0.03, True)])
def test_what_ends_below_where_it_can_stand_is_found(deeper, grave):
    """Castors that were squeezed away: 30 mm of a bin 300 mm high."""
    moves = lambda t, rest: falls(t, rest, 0.3 + deeper)  # noqa: E731
    findings = Run([(TALL, WOOD, RIGID)], moves).findings()
    assert [e.kind for f in findings for e in f.effects] == ["depth_below_support"] * grave
    assert all(f.severity == "grave" and f.effects[0].simulated == pytest.approx(deeper, abs=1e-4) for f in findings)


def test_jelly_may_stand_lower_by_what_its_weight_gives():
    jelly = replace(RUBBER, young_pa=2e4)
    soft = replace(SOLID, young_pa=2e4, simulated_young_pa=2e4, strain=0.2)
    moves = lambda t, rest: falls(t, rest, 0.3 + 0.008)  # noqa: E731
    tall = block((0.1, 0.1, 0.15), low=0.3)
    assert Run([(tall, jelly, soft)], moves).findings() == ()


def flies_off(t, rest, share=0.2):
    """The upper part of it leaves after the impact."""
    now = falls(t, rest)
    top = rest[:, 2] > np.quantile(rest[:, 2], 1 - share)
    return now + np.outer(top * max(0.0, t - 0.26), (1.0, 0.0, 0.5))


def test_a_piece_that_leaves_its_object_is_found():
    hard = replace(SOLID, young_pa=1e10, simulated_young_pa=1e10, strain=1e-3)
    (found,) = Run([(TALL, WOOD, hard)], flies_off).findings()
    left = next(e for e in found.effects if e.kind == "separated_share")
    assert (found.severity, left.grave) == ("grave", True)
    assert left.simulated == pytest.approx(0.2, abs=0.03)
    assert Run([(TALL, HONEY, replace(SOLID, strain=1.0))], flies_off).findings() == (), "a drop may"


def test_pieces_of_a_part_hold_together_by_what_is_between_them():
    """Castors are no neighbours of each other, but of the bin."""
    bin_, wheel = block((0.2, 0.2, 0.1), low=0.04), block((0.02, 0.02, 0.03))
    wheels = np.concatenate([wheel + np.array((x, y, 0.0)) for x in (-0.08, 0.08) for y in (-0.08, 0.08)])
    rest = np.concatenate([bin_, wheels])
    links = rest_links(rest)
    assert not separated_particles(rest, rest, links, 0.02).any()
    gone = rest.copy()
    gone[-len(wheel) :] += (0.1, 0.0, 0.0)
    apart = separated_particles(rest, gone, links, 0.02)
    assert apart[-len(wheel) :].all() and not apart[: -len(wheel)].any()
    np.testing.assert_allclose(largest_piece_sides(wheels), np.ptp(wheel, axis=0))


@pytest.mark.parametrize(("up", "grave"), [(1.5, False), (2.3, True)])
def test_a_rebound_above_the_restitution_of_the_material_is_found(up, grave):
    """From 0.3 m steel of e = 0.6 rises to 0.49 of it at most, with the tolerance; 2.3 m/s is 0.27 m."""

    def moves(t, rest):
        hit = np.sqrt(2 * 0.3 / G)
        after = t - hit
        return rest - (0, 0, 0.5 * G * t**2 if after < 0 else 0.3 - max(0.0, up * after - 0.5 * G * after**2))

    hit = float(np.sqrt(2 * 0.3 / G))
    findings = Run([(CUBE, STEEL, RIGID)], moves, touched=hit).findings()
    assert [(f.severity, f.effects[0].kind) for f in findings] == [("grave", "rebound")] * grave
    assert all(f.effects[0].expected == pytest.approx(0.49) for f in findings)


def test_what_flies_sideways_may_be_vaulted_up():
    hit = float(np.sqrt(2 * 0.3 / G))

    def vaults(t, rest):
        after = t - hit
        up = -0.5 * G * t**2 if after < 0 else 2.3 * after - 0.5 * G * after**2 - 0.3
        return rest + np.array((2.0 * t, 0.0, max(up, -0.3)))

    assert Run([(CUBE, STEEL, RIGID)], vaults, touched=hit).findings() == ()


@pytest.mark.parametrize(("depth", "grave"), [(0.008, False), (0.03, True)])
def test_what_sinks_into_another_further_than_contact_gives_is_found(depth, grave):
    made = Run([(CUBE, WOOD, RIGID)], falls)
    table = replace(made.scene.objects[0], name="table_0")
    made.scene = replace(made.scene, objects=(*made.scene.objects, table))
    rest = made.particles.position
    other = rest * 10 - (0, 0, 5)
    made.particles = replace(
        made.particles,
        **{
            n: np.concatenate([getattr(made.particles, n), x])
            for n, x in {
                "position": other, "velocity": 0 * other, "volume": made.particles.volume,
                "density": made.particles.density, "object": np.ones(len(rest), int), "part": made.particles.part,
            }.items()
        },
    )  # fmt: skip
    still = np.broadcast_to(np.eye(3), (2 * len(rest), 3, 3))
    frames = [
        replace(f, position=np.concatenate([f.position, other]), deformation=still) for f in made.trajectory.frames
    ]
    time = made.trajectory.time
    both = ledger(time, 2, mass=np.ones((len(time), 2)), first_contact=np.full((len(time), 3, 3), np.nan))
    made.trajectory = replace(made.trajectory, frames=frames, ledger=both)
    pair = SurfacePairCheck("thing_0", "table_0", -depth, depth, None, None)
    findings = made.findings(surfaces=(pair,))
    assert [(f.object, f.effects[0].kind) for f in findings] == [("thing_0", "penetration")] * grave


@pytest.mark.parametrize(("lost", "severity"), [(0.05, []), (0.15, ["warning"]), (0.28, ["grave"])])
def test_energy_that_nothing_accounts_for_is_told_by_how_much_it_is(lost, severity):
    assert [f.severity for f in Run([(CUBE, RUBBER, SOLID)], falls).findings(lost)] == severity
    assert Run([(CUBE, STEEL, RIGID)], falls).findings(lost) == (), "nothing rigid keeps energy"
    assert Run([(CUBE, HONEY, SOLID)], falls).findings(lost) == (), "nor does a liquid"


def test_of_energy_alone_it_is_said_how_long_an_impact_takes():
    softer = replace(SOLID, simulated_young_pa=2e5)
    (found,) = Run([(CUBE, RUBBER, softer)], falls).findings(0.28)
    assert "28% of the energy is lost" in found.sentence
    assert "an impact takes about 14 ms instead of 4.5 ms" in found.sentence


def test_what_a_liquid_may_have_lost_is_not_asked_of_solids():
    made = Run([(CUBE, HONEY, SOLID)], falls)
    known = made.trajectory.ledger
    fallen = replace(known, potential=-known.kinetic)
    assert energy_share_of_flows(fallen, made.scene, made.particles, made.field) > 0.9
    dry = replace(made.field, materials=(RUBBER,))
    assert energy_share_of_flows(fallen, made.scene, made.particles, dry) == 0.0


def test_leaves_sway_by_their_length_and_no_crown_slides_along_its_stem():
    stem, crown = block((0.03, 0.03, 0.3)), block((0.2, 0.2, 0.1), low=0.2)

    def sways(far):
        leafy = np.repeat([0.0, 1.0], [len(stem), len(crown)])
        return lambda t, rest: rest + np.outer(leafy * np.sin(20 * t), (0.0, 0.0, -far))

    parts = [(stem, WOOD, RIGID), (crown, LEAVES, SPRINGS)]
    (little,) = Run(parts, sways(0.02), rate=30.0).findings()
    assert (little.part, little.severity, little.stiffness_ratio) == ("part 1", "minor", 0.0)
    (found,) = Run(parts, sways(0.15), rate=30.0).findings()
    seen = found.effects[0]
    assert (found.part, found.severity, found.causes) == ("part 1", "grave", ("springs",))
    assert seen.simulated == pytest.approx(0.15, rel=0.05) and 0.03 < seen.expected < 0.15
    (body,) = Run([(stem, STEEL, RIGID), (crown, LEAVES, SPRINGS)], sways(0.02), rate=30.0).findings()
    assert body.severity == "grave", "what no wood bears is no crown, but of one stiff piece"
