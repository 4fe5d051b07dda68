"""Meshes know who passed through whom, who overlaps and who hovers."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from test_audit import CELL, TREATMENT, row

from corporeal.core.types import Finish, Frame, Particles, Scene, SceneObject, Surface
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.simulation.audit_messages import surface_warnings
from corporeal.simulation.mesh_gaps import distance_within, refine_mesh, surface_pairs
from corporeal.simulation.trajectory_files import FrameLayout, gather_ledgers, write_frame, write_layout

THICK = 0.002
"""Of the plate [m]: a fifth of a cell."""
RADIUS = 0.02
FPS = 50


def surface(mesh, number):
    return Surface(f"part {number}", number, 0, np.array(mesh.vertices), np.array(mesh.faces))


def filled(mesh, spacing=CELL / 2):
    low, high = mesh.bounds
    axes = [np.arange(a + spacing / 4, b, min(spacing, b - a)) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    return points[mesh.contains(points)]


def plate_at(height=0.1):
    plate = trimesh.creation.box((0.2, 0.2, THICK))
    plate.apply_translation((0, 0, height))
    return plate


def ring():
    return trimesh.creation.annulus(r_min=2 * RADIUS, r_max=3 * RADIUS, height=CELL)


@pytest.fixture
def video(tmp_path):
    """Give a function that records a ball on its way past or through something."""

    def shoot(other, way, bend=None):
        ball = trimesh.creation.icosphere(3, RADIUS)
        points = [filled(other), filled(ball)]
        start = np.concatenate([points[0], points[1] + way[0]])
        owner = np.repeat([0, 1], [len(p) for p in points])
        count = len(start)
        particles = Particles(
            position=start,
            velocity=np.zeros((count, 3)),
            volume=np.full(count, (CELL / 2) ** 3),
            density=np.full(count, 1000.0),
            object=owner,
            part=owner,
            cell=CELL,
            treatments=(TREATMENT if bend else replace(TREATMENT, kind="rigid"),) * 2,
            surface=np.zeros((0, 3)),
            object_of_surface=np.zeros(0, int),
            mass_real=(1.0, 1.0),
        )
        ball.apply_translation(way[0])
        names = ("target", "ball")
        scene = Scene(
            "story",
            "",
            tuple(SceneObject(n, n, 0.1) for n in names),
            (surface(other, 0), surface(ball, 1)),
            (Finish("grey", (0.5, 0.5, 0.5, 1.0)),),
            fps=FPS,
            duration=(len(way) - 1) / FPS,
        )
        layout = FrameLayout(owner, np.array([not bend, True]))
        write_layout(tmp_path, layout)
        for k, place in enumerate(way):
            target = points[0] if bend is None else bend(points[0], k)
            now = np.concatenate([target, points[1] + place])
            F = np.tile(np.eye(3), (count, 1, 1))
            away = np.linalg.norm(points[1][:, None] + place - target[None], axis=2).min()
            gap = np.array([[np.inf, away], [away, np.inf]])
            book = replace(row(0.0), time=np.array(k / FPS), centre=np.stack([target.mean(0), place]), gap=gap)
            write_frame(tmp_path, k, Frame(k / FPS, now, F), layout, book)
        return surface_pairs(scene, particles, gather_ledgers(tmp_path, len(way)))

    return shoot


def straight(start, end, frames):
    return np.linspace(start, end, frames)


@pytest.mark.slow
@pytest.mark.parametrize("frames", [3, 12, 60])
def test_a_ball_that_goes_through_a_plate_is_named_however_fast_it_is(video, frames):
    (pair,) = video(plate_at(), straight((0.01, 0.02, 0.2), (0.01, 0.02, 0.01), frames))
    assert (pair.first, pair.second, pair.passed) == ("target", "ball", "ball")
    assert pair.passed_s is not None and 0.0 < pair.passed_s <= (frames - 1) / FPS
    (sentence,) = surface_warnings([pair])
    assert sentence.startswith("Ball passed through target before")


def test_a_ball_that_comes_back_or_goes_past_passes_through_nothing(video):
    down = straight((0.01, 0.02, 0.2), (0.01, 0.02, 0.105), 6)
    (pair,) = video(plate_at(), np.concatenate([down, down[::-1]]))
    assert pair.passed is None
    assert pair.depth_m == pytest.approx(RADIUS - 0.004, abs=THICK)
    beside = video(plate_at(), straight((0.13, 0.02, 0.2), (0.13, 0.02, 0.02), 4))
    assert all(pair.passed is None for pair in beside)


def test_what_spins_fast_between_two_frames_is_not_passed_through(video):
    """A chord leads through the plate where the ball is farther off than its edge reaches."""
    middle, beside = np.array((0.0, 0.0, 0.1)), (0.0, 0.121, 0.123)

    def spun(points, k):
        turn = Rotation.from_euler("x", 140.0 * k, degrees=True)
        return turn.apply(points - middle) + middle

    assert all(pair.passed is None for pair in video(plate_at(), [beside] * 4, spun))


def test_a_ball_that_falls_through_a_ring_touches_nothing(video):
    for pair in video(ring(), straight((0.0, 0.0, 0.1), (0.0, 0.0, -0.1), 5)):
        assert pair.passed is None and pair.depth_m == 0.0


def test_a_plate_that_gives_way_is_not_passed_through(video):
    def dented(points, k):
        below = np.exp(-(((points[:, :2] - (0.01, 0.02)) / 0.05) ** 2).sum(axis=1))
        return points - np.outer(below, (0, 0, min(0.009 * k, 0.045)))

    way = straight((0.01, 0.02, 0.125), (0.01, 0.02, 0.08), 6)
    (pair,) = video(plate_at(), way, dented)
    assert pair.passed is None


def test_distances_are_those_of_the_meshes(video):
    way = np.array([(0.0, 0.0, 0.2), (0.0, 0.0, 0.1 + THICK / 2 + RADIUS + 0.0031)])
    (pair,) = video(plate_at(), way)
    assert pair.gap_end_m == pytest.approx(0.0031, abs=2e-4)
    assert pair.depth_m == 0.0


def test_long_triangles_are_halved_and_stay_one_surface():
    box = trimesh.creation.box((1.0, 0.6, 0.1))
    fine = refine_mesh(Mesh(np.array(box.vertices), np.array(box.faces)), 0.07)
    again = trimesh.Trimesh(fine.vertices, fine.triangles, process=False)
    assert again.is_watertight and again.volume == pytest.approx(0.06)
    assert again.edges_unique_length.max() <= 0.07


@pytest.mark.parametrize(("shift", "reach"), [(1.02, 0.05), (0.95, 0.05), (0.3, 0.05), (2.0, 0.1)])
def test_triangles_in_reach_alone_give_the_same_least_distance(shift, reach):
    made = trimesh.creation.icosphere(4, 1.0)
    shape = QueryMesh(Mesh(np.array(made.vertices, float), np.array(made.faces, np.int64)))
    points = np.random.default_rng(3).normal(0.0, 0.02, (40, 3)) + np.array([shift, 0, 0])
    within = shape.inside(points)
    found = distance_within(points, shape, within, reach)
    true = shape.closest(points)[0]
    near = (true <= reach) | within | (true == true.min())
    assert found[near].tobytes() == true[near].tobytes()
    assert (found >= true).all()
