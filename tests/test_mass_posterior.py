"""Masses over all the ways objects may be: medians, what evidence does, and what it never does."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal import materials
from corporeal.core.types import (
    Finish,
    Hypothesis,
    MassEvidence,
    MassPosterior,
    ObjectDescription,
    PartDescription,
    PrintedFact,
    ScanThickening,
    Scene,
    SceneObject,
    Surface,
    apply_hypothesis,
)
from corporeal.discretization.part_model import VolumeLeeway, swelling_log_sigma
from corporeal.materials.material_candidates import value_at_fraction
from corporeal.pipeline.mass_posterior import (
    MODELLED_SHAPE_VOLUME_LOG_STD,
    MassSampler,
    sample_hypotheses,
    sample_masses,
    total_mass_posterior,
    volume_log_std,
    weighted_quantiles,
)
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import GroundConfig, ground
from corporeal.pipeline.stages.segment import segment
from corporeal.vlm.mass_evidence import PACKAGING_MASS_RATIO, mass_contradiction, mass_likelihood

RADIUS = 0.05
VOLUME = 4 / 3 * np.pi * RADIUS**3
MESH = trimesh.creation.icosphere(3, RADIUS)


def one_thing(mesh, name, extent):
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    return Scene(
        "one", "", (SceneObject(f"{name}_0", name, extent),),
        (Surface(name, 0, 0, points, triangles),), (Finish("plain"),),
    )  # fmt: skip


def spread(mesh, answered_by):
    """Return how wide the masses of a ball of gold are: ln of the 95 % over the 5 % point."""
    scene = one_thing(mesh, "gold ball", 0.1)
    inventory = describe(scene)
    (thing,) = inventory.objects
    words = replace(thing.parts[0], material="gold", structure="solid", answered_by=answered_by)
    said = replace(inventory, objects=(replace(thing, parts=(words,)),))
    scale = MassSampler(scene, segment(scene, said), GroundConfig(), 0)
    low, high = np.percentile([scale.draw(said, k).masses[0] for k in range(120)], (5, 95))
    return float(np.log(high / low))


@pytest.mark.slow
def test_a_modelled_shape_is_in_doubt_only_where_a_name_alone_tells_what_it_is():
    """Gold's density is known to .1 %; what was drawn of it is not."""
    modelled = trimesh.creation.icosphere(2, RADIUS)
    assert spread(modelled, "metadata") == pytest.approx(2 * 1.645 * MODELLED_SHAPE_VOLUME_LOG_STD, rel=0.25)
    assert spread(modelled, "model") < 0.02
    scanned = trimesh.creation.icosphere(4, RADIUS)  # its edges leave it open, its form does not
    assert spread(scanned, "metadata") == pytest.approx(spread(scanned, "model"), rel=0.1)


def a_ball(*ways, evidence=None, **said):
    """A ball of 10 cm that may be several things: (scale, inventory)."""
    scene = one_thing(MESH, "ball", 0.1)
    inventory = describe(scene)
    (part,) = inventory.objects[0].parts
    words = replace(apply_hypothesis(PartDescription(part.name, None), ways[0]), hypotheses=ways, **said)
    words = replace(words, answered_by="model", built_by="model")
    objects = (ObjectDescription("ball_0", "ball", (words,), evidence=evidence),)
    inventory = replace(inventory, objects=objects)
    return MassSampler(scene, segment(scene, inventory), GroundConfig(), 0), inventory


def weigh(*ways, evidence=None, samples=300, **said):
    return sample_masses(*a_ball(*ways, evidence=evidence, **said), samples)


STEEL = Hypothesis("steel", "solid", 0.6)
SHELL = Hypothesis("steel", "hollow", 0.4)
SOLID_MASS = materials.find_material("steel").ranges["density"].typical * MESH.volume


def judged(mass, factor=1.2):
    return MassEvidence(mass / factor, mass, mass * factor, "It looks so.")


@pytest.mark.slow
def test_the_prediction_is_the_median_of_the_mixture_and_its_interval_spans_the_ways():
    (m,) = weigh(STEEL, SHELL).mixtures
    solid, hollow = m.hypotheses
    assert (solid.probability, hollow.probability) == (solid.prior, hollow.prior)
    assert solid.prior == pytest.approx(0.6, abs=0.08)
    assert solid.mass == pytest.approx(SOLID_MASS, rel=0.01)
    assert hollow.mass < 0.3 * solid.mass
    assert m.mass == pytest.approx(SOLID_MASS, rel=0.02)
    assert m.low < hollow.mass < m.mass <= m.high
    (other,) = weigh(replace(STEEL, probability=0.3), replace(SHELL, probability=0.7)).mixtures
    assert other.mass < 0.3 * solid.mass


