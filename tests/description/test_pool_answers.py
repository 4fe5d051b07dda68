"""Several answers pooled: each counts the same, and how far they lie apart widens what is said."""

from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import pytest
import trimesh

from corporeal.core.types import (
    Finish,
    Hypothesis,
    MassEvidence,
    ObjectAnswer,
    ObjectDescription,
    PartDescription,
    PrintedFact,
    RangePlacement,
    ScanThickening,
    Scene,
    SceneObject,
    Surface,
    apply_hypothesis,
)
from corporeal.description.pool_answers import pool_answers
from corporeal.materials.library_listing import materials_json
from corporeal.pipeline.mass_posterior import MassSampler, sample_hypotheses, sample_masses, weighted_quantiles
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import GroundConfig, ground
from corporeal.pipeline.stages.segment import segment

BALL = trimesh.creation.icosphere(3, 0.05)
THING = ObjectDescription("ball_0", "ball", ())
SOLID = Hypothesis("steel", "solid", 1.0)
HOLLOW = Hypothesis("steel", "hollow", 1.0)
DRAWS = 100


def part(*ways, name="ball", **said):
    """One part that may be several things, as a model describes it."""
    words = apply_hypothesis(PartDescription(name, None), ways[0])
    return replace(
        words, hypotheses=ways, answered_by="model", built_by="model", margin=ways[0].probability,
        **said,
    )  # fmt: skip


def account(*ways, evidence=None):
    return ObjectAnswer((part(*ways),), evidence)


def placed(way, fraction, name="shell_thickness"):
    return replace(way, placements={name: RangePlacement(fraction, "model", f"At {fraction}.")})


def judged(mass, factor=1.2, printed=()):
    return MassEvidence(mass / factor, mass, mass * factor, f"{mass} kg.", tuple(printed))


def weigh(*answers):
    """What a ball of 10 cm may weigh by these answers: (mixture, scale, inventory)."""
    points, triangles = np.asarray(BALL.vertices), np.asarray(BALL.faces, dtype=np.int64)
    scene = Scene(
        "one", "", (SceneObject("ball_0", "ball", 0.1),),
        (Surface("ball", 0, 0, points, triangles),), (Finish("plain"),),
    )  # fmt: skip
    inventory = describe(scene)
    thing = pool_answers(THING, answers) if len(answers) > 1 else replace(
        THING, parts=answers[0].parts, evidence=answers[0].evidence
    )  # fmt: skip
    inventory = replace(inventory, objects=(thing,), transcript=({"task": "materials"},))
    scale = MassSampler(scene, segment(scene, inventory), GroundConfig(), 0)
    (mixture,) = sample_masses(scale, inventory, DRAWS).mixtures
    return mixture, scale, inventory


def test_ways_are_pooled_each_answer_with_the_same_weight():
    one = account(replace(SOLID, probability=0.6), replace(HOLLOW, probability=0.4))
    other = account(replace(HOLLOW, probability=0.8), Hypothesis("brass", "solid", 0.2))
    (words,) = pool_answers(THING, [one, other]).parts
    ways = {(w.material, w.structure): w.probability for w in words.hypotheses}
    assert ways == pytest.approx({("steel", "hollow"): 0.6, ("steel", "solid"): 0.3, ("brass", "solid"): 0.1})
    assert (words.structure, words.margin) == ("hollow", pytest.approx(0.6))


def test_a_way_that_leads_in_no_answer_may_lead_in_all_of_them():
    second = replace(HOLLOW, probability=0.45)
    one = account(replace(SOLID, probability=0.55), second)
    other = account(Hypothesis("brass", "solid", 0.55), second)
    (words,) = pool_answers(THING, [one, other]).parts
    assert (words.material, words.structure, words.margin) == ("steel", "hollow", 0.45)
    assert words.answered_by == "model"


def test_where_answers_differ_the_interval_spans_what_each_of_them_says():
    solid, hollow = weigh(account(SOLID))[0], weigh(account(HOLLOW))[0]
    both, _, inventory = weigh(account(SOLID), account(HOLLOW))
    assert hollow.high < solid.low
    assert both.low < hollow.mass < solid.mass < both.high * 1.01
    assert [h.prior for h in both.hypotheses] == pytest.approx([0.5, 0.5])  # in turn, so exactly
    assert [a.mass for a in both.answers] == pytest.approx([solid.mass, hollow.mass], rel=0.1)
    drawn = [sample_hypotheses(inventory, (both,), np.random.default_rng(k), "default").objects[0] for k in range(60)]
    found = [d.parts[0].structure for d in drawn]
    assert 15 < found.count("solid") < 45
    assert all(d.answers == () for d in drawn)


def test_values_of_each_answer_are_its_own_so_that_their_spread_widens_the_interval():
    thin, thick = account(placed(HOLLOW, 0.05)), account(placed(HOLLOW, 0.95))
    one, other = weigh(thin)[0], weigh(thick)[0]
    both, _, inventory = weigh(thin, thick)
    widths = [m.high / m.low for m in (one, other)]
    assert both.high / both.low > 1.5 * max(widths)
    first, second = (a.mass for a in both.answers)
    assert both.low < first < second < both.high
    assert second > 3 * first
    (words,) = inventory.objects[0].parts
    assert words.placements["shell_thickness"].fraction == pytest.approx(0.5)


