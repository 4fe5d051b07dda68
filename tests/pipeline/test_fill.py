"""Parts become particles: masses, walls, labels, contact points, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import (
    Finish,
    Law,
    Material,
    MaterialField,
    Part,
    PartComponent,
    PartDescription,
    Parts,
    Push,
    RangePlacement,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Wall,
    Wind,
)
from corporeal.discretization.build_model import build_model
from corporeal.discretization.impact_speeds import expected_motions
from corporeal.discretization.mesh_measures import measure_objects
from corporeal.materials import find_material
from corporeal.mpm.problem import Plane
from corporeal.pipeline.stages.fill import FillConfig, fill, name_objects
from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
from corporeal.simulation.ledger_row import object_of_body

RUBBER = Material("rubber", Law.NEO_HOOKEAN, 2e6, 0.48, 1100.0)
STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, yield_stress=2.5e8)
ALUMINIUM = Material("aluminium", Law.VON_MISES, 6.9e10, 0.33, 2700.0, yield_stress=1.5e8)
SOLID = Structure("solid")


def thing(*parts, name="thing", **how):
    """One object: parts are (mesh, material) or (mesh, material, structure)."""
    return name, parts, how


def inputs(*things):
    objects, surfaces, catalogue, object_of, part_of = [], [], [], [], []
    materials, structures = [], []
    for number, (name, made_of, how) in enumerate(things):
        objects.append(SceneObject(f"{name}_{number}", name, 1.0, **how))
        for mesh, material, *structure in made_of:
            vertices = np.asarray(mesh.vertices, dtype=np.float64)
            triangles = np.asarray(mesh.faces, dtype=np.int64)
            surfaces.append(Surface(material.name, number, 0, vertices, triangles))
            object_of += [number] * len(triangles)
            part_of += [len(catalogue)] * len(triangles)
            catalogue.append(Part(material.name, number, "node"))
            materials.append(material)
            structures.append(structure[0] if structure else SOLID)
    k = len(catalogue) + 1
    points = len(part_of)
    return (
        Scene("test", "test.glb", tuple(objects), tuple(surfaces), (Finish("plain"),)),
        Parts(np.array(object_of), np.array(part_of), np.ones(points), tuple(catalogue)),
        MaterialField(
            tuple(materials),
            tuple(structures),
            tuple(PartDescription(m.name, m.name) for m in materials),
            np.full((k, k), 0.5),
            np.full((k, k), 0.5),
        ),
    )


def put(mesh, bottom, x=0.0):
    mesh = mesh.copy()
    mesh.apply_translation((x, 0, bottom - mesh.bounds[0, 2]))
    return mesh


def ball(radius=0.1, bottom=0.5, x=0.0):
    return put(trimesh.creation.icosphere(4, radius), bottom, x)


def inertia(points, masses):
    centre = np.average(points, axis=0, weights=masses)
    arm = points - centre
    return centre, (masses[:, None] * arm).T @ arm


def test_a_ball_has_the_mass_and_inertia_of_a_ball():
    particles = fill(*inputs(thing((ball(0.1), RUBBER))))
    mass = 1100 * ball(0.1).volume
    assert particles.treatments[0].kind == "deformable"
    assert particles.mass.sum() == pytest.approx(mass, rel=1e-6)
    assert particles.mass_real[0] == pytest.approx(mass, rel=1e-6)
    centre, second = inertia(particles.position, particles.mass)
    assert np.allclose(centre, [0, 0, 0.6], atol=0.001)
    # Half a spacing of skin holds no particle centres, so a coarse deformable ball's is smaller.
    assert np.allclose(np.diag(second), mass * 0.1**2 / 5, rtol=0.05)


def test_a_rigid_body_has_its_exact_mass_centre_and_inertia():
    hammer = [put(trimesh.creation.box((0.1, 0.04, 0.04)), 0.26)]
    hammer.append(put(trimesh.creation.cylinder(0.015, 0.26), 0.0))
    particles = fill(*inputs(thing((hammer[0], STEEL), (hammer[1], replace(STEEL, density=700.0)))))
    assert {t.kind for t in particles.treatments} == {"rigid"}
    masses = [7850 * hammer[0].volume, 700 * hammer[1].volume]
    assert particles.mass_real == pytest.approx(masses, rel=0.005)
    assert particles.mass.sum() == pytest.approx(sum(masses), rel=0.005)
    centre, second = inertia(particles.position, particles.mass)
    height = (masses[0] * 0.28 + masses[1] * 0.13) / sum(masses)
    assert np.allclose(centre, [0, 0, height], atol=0.01 * 0.3)
    along = masses[0] * (0.04**2 / 12 + (0.28 - height) ** 2)
    along += masses[1] * (0.26**2 / 12 + (0.13 - height) ** 2)
    assert second[2, 2] == pytest.approx(along, rel=0.01)


def test_a_rigid_body_has_contact_points_on_its_skin_and_rests_on_its_lowest():
    particles = fill(*inputs(thing((ball(0.1, bottom=0.0), STEEL))))
    assert particles.treatments[0].kind == "rigid"
    radius = np.linalg.norm(particles.surface - [0, 0, 0.1], axis=1)
    assert 500 < len(particles.surface) <= 5000
    assert 0.099 < radius.min()
    assert radius.max() < 0.1 + 1e-9
    assert particles.surface[:, 2].min() == pytest.approx(0, abs=1e-12)
    gap, _ = KDTree(particles.surface).query(ball(0.1, bottom=0.0).vertices)
    assert gap.max() < particles.cell


def can():
    return put(trimesh.creation.cylinder(0.033, 0.122, sections=64), 1.0)


def in_can(wall):
    """Volume of a can's wall, and of what is behind it [m³]; its side is 64 flat faces."""
    narrow = 1 - wall / (0.033 * np.cos(np.pi / 64))
    room = can().volume * narrow**2 * (1 - 2 * wall / 0.122)
    return can().volume - room, room