@pytest.mark.slow
def test_evidence_chooses_among_ways_and_every_value_stays_inside_its_range():
    (without,) = weigh(STEEL, SHELL).mixtures
    said = judged(without.hypotheses[1].mass)
    believed = weigh(STEEL, SHELL, evidence=said)
    (m,) = believed.mixtures
    assert m.mass_without == pytest.approx(without.mass)
    assert m.hypotheses[0].words.endswith("steel, hollow")
    assert m.hypotheses[0].probability > 0.9 > m.hypotheses[0].prior
    (words,) = believed.inventory.objects[0].parts
    assert words.structure == "hollow"
    wall = words.placements["shell_thickness"]
    assert (wall.chosen_by, 0 <= wall.fraction <= 1) == ("evidence", True)
    # It is weighed as it was chosen: what stands in the field is a draw, not a number set.
    scale, _ = a_ball(STEEL, SHELL)
    field = ground(scale.scene, scale.parts, believed.inventory, GroundConfig())
    r = materials.find_material("steel").ranges["shell_thickness"]
    assert field.structures[0].thickness == pytest.approx(value_at_fraction(r, wall.fraction))
    assert float(scale.of(field)[0]) == pytest.approx(m.mass, rel=0.05)


@pytest.mark.slow
def test_evidence_sets_no_value_and_beyond_three_widths_it_warns_what_would_reconcile():
    far = judged(SOLID_MASS / 100)
    (m,) = weigh(replace(STEEL, probability=1.0), evidence=far).mixtures
    assert m.mass == pytest.approx(m.mass_without, rel=0.01)
    assert "all its hypotheses weigh 4.0" in m.warning or "weighs 4." in m.warning
    assert "1% of its volume material" in m.warning
    assert "0.22 times as large" in m.warning
    (wall,) = weigh(replace(SHELL, probability=1.0), evidence=judged(SOLID_MASS / 1000)).mixtures
    assert "a wall of ball" in wall.warning
    assert "times as thick" in wall.warning
    (near,) = weigh(replace(STEEL, probability=1.0), evidence=judged(SOLID_MASS)).mixtures
    assert near.warning == ""


def test_evidence_that_is_plainly_wrong_moves_nothing_by_a_silent_factor():
    masses = np.array([1.0, 1.1, 0.9])
    for mass in (1e-6, 1e6):
        weights = mass_likelihood(masses, judged(mass))
        assert weights / weights.sum() == pytest.approx(np.full(3, 1 / 3), rel=1e-6)


def test_a_printed_net_weight_counts_once_however_often_it_is_printed():
    ounce = 0.028349523125
    facts = (PrintedFact("net weight", 0.305, "305 g"), PrintedFact("net weight", 10.75 * ounce, "10 3/4 OZ"))
    masses = np.geomspace(0.1, 1.0, 200)
    wide = MassEvidence(0.01, 0.3, 9.0, "Who knows.")
    once = mass_likelihood(masses, replace(wide, printed=facts[:1]))
    twice = mass_likelihood(masses, replace(wide, printed=facts))
    assert masses[np.argmax(once)] == pytest.approx(PACKAGING_MASS_RATIO * 0.305, rel=0.02)
    assert twice == pytest.approx(once, rel=0.05)
    volume = replace(wide, printed=(PrintedFact("volume", 5e-4, "500 ml"),))
    assert mass_likelihood(masses, volume) == pytest.approx(mass_likelihood(masses, wide))


def test_without_evidence_and_doubt_the_placed_values_stand():
    believed = weigh(replace(STEEL, probability=1.0))
    assert believed.mixtures[0].mass == pytest.approx(SOLID_MASS, rel=1e-6)
    assert believed.mixtures[0].low < SOLID_MASS < believed.mixtures[0].high


def test_what_is_packed_weighs_its_share_of_matter():
    packed = Hypothesis("steel", "packed", 1.0, solidity=0.4)
    (m,) = weigh(packed).mixtures
    assert m.mass == pytest.approx(0.4 * SOLID_MASS, rel=1e-6)
    assert m.low < 0.33 * SOLID_MASS
    assert m.high > 0.47 * SOLID_MASS


def test_a_cover_with_a_core_weighs_both():
    """The fault of the first round: a share of 0 for what lies inside erased a shell there."""
    scale, inventory = a_ball(STEEL)
    cover = PartDescription("cover", "leather", "sheet", volume_share=1.0, surface_share=1.0)
    shell = PartDescription("shell", "steel", "hollow", volume_share=0.9, surface_share=0.9, inside="cover")
    whole = replace(inventory.objects[0].parts[0], pieces=(replace(cover, inner_share=0.9), shell))
    inventory = replace(inventory, objects=(replace(inventory.objects[0], parts=(replace(whole, hypotheses=()),)),))
    both = scale.mass(inventory)
    area, leather, steel = (MESH.area, materials.find_material("leather"), materials.find_material("steel"))
    skin = leather.ranges["density"].typical * area * leather.ranges["shell_thickness"].typical
    wall = steel.ranges["density"].typical * 0.9 * area * steel.ranges["shell_thickness"].typical
    assert both == pytest.approx(skin + wall, rel=0.05)