def test_the_same_answer_three_times_says_what_it_says_once():
    one = account(placed(SOLID, 0.3, "density"), replace(HOLLOW, probability=0.5), evidence=judged(2.0))
    alone, thrice = weigh(one)[0], weigh(one, one, one)[0]
    assert replace(thrice, answers=()) == replace(alone, evidence=thrice.evidence, hypotheses=thrice.hypotheses)
    assert len(thrice.answers) == 3
    evidence = thrice.evidence
    assert (evidence.low, evidence.high) == pytest.approx((2.0 / 1.2, 2.4))


def test_intervals_of_the_pool_hold_the_truth_more_often_than_those_of_one_answer():
    rng = np.random.default_rng(3)
    held = np.zeros(2)
    for _ in range(400):  # answers are off by .3, and say that they are off by .1
        off = rng.normal(0, 0.3, size=3)
        draws = off[:, None] + rng.normal(0, 0.1, size=(3, 100))
        for k, some in enumerate((draws[:1], draws)):
            low, _, high = weighted_quantiles(some.ravel(), np.full(some.size, 1 / some.size))
            held[k] += low < 0 < high
    assert held[0] / 400 < 0.5
    assert held[1] / 400 > 0.65


def test_judged_masses_pool_by_the_moments_of_their_mixture():
    said = [judged(1.0, 1.3), judged(1.0, 1.3), judged(2.0, 1.3)]
    whole = pool_answers(THING, [account(SOLID, evidence=e) for e in said]).evidence
    assert whole.likely == pytest.approx(2 ** (1 / 3))
    own, apart = log(1.3**2) / 3.29, np.std([0, 0, log(2)])
    assert whole.high / whole.likely == pytest.approx(exp(1.645 * sqrt(own**2 + apart**2)))
    assert whole.likely / whole.low == pytest.approx(whole.high / whole.likely)
    assert whole.reason == "1.0 kg."  # of the nearest


def test_print_counts_that_at_least_half_of_the_answers_read():
    net = PrintedFact("net weight", 0.5, "500 g")
    said = [judged(1.0, printed=[net]), judged(1.0, printed=[net]), judged(1.0)]
    accounts = [account(SOLID, evidence=e) for e in said]
    assert pool_answers(THING, accounts).evidence.printed == (net, net)
    assert pool_answers(THING, [*accounts[1:], accounts[2]]).evidence.printed == ()


def test_an_answer_without_a_judgement_leaves_it_to_the_others():
    thing = pool_answers(THING, [account(SOLID), account(SOLID, evidence=judged(3.0))])
    assert thing.evidence.likely == pytest.approx(3.0)
    assert pool_answers(THING, [account(SOLID), account(SOLID)]).evidence is None


def pieces(core, shell, inside="shell", **said):
    own = [
        part(SOLID, name="core", volume_share=core, inside=inside, **said),
        part(HOLLOW, name="shell", volume_share=1.0, inner_share=core if inside else 0.0),
    ]
    own = own if shell else own[::-1]
    return ObjectAnswer((replace(own[0], name="ball", pieces=tuple(own)),))


def test_pieces_are_matched_by_name_and_take_up_answers_of_equal_nesting():
    answers = [pieces(0.4, True), pieces(0.6, False), pieces(0.9, True, inside="")]
    (words,) = pool_answers(THING, answers).parts
    assert [p.name for p in words.pieces] == ["core", "shell"]
    assert words.pieces[0].volume_share == pytest.approx(0.5)
    assert (words.pieces[0].inside, words.pieces[1].inner_share) == ("shell", pytest.approx(0.5))
    assert words.name == "ball"


def test_how_much_of_a_scan_is_real_pools_as_masses_do():
    low, high = (ScanThickening(s / 1.1, s, s * 1.1, f"{s}") for s in (0.5, 0.8))
    answers = [ObjectAnswer((part(SOLID, swelling=s),)) for s in (low, high)]
    (words,) = pool_answers(THING, answers).parts
    assert words.swelling.likely == pytest.approx(sqrt(0.4))
    assert words.swelling.low < 0.5 < 0.8 < words.swelling.high


def test_the_list_of_materials_says_what_each_answer_comes_to():
    answers = (account(SOLID, evidence=judged(4.0)), account(HOLLOW, evidence=judged(2.0)))
    mixture, scale, inventory = weigh(*answers)
    field = ground(scale.scene, scale.parts, inventory, GroundConfig())
    (row,) = materials_json(replace(field, mixtures=(mixture,)), scale.parts)["masses"]
    assert [a["judged"] for a in row["answers"]] == [4.0, 2.0]
    assert [a["words"] for a in row["answers"]] == ["ball: steel, solid", "ball: steel, hollow"]
    assert [a["probability"] for a in row["answers"]] == [1.0, 1.0]
    assert all(a["low"] < a["mass"] < a["high"] for a in row["answers"])
    alone = replace(field, mixtures=(replace(mixture, answers=()),))
    assert "answers" not in materials_json(alone, scale.parts)["masses"][0]