def test_a_can_keeps_its_areal_mass_and_has_layers():
    wall = Structure("shell", 1e-4)
    particles = fill(*inputs(thing((can(), ALUMINIUM, wall))))
    assert particles.treatments[0].kind == "shell"
    mass = 2700 * in_can(1e-4)[0]
    assert particles.mass.sum() == pytest.approx(mass, rel=1e-4)
    assert particles.mass_real[0] == pytest.approx(mass, rel=1e-4)
    radius = np.linalg.norm(particles.position[:, :2], axis=1)
    middle = np.abs(particles.position[:, 2] - 1.061) < 0.02
    thick = particles.treatments[0].thickness
    assert thick is not None
    assert radius[middle].min() > 0.033 - thick  # hollow
    depths = (0.033 - radius[middle]) / (particles.cell / 2)
    assert (depths < 1).sum() > 0.15 * middle.sum()
    assert (depths > 1).sum() > 0.15 * middle.sum()


def test_a_shell_too_narrow_to_be_hollow_is_filled_with_its_walls_mass():
    wall, rod = Structure("shell", 1e-3), put(trimesh.creation.box((0.02, 0.02, 0.4)), 1.0)
    wide = put(trimesh.creation.box((0.3, 0.3, 0.3)), 1.0, x=1.0)
    scene = inputs(thing((wide, RUBBER), (rod, RUBBER, wall)))
    particles = fill(*scene)
    mass = particles.mass[particles.part == 1].sum()
    assert mass == pytest.approx(1100 * (0.02**2 * 0.4 - 0.018**2 * 0.398), rel=1e-3)
    assert "filled as a solid" in particles.fills[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("whole", "hollow"),
    [
        (trimesh.creation.icosphere(4, 0.1), trimesh.creation.icosphere(4, 0.08)),
        (trimesh.creation.box((0.2, 0.2, 0.2)), trimesh.creation.box((0.16, 0.16, 0.16))),
        (trimesh.creation.box((0.1, 0.1, 1.0)), trimesh.creation.box((0.06, 0.06, 0.96))),
        (trimesh.creation.box((0.5, 0.5, 0.1)), trimesh.creation.box((0.46, 0.46, 0.06))),
        (trimesh.creation.cylinder(0.05, 0.2), trimesh.creation.cylinder(0.03, 0.16)),
    ],
)
def test_a_thick_wall_weighs_what_is_between_its_faces(whole, hollow):
    """Area times thickness would be 9 to 57 % more: the inner face is smaller than the outer."""
    particles = fill(*inputs(thing((put(whole, 1.0), STEEL, Structure("shell", 0.02)))))
    true = STEEL.density * (whole.volume - hollow.volume)
    assert particles.mass_real[0] == pytest.approx(true, rel=0.02)


def test_a_shell_is_never_heavier_than_the_same_object_solid():
    particles = fill(*inputs(thing((ball(0.1), RUBBER, Structure("shell", 0.5)))))
    assert particles.mass_real[0] == pytest.approx(1100 * ball(0.1).volume, rel=1e-6)


def test_a_solid_whose_mesh_is_a_vessel_weighs_its_wall_not_its_contents():
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=48), 0.5)
    particles = fill(*inputs(thing((cup, STEEL))))
    assert particles.mass.sum() == pytest.approx(7850 * abs(cup.volume), rel=0.01)
    inside = np.linalg.norm(particles.position[:, :2], axis=1) < 0.03
    assert particles.position[inside, 2].max() < 0.5 + 0.05