def test_a_solid_weighs_less_by_what_lies_inside_it():
    scale, inventory = a_ball(STEEL)
    body = PartDescription("body", "ABS", "solid", volume_share=1.0, surface_share=1.0, inner_share=0.3)
    core = PartDescription("core", "steel", "solid", volume_share=0.3, surface_share=0.4, inside="body")
    whole = replace(inventory.objects[0].parts[0], pieces=(body, core), hypotheses=())
    inventory = replace(inventory, objects=(replace(inventory.objects[0], parts=(whole,)),))
    abs_, steel = (materials.find_material(n).ranges["density"].typical for n in ("ABS", "steel"))
    expected = (0.7 * abs_ + 0.3 * steel) * MESH.volume
    assert scale.mass(inventory) == pytest.approx(expected, rel=1e-6)


def test_a_plate_drawn_with_both_faces_has_one_wall():
    plate = trimesh.creation.cylinder(0.1, 0.006, sections=64)
    points, triangles = np.asarray(plate.vertices), np.asarray(plate.faces, dtype=np.int64)
    scene = Scene(
        "one", "", (SceneObject("plate_0", "plate", 0.2),),
        (Surface("plate", 0, 0, points, triangles),), (Finish("plain"),),
    )  # fmt: skip
    inventory = describe(scene)
    (part,) = inventory.objects[0].parts
    words = PartDescription(part.name, "porcelain", "sheet", thickness=0.004)
    inventory = replace(inventory, objects=(ObjectDescription("plate_0", "plate", (words,)),))
    scale = MassSampler(scene, segment(scene, inventory), GroundConfig(), 0)
    density = materials.find_material("porcelain").ranges["density"].typical
    assert scale.mass(inventory) == pytest.approx(density * np.pi * 0.1**2 * 0.004, rel=0.08)


def test_a_thin_scan_leaves_its_volume_open_and_a_model_does_not():
    model, _ = a_ball(STEEL)
    assert model.doubts == [0.0]
    blade = trimesh.creation.icosphere(4, 0.05).apply_scale((1, 1, 0.1))
    points, triangles = np.asarray(blade.vertices), np.asarray(blade.faces, dtype=np.int64)
    scene = Scene(
        "one", "", (SceneObject("blade_0", "blade", 0.1),),
        (Surface("blade", 0, 0, points, triangles),), (Finish("plain"),),
    )  # fmt: skip
    scale = MassSampler(scene, segment(scene, describe(scene)), GroundConfig(), 0)
    (member,) = scale.members
    edges = np.median(blade.edges_unique_length)
    logs = []
    for share in np.linspace(-0.5, 0.5, 21):  # anywhere within half an edge
        moved = blade.copy()
        moved.vertices = blade.vertices + share * edges * blade.vertex_normals
        logs.append(np.log(moved.volume))
    assert volume_log_std(member) == pytest.approx(np.std(logs), rel=0.15)
    words = replace(describe(scene).objects[0].parts[0], material="steel", structure="solid")
    inventory = replace(describe(scene), objects=(ObjectDescription("blade_0", "blade", (words,)),))
    (m,) = sample_masses(scale, inventory, 200).mixtures
    assert m.high / m.low > 1.5


def a_blade(**said):
    """A scanned blade of steel, solid: (scale, inventory)."""
    blade = trimesh.creation.icosphere(4, 0.05).apply_scale((1, 1, 0.1))
    scene = one_thing(blade, "blade", 0.1)
    inventory = describe(scene)
    part = inventory.objects[0].parts[0]
    words = replace(part, **({"material": "steel", "structure": "solid"} | said))
    inventory = replace(inventory, objects=(ObjectDescription("blade_0", "blade", (words,)),))
    return MassSampler(scene, segment(scene, inventory), GroundConfig(), 0), inventory


HALF = ScanThickening(0.4, 0.5, 0.625, "1 mm, drawn as 2.")


def test_what_a_scan_draws_too_thick_weighs_what_is_real_of_it():
    scale, drawn = a_blade()
    _, halved = a_blade(swelling=HALF)
    assert scale.mass(halved) == pytest.approx(0.5 * scale.mass(drawn), rel=1e-12)
    (m,) = sample_masses(scale, halved, 200).mixtures
    assert m.mass == pytest.approx(scale.mass(halved), rel=0.05), "nothing is taken off twice"