@pytest.mark.slow
def test_every_particle_bears_the_name_of_the_part_it_lies_in():
    seat = put(trimesh.creation.box((0.4, 0.4, 0.1)), 0.1)
    foot = put(trimesh.creation.box((0.1, 0.1, 0.1)), 0.0)
    particles = fill(*inputs(thing((seat, RUBBER), (foot, STEEL))))
    assert np.array_equal(particles.part == 0, particles.position[:, 2] > 0.1)
    assert particles.mass_real == pytest.approx([1100 * 0.016, 7850 * 0.001], rel=0.01)


@pytest.mark.slow
def test_a_leaf_without_volume_still_has_particles_and_a_mass():
    leaf = trimesh.Trimesh([[0, 0, 0.5], [0.1, 0, 0.5], [0.1, 0.1, 0.52]], [[0, 1, 2]])
    stem = put(trimesh.creation.cylinder(0.002, 0.5), 0.0)
    thick = Structure("shell", 2e-4)
    particles = fill(*inputs(thing((stem, RUBBER), (leaf, RUBBER, thick)), thing((ball(), RUBBER))))
    counts = np.bincount(particles.part)
    assert counts.min() >= 1
    assert particles.mass[particles.part == 1].sum() == pytest.approx(1100 * leaf.area * 2e-4)
    assert particles.mass[particles.part == 0].sum() == pytest.approx(1100 * stem.volume, rel=0.01)


@pytest.mark.slow
def test_a_narrow_sheet_is_as_light_as_its_thick_wall_and_no_hollow_body():
    """A gutter of foil, open above: what is narrow and closed is filled, a sheet is not."""
    foil = Structure("shell", 1e-4)
    bent = trimesh.creation.cylinder(0.03, 0.4, sections=24)
    bent.update_faces((bent.triangles_center[:, 1] < 0) & (np.abs(bent.face_normals[:, 2]) < 0.5))
    bent.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    scene, parts, field = inputs(thing((put(bent, 0.0), replace(RUBBER, young_pa=1e8), foil)), thing((ball(), RUBBER)))
    particles = fill(scene, parts, field, FillConfig(detail="draft"))
    treatment, own = particles.treatments[0], particles.part == 0
    assert treatment.kind == "shell"
    assert np.ptp(particles.position[own], axis=0).min() < 6 * particles.cell
    assert treatment.density < 0.1 * RUBBER.density
    np.testing.assert_allclose(particles.density[own], treatment.density, rtol=1e-9)
    assert particles.mass[own].sum() == pytest.approx(1100.0 * 1e-4 * bent.area, rel=0.01)


def test_the_same_seed_gives_the_same_particles():
    scene = inputs(thing((ball(0.1), RUBBER)))
    first, again, other = (fill(*scene, FillConfig(seed=s)) for s in (0, 0, 1))
    assert np.array_equal(first.position, again.position)
    assert np.array_equal(first.volume, again.volume)
    assert not np.array_equal(first.position[:9], other.position[:9])


def test_particles_of_touching_objects_keep_apart():
    lower = put(trimesh.creation.box((0.2, 0.2, 0.2)), 0.0)
    upper = put(trimesh.creation.box((0.2, 0.2, 0.2)), 0.19)
    particles = fill(*inputs(thing((lower, RUBBER)), thing((upper, RUBBER))))
    first = particles.position[particles.object == 0]
    gap, _ = KDTree(first).query(particles.position[particles.object == 1])
    assert gap.min() >= particles.cell / 4
    assert particles.mass.sum() == pytest.approx(2 * 1100 * 0.008, rel=1e-6)


def test_a_fall_gives_its_speed_and_a_standing_object_expects_what_falls_on_it():
    scene, parts, _ = inputs(
        thing((put(trimesh.creation.box((1, 1, 0.2)), 0.0), RUBBER)),
        thing((ball(0.1, bottom=1.2), RUBBER)),
        thing((ball(0.1, bottom=0.0, x=3.0), RUBBER), push=Push((3.0, 0.0, 0.0), 0.0, 0.5)),
    )

    found = expected_motions(scene, measure_objects(scene, parts, 0), [1.0, 1.0, 1.0], 0)
    falling = np.sqrt(2 * 9.81 * 1.0)
    assert found[1].impact_speed == pytest.approx(np.hypot(falling, 1.5), rel=1e-3)
    assert found[0].impact_speed == pytest.approx(falling, rel=1e-3)
    assert found[2].impact_speed == pytest.approx(np.hypot(falling, 1.5), rel=1e-3)
    assert found[2].acceleration == pytest.approx(12.81)


def test_what_cannot_be_filled_is_named():
    flat = trimesh.Trimesh([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
    with pytest.raises(UserError, match="no object encloses a volume"):
        fill(*inputs(thing((flat, RUBBER))))
    point = trimesh.Trimesh(np.zeros((3, 3)), [[0, 1, 2]], process=False)
    with pytest.raises(UserError, match=r"Part 'steel' of object 'thing_0' has no surface"):
        fill(*inputs(thing((ball(), RUBBER), (point, STEEL))))
    with pytest.raises(UserError, match=r"'thing_0' reaches .* below the floor"):
        fill(*inputs(thing((ball(0.1, bottom=-0.1), RUBBER))))


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["objects", "ycb"])
def test_every_real_object_can_be_filled(folder, shared_assets):
    files = sorted((shared_assets / folder).glob("*.glb"))
    assert files
    for file in files:
        mesh = trimesh.load_scene(file).to_geometry()
        mesh.vertices *= 0.3 / mesh.extents.max()
        particles = fill(*inputs(thing((put(mesh, 0.05), RUBBER), name=file.stem)))
        assert 1 <= particles.count <= 40_000, file
        assert particles.mass.sum() == pytest.approx(sum(particles.mass_real), rel=1e-6)
        assert np.isfinite(particles.position).all()
        assert particles.volume.min() > 0


@pytest.mark.slow
def test_a_rigid_object_touches_with_its_own_surface_only():
    """Another object's corners once held a ball up in the air."""
    floor = put(trimesh.creation.box((0.4, 0.4, 0.1)), 0.0)
    particles = fill(*inputs(thing((floor, RUBBER)), thing((ball(0.05, bottom=0.2), STEEL))))
    assert set(particles.object_of_surface) == {1}
    assert np.abs(particles.surface[:, :2]).max() < 0.051
    assert particles.surface[:, 2].min() > 0.19


@pytest.mark.slow
def test_what_stands_in_the_wind_shows_its_whole_surface_to_it():
    brick = put(trimesh.creation.box((0.1, 0.2, 0.3)), 0.0)
    leaf = trimesh.Trimesh([[1, 0, 1], [2, 0, 1], [1, 0, 2.0]], [[0, 1, 2]])
    given = inputs(
        thing((brick, RUBBER)),
        thing((leaf, RUBBER), (ball(0.1, bottom=3.0), RUBBER), wind=Wind((5.0, 0.0, 0.0))),
        thing((put(brick, 1.0), RUBBER), wind=Wind((5.0, 0.0, 0.0))),
    )
    particles = fill(*given)
    owner = particles.object[particles.particle_of_face]
    assert set(owner) == {1, 2}
    for direction, size in zip(np.eye(3), (0.06, 0.03, 0.02), strict=True):
        for side in (direction, -direction):
            shown = np.maximum(particles.face[owner == 2] @ side, 0.0).sum()
            assert shown == pytest.approx(size, rel=1e-6)
    shown = np.maximum(particles.face[owner == 1] @ np.array([0.0, 1.0, 0.0]), 0.0).sum()
    assert shown == pytest.approx(0.5 + np.pi * 0.01, rel=0.01)
    outward = particles.position[particles.particle_of_face] - np.array([0.0, 0.0, 1.15])
    assert np.einsum("ij,ij->i", outward, particles.face)[owner == 2].min() > 0


def test_a_wind_counts_as_an_acceleration_and_carries_nothing_faster_than_itself():
    scene, parts, _ = inputs(thing((ball(0.1, bottom=0.0), RUBBER), wind=Wind((5.0, 0.0, 0.0))))
    anatomies = measure_objects(scene, parts, 0)
    heavy, light = (expected_motions(scene, anatomies, [mass], 0)[0] for mass in (10.0, 1e-3))
    force = 0.5 * 1.2 * 1.17 * np.pi * 0.01 * 25
    assert heavy.acceleration == pytest.approx(9.81 + force / 10.0, rel=0.01)
    assert heavy.impact_speed == pytest.approx(2.0 * force / 10.0, rel=0.01)
    assert light.impact_speed == pytest.approx(5.0, rel=1e-3)


# ---------------------------------------------------------------- plants


LEAVES = Material("leaves-flowers", Law.NEO_HOOKEAN, 3e8, 0.4, 150.0, loss=0.1)
WOOD = Material("hardwood", Law.HENCKY, 1.2e10, 0.3, 700.0)
CLAY = Material("terracotta", Law.HENCKY, 1.2e10, 0.2, 1900.0)
SOIL = Material("potting_soil", Law.DRUCKER_PRAGER, 3e5, 0.25, 600.0, friction_angle=0.6,
                cohesion=2e3, loss=0.2)  # fmt: skip


def leaf_blades(count, bottom):
    """Small triangles on a spiral."""
    corner = np.array([[0.015, 0, 0], [0.095, 0.02, 0], [0.095, -0.02, 0.01]])
    meshes = []
    for k in range(count):
        turn = trimesh.transformations.rotation_matrix(2.4 * k, [0, 0, 1])
        blade = trimesh.Trimesh(corner, [[0, 1, 2]], process=False)
        blade.apply_transform(turn)
        blade.apply_translation((0, 0, bottom + 0.3 * k / count))
        meshes.append(blade)
    return trimesh.util.concatenate(meshes)


def a_potted_plant(wood=WOOD, **how):
    outside = trimesh.creation.cylinder(0.12, 0.2, sections=24)
    pot = put(outside, 0.0)
    soil = put(trimesh.creation.cylinder(0.1, 0.18, sections=24), 0.01)
    stem = put(trimesh.creation.cylinder(0.012, 0.5, sections=12), 0.11)
    made = [(pot, CLAY), (soil, SOIL), (stem, wood), (leaf_blades(40, 0.4), LEAVES)]
    return inputs(thing(*made, **how))


def test_a_plant_is_a_rigid_stem_on_a_spring_with_leaves_on_stalks():
    scene, parts, field = a_potted_plant(push=Push((3.0, 0.0, 0.0), 0.0, 0.2))
    particles = fill(scene, parts, field)
    assert [t.kind for t in particles.treatments] == ["rigid", "rigid", "rigid", "foliage"]
    assert "pot" in particles.treatments[1].reason
    (root,) = particles.roots
    assert (root.object, root.part) == (0, 2)
    assert root.stiffness == pytest.approx(0.34 * 3e5 * 0.08**3, rel=1e-6)
    assert root.point == pytest.approx((0, 0, 0.11 + 0.4 * 0.08), abs=2e-3)
    leafy = particles.part == 3
    assert np.all(particles.rate[~leafy] == 0.0)
    length = np.linalg.norm([0.08, 0.02, 0.01])
    rate = np.sqrt(2e8 * 0.25e-3**2 / (0.6 * 800)) / length**2
    assert np.median(particles.rate[leafy]) == pytest.approx(rate, rel=0.05)
    assert particles.mass[leafy].sum() == pytest.approx(particles.mass_real[3])


def test_a_plant_becomes_bodies_that_hold_together_and_never_touch():
    scene, parts, field = a_potted_plant()
    posed = build_model(scene, fill(scene, parts, field), field)
    problem = posed.problem
    assert [b.rigid for b in problem.bodies] == [True, True, False]
    assert problem.joints[0].first == 0 and problem.joints[0].second == 1
    assert problem.bodies[2].tether is not None and problem.bodies[2].tether.holder == 1
    assert set(problem.excluded_pairs) == {(0, 1), (0, 2), (1, 2)}
    assert list(posed.object_of_body) == [0, 0, 0]
    assert list(object_of_body(problem)) == [0, 0, 0]


def test_a_plant_whose_stem_bends_is_no_rigid_one():
    rubbery = replace(WOOD, young_pa=1e7)
    scene, parts, field = a_potted_plant(rubbery, push=Push((3.0, 0.0, 0.0), 0.0, 0.2))
    particles = fill(scene, parts, field)
    assert particles.treatments[2].kind == "deformable"
    assert "foliage" not in [t.kind for t in particles.treatments]
    assert len(particles.rate) == 0


def test_a_rod_thinner_than_the_grid_stands_on_rings_with_its_bending_stiffness():
    soft = replace(RUBBER, young_pa=2e7)
    rod = trimesh.creation.cylinder(0.004, 0.8, sections=16)
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    scene, parts, field = inputs(thing((put(rod, 0.3), soft)))
    particles = fill(scene, parts, field)
    (treatment,) = particles.treatments
    r = 0.008 / (2 * particles.cell)
    assert r < 1
    assert treatment.kind == "deformable"
    assert treatment.simulated_young_pa == pytest.approx(2e7 * r**4, rel=0.1)
    assert treatment.density == pytest.approx(1100 * r**2, rel=0.05)
    assert "times as thick" in treatment.reason
    assert particles.mass.sum() == pytest.approx(1100 * np.pi * 0.004**2 * 0.8, rel=0.04)
    assert particles.count == pytest.approx(6 * 0.8 / (particles.cell / 2), abs=7)


def test_what_stands_in_a_wall_is_named_and_walls_are_planes():
    scene, parts, field = inputs(thing((ball(0.1, bottom=0.0), RUBBER)))
    inside = replace(scene, walls=(Wall((1.0, 0.0, 0.0), (0.05, 0.0, 0.0)),))
    with pytest.raises(UserError, match=r"'thing_0' reaches 0\.15 m into wall 1"):
        fill(inside, parts, field)
    beside = replace(scene, walls=(Wall((1.0, 0.0, 0.0), (-0.2, 0.0, 0.0)),))
    problem = build_model(beside, fill(beside, parts, field), field).problem
    assert problem.planes[1] == Plane((1.0, 0.0, 0.0), -0.2)
    assert problem.friction.shape == (3, 3)
    assert problem.friction[0, 1] == problem.friction[0, 2] == problem.friction[2, 0]


def test_a_ball_comes_back_from_a_wall(tmp_path):
    scene, parts, field = inputs(thing((ball(0.1, bottom=0.3), RUBBER), velocity=(2.0, 0.0, 0.0)))
    scene = replace(scene, walls=(Wall((-1.0, 0.0, 0.0), (0.15, 0.0, 0.0)),), duration=0.2, fps=20)
    particles = fill(scene, parts, field)
    moved = simulate(scene, particles, field, SimulateConfig(), tmp_path)
    velocity = moved.ledger.momentum[-1, 0, 0] / moved.ledger.mass[-1, 0]
    assert -2.0 < velocity < -1.2
    assert moved.ledger.plane_impulse[-1, 1, 0, 0] == pytest.approx(
        moved.ledger.momentum[-1, 0, 0] - moved.ledger.momentum[0, 0, 0], rel=1e-3
    )


# ---------------------------------------------------------------- what is filled

SOUP = Material("soup", Law.NEO_HOOKEAN, 300.0, 0.49, 1050.0)
SUGAR = Material("sugar", Law.DRUCKER_PRAGER, 5e6, 0.3, 900.0, friction_angle=0.55, cohesion=0.0)
STUFFING = Material("fibre_fill", Law.NEO_HOOKEAN, 5e3, 0.1, 30.0, loss=0.2)
COTTON = Material("cotton", Law.NEO_HOOKEAN, 5e7, 0.3, 400.0, loss=0.1)


def filled(contents, fill=1.0, thickness=1e-3, loose=True):
    return Structure("filled", thickness, contents=contents, fill=fill, loose=loose)


def test_a_full_can_weighs_its_wall_and_what_is_behind_it():
    made = filled(SOUP, 1.0, 2e-4)
    particles = fill(*inputs(thing((can(), STEEL, made))))
    wall, soup = np.array([7850, 1050]) * in_can(2e-4)
    assert particles.mass_real[0] == pytest.approx(wall + soup, rel=1e-5)
    assert particles.mass.sum() == pytest.approx(wall + soup, rel=1e-5)
    assert particles.treatments[0].kind == "rigid"
    assert "one rigid mass" in particles.treatments[0].reason
    assert f"{soup:.3g} kg of soup that take up 100 %" in particles.fills[0].replace("%", " %")


@pytest.mark.parametrize("contents", [SOUP, SUGAR])
def test_what_flows_lies_at_the_bottom_of_a_half_full_can(contents):
    particles = fill(*inputs(thing((can(), STEEL, filled(contents, 0.5, 1e-3)))))
    wall, load = np.array([7850, contents.density * 0.5]) * in_can(1e-3)
    assert particles.mass.sum() == pytest.approx(wall + load, rel=3e-4)
    height, second = inertia(particles.position, particles.mass)
    low = 1.0 + 1e-3 + (0.122 - 2e-3) / 4
    assert height[2] == pytest.approx((wall * 1.061 + load * low) / (wall + load), abs=5e-4)
    inside = np.linalg.norm(particles.position[:, :2], axis=1) < 0.02
    middle = particles.position[inside & (np.abs(particles.position[:, 2] - 1.09) < 0.01)]
    assert not len(middle)  # air
    # About the axis: one body that is carried, or the contents that move by themselves.
    turn = np.array([wall * 0.033**2 * 0.85, load * 0.032**2 / 2])
    if particles.contents:
        own = particles.object == 1
        away = np.linalg.norm(particles.position[own, :2], axis=1)
        assert particles.mass[own].sum() == pytest.approx(load, rel=3e-4)
        assert particles.mass[own] @ away**2 == pytest.approx(turn[1], rel=0.02)
    else:
        assert second[0, 0] + second[1, 1] == pytest.approx(turn.sum(), rel=0.04)


def test_an_egg_that_falls_is_no_soft_ball():
    shell, inside = (e.pick(e.typical()) for e in map(find_material, ("eggshell", "packed_food")))
    made = filled(inside, 0.97, 3.6e-4, loose=False)
    egg = put(trimesh.creation.icosphere(3, 0.025), 0.3)
    particles = fill(*inputs(thing((egg, shell, made))))
    assert particles.treatments[0].kind == "rigid"
    assert "breaks before it visibly flexes" in particles.treatments[0].reason


def test_a_pillow_is_as_soft_as_its_stuffing_and_as_heavy_as_all_of_it():
    pillow = put(trimesh.creation.icosphere(4, 0.2), 0.5)
    pillow.vertices *= (1, 1, 0.5)
    made = filled(STUFFING, 1.0, 5e-4, loose=False)
    scene, parts, field = inputs(thing((put(pillow, 0.3), COTTON, made)))
    particles = fill(scene, parts, field)
    treatment = particles.treatments[0]
    assert treatment.kind == "deformable"
    assert treatment.young_pa == 5e3
    assert "it is simulated as its fibre_fill" in treatment.reason
    inner = pillow.vertices - 5e-4 * pillow.vertex_normals
    room = trimesh.Trimesh(inner, pillow.faces, process=False).volume
    cover, inside = 400 * (pillow.volume - room), 30 * room
    assert particles.mass.sum() == pytest.approx(cover + inside, rel=2e-4)
    middle = np.linalg.norm((particles.position - particles.position.mean(0))[:, :2], axis=1) < 0.1
    core = middle & (np.abs(particles.position[:, 2] - 0.4) < 0.05)
    assert particles.density[core] == pytest.approx(30 * inside / (30 * pillow.volume), rel=0.01)
    assert particles.density.max() > 1.3 * particles.density[core].max()  # the cover
    body = build_model(scene, particles, field).problem.bodies[0]
    assert set(body.law) == {Law.NEO_HOOKEAN.value}
    assert body.young_pa == pytest.approx(treatment.simulated_young_pa)


def test_a_cup_holds_what_goes_in_up_to_its_rim():
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=64), 0.5)
    particles = fill(*inputs(thing((cup, STEEL, filled(SOUP, 0.5)))))
    room = np.pi * 0.046**2 * 0.096
    wall = 7850 * abs(cup.volume)  # the mesh shows both faces: what was stated is not needed
    assert particles.mass_real[0] == pytest.approx(wall + 525 * room, rel=0.02)
    assert particles.mass.sum() == pytest.approx(particles.mass_real[0], rel=1e-6)
    inside = np.linalg.norm(particles.position[:, :2], axis=1) < 0.04
    top = particles.position[inside, 2].max()
    assert top == pytest.approx(0.5 + 0.004 + 0.048, abs=0.004)