def test_doubt_about_a_share_adds_to_the_meshs_own_in_quadrature():
    scale, halved = a_blade(swelling=HALF)
    (own,) = scale.doubts
    spread = np.std(np.log([scale.draw(halved, k).masses[0] for k in range(300)]))
    steel = materials.find_material("steel").ranges["density"]
    assert swelling_log_sigma(HALF) == 0.2, "no eye is surer than that"
    assert steel.high / steel.low < 1.06
    assert spread == pytest.approx(np.hypot(own, 0.2), rel=0.1)


def test_a_share_moves_no_wall_of_stated_thickness():
    scale, sheet = a_blade(structure="sheet", thickness=0.001)
    _, said = a_blade(structure="sheet", thickness=0.001, swelling=HALF)
    assert scale.mass(said) == scale.mass(sheet)
    one, other = (scale.draw(words, 3).masses for words in (sheet, said))
    assert one == other


def scanned_bowl():
    """A deep bowl as a scanner draws it, both faces of its wall: (scale, inventory)."""
    wall, outside = 0.01, [(0, 0), (0.06, 0), (0.06, 0.15)]
    profile = [*outside, (0.06 - wall, 0.15), (0.06 - wall, wall), (0, wall)]
    bowl = trimesh.creation.revolve(profile, sections=60)
    bowl = trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(bowl.vertices, bowl.faces, 0.02))
    bowl.merge_vertices()
    scene = one_thing(bowl, "bowl", 0.16)
    inventory = describe(scene)
    words = PartDescription(inventory.objects[0].parts[0].name, "ceramic", "sheet")
    words = replace(words, built_by="model", answered_by="model")
    inventory = replace(inventory, objects=(ObjectDescription("bowl_0", "bowl", (words,)),))
    return MassSampler(scene, segment(scene, inventory), GroundConfig(), 0), inventory


def test_a_wall_as_thick_as_a_scan_draws_it_is_as_open_as_the_scan():
    """Noise moves both faces outwards: a drawn wall swells, one of a known thickness does not."""
    scale, inventory = scanned_bowl()
    field = ground(scale.scene, scale.parts, inventory, scale.grounding)
    assert scale.of(field, [VolumeLeeway(1.2)])[0] == pytest.approx(1.2 * scale.of(field)[0], rel=1e-6)
    (words,) = inventory.objects[0].parts
    stated = replace(words, thickness=0.004)
    inventory = replace(inventory, objects=(ObjectDescription("bowl_0", "bowl", (stated,)),))
    field = ground(scale.scene, scale.parts, inventory, scale.grounding)
    assert scale.of(field, [VolumeLeeway(1.2)])[0] == pytest.approx(scale.of(field)[0], rel=1e-6)


@pytest.mark.slow
def test_an_ensemble_draws_ways_as_often_as_the_evidence_leaves_them_likely():
    _, inventory = a_ball(STEEL, SHELL)
    light = weigh(STEEL, SHELL).mixtures[0].hypotheses[1].mass
    believed = weigh(STEEL, SHELL, evidence=judged(light))

    def hollow(mixtures):
        made = [sample_hypotheses(inventory, mixtures, np.random.default_rng(k), "default") for k in range(300)]
        return np.mean([m.objects[0].parts[0].structure == "hollow" for m in made])

    assert hollow(()) == pytest.approx(0.4, abs=0.08)
    assert hollow(believed.mixtures) == pytest.approx(believed.mixtures[0].hypotheses[0].probability, abs=0.04)


def test_weighted_quantiles():
    values = np.array([3.0, 1.0, 2.0])
    assert weighted_quantiles(values, np.array([0.0, 0.0, 1.0]))[1] == pytest.approx(2.0)
    even = np.full(1001, 1 / 1001)
    low, middle, high = weighted_quantiles(np.linspace(0, 1, 1001), even)
    assert (low, middle, high) == (
        pytest.approx(0.05, abs=0.001), pytest.approx(0.5), pytest.approx(0.95, abs=0.001)
    )  # fmt: skip


def test_no_evidence_contradicts_nothing():
    _, inventory = a_ball(STEEL)
    assert mass_contradiction(inventory.objects[0], np.array([1.0, 2.0])) == ""


def test_objects_of_one_file_weigh_their_sum_and_keep_statements_of_all():
    said = MassEvidence(1.0, 2.0, 3.0, "A guess.")
    one = MassPosterior("a", 2.0, 1.0, 4.0, 2.5, 1.5, 5.0, evidence=said, warning="Far.")
    assert total_mass_posterior([one]) is one
    both = total_mass_posterior([one, replace(one, object="b", mass=1.0, warning="")])
    assert (both.mass, both.low, both.high) == (3.0, 2.0, 8.0)
    assert (both.mass_without, both.low_without, both.high_without) == (5.0, 3.0, 10.0)
    assert both.evidence is not None
    assert both.evidence.likely == 4.0
    assert both.warning == "Far."
    assert total_mass_posterior([one, replace(one, evidence=None)]).evidence is None