@pytest.mark.parametrize(("chosen_by", "thickness"), [("recording", 1e-3), ("fallback", 4e-3)])
def test_who_looked_at_a_thin_wall_knows_it_better_than_the_mesh(chosen_by, thickness):
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=64), 0.5)
    scene, parts, field = inputs(thing((cup, STEEL, Structure("shell", 1e-3))))
    placed = {"shell_thickness": RangePlacement(0.1, chosen_by, "It looks thin.")}
    words = (replace(field.words[0], structure="shell", placements=placed),)
    particles = fill(scene, parts, replace(field, words=words))
    said = "1 mm thick as a recorded answer says (its mesh draws 3.93 mm)"
    shown = "3.93 mm thick as its mesh shows"
    assert (said if chosen_by == "recording" else shown) in particles.fills[0]
    wall = min(cup.area / 2 * thickness, abs(cup.volume))
    assert particles.mass_real[0] == pytest.approx(7850 * wall, rel=0.01)
    assert particles.mass.sum() == pytest.approx(particles.mass_real[0], rel=1e-6)


def test_a_thickness_that_a_person_states_outranks_the_mesh():
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=64), 0.5)
    scene, parts, field = inputs(thing((cup, STEEL, Structure("shell", 1e-3))))
    words = (replace(field.words[0], values={"shell_thickness": 1e-3}),)
    told = fill(scene, parts, replace(field, words=words)).fills[0]
    assert "1 mm thick as your annotation says (its mesh draws 3.93 mm)" in told


def test_open_ware_from_pictures_has_the_usual_wall_not_the_one_that_is_drawn():
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=64), 0.5)
    scene, parts, field = inputs(thing((cup, STEEL, Structure("shell", 1e-3))))
    words = replace(field.words[0], structure="sheet", wall_unseen=True)
    particles = fill(scene, parts, replace(field, words=(words,)))
    assert "1 mm thick as such walls usually are (its mesh draws 3.93 mm)" in particles.fills[0]
    assert particles.mass_real[0] == pytest.approx(7850 * cup.area / 2 * 1e-3, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("unseen", [True, False])
def test_a_cup_that_pictures_drew_as_a_lump_has_no_lid(unseen):
    """A mesh that somebody made is read as it is drawn: a closed shell."""
    cup = put(trimesh.creation.cylinder(0.05, 0.1, sections=64), 0.5)
    scene, parts, field = inputs(thing((cup, STEEL, Structure("shell", 3e-3))))
    words = replace(field.words[0], structure="sheet", wall_unseen=unseen)
    particles = fill(scene, parts, replace(field, words=(words,)))
    for points in (particles.position, particles.surface):
        inside = np.linalg.norm(points[:, :2], axis=1) < 0.03
        assert (inside & (points[:, 2] > 0.53)).any() != unseen
        assert (inside & (points[:, 2] < 0.51)).any()
    assert particles.mass.sum() == pytest.approx(particles.mass_real[0], rel=1e-6)
    assert ("of its outside: its inside was not seen" in particles.fills[0]) == unseen
    sheet = 7850 * 3e-3 * np.pi * (0.05**2 + 0.1 * 0.1)
    assert (particles.mass.sum() == pytest.approx(sheet, rel=0.02)) == unseen


def test_what_a_soft_cup_holds_is_as_light_as_it_is():
    outline = [(0, 0), (0.05, 0), (0.05, 0.1), (0.046, 0.1), (0.046, 0.004), (0, 0.004)]
    cup = put(trimesh.creation.revolve(np.array(outline), sections=64), 0.5)
    particles = fill(*inputs(thing((cup, RUBBER, filled(STUFFING, loose=False)))))
    assert particles.treatments[0].kind == "deformable"
    inside = np.linalg.norm(particles.position[:, :2], axis=1) < 0.04
    inside &= particles.position[:, 2] > 0.51
    assert inside.sum() > 100
    assert particles.density[inside] == pytest.approx(30, rel=1e-6)
    assert particles.density.max() == pytest.approx(1100, rel=1e-6)
    assert particles.mass.sum() == pytest.approx(sum(particles.mass_real), rel=1e-6)


def test_pieces_of_one_mesh_weigh_by_their_shares():
    scene, parts, field = inputs(thing((ball(0.05), STEEL)))
    blade = PartDescription("blade", "steel", "solid", volume_share=0.25, surface_share=0.5)
    handle = PartDescription("handle", "rubber", "shell", 1e-3, volume_share=0.75, surface_share=0.5)
    pieces = (PartComponent(blade, STEEL, SOLID), PartComponent(handle, RUBBER, Structure("shell", 1e-3)))
    particles = fill(scene, parts, replace(field, pieces=(pieces,)))
    mesh = ball(0.05)
    wall = mesh.volume * (1 - (0.049 / 0.05) ** 3)
    mass = 7850 * 0.25 * mesh.volume + 1100 * 0.5 * wall
    assert particles.mass_real[0] == pytest.approx(mass, rel=1e-4)
    assert particles.mass.sum() == pytest.approx(mass, rel=1e-4)
    assert f"blade of steel, {7850 * 0.25 * mesh.volume:.3g} kg; handle" in particles.fills[0]


def test_what_is_filled_falls_as_one_and_its_audit_is_clean(tmp_path):
    scene, parts, field = inputs(
        thing((put(can(), 0.02), STEEL, filled(SOUP, 0.7, 2e-4))),
        thing((put(trimesh.creation.box((0.2, 0.2, 0.1)), 0.0, x=0.4), RUBBER)),
    )
    particles = fill(replace(scene, duration=0.1), parts, field)
    trajectory = simulate(replace(scene, duration=0.1), particles, field, SimulateConfig(), tmp_path)
    assert np.isfinite(trajectory.ledger.centre).all()
    mass = trajectory.ledger.mass[0]
    assert mass[0] == pytest.approx(particles.mass_real[0], rel=1e-6)


def test_what_the_treatment_counts_is_warned_of_by_name():
    scene, _, _ = inputs(thing((ball(), STEEL)), thing((ball(), STEEL), name="sheet"))
    said = name_objects(["Object 2 of the scene is only 0.5 cells across.", "All is well."], scene)
    assert said == ("sheet_1 is only 0.5 cells across.", "All is well.")
