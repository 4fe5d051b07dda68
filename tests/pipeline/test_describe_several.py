"""A scene described by several answers: chains of questions, recordings, pages, and failures."""

import json

import pytest

from corporeal.core.errors import UserError
from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.stages.describe import describe
from corporeal.vlm.recordings import ANSWER_NUMBER_KEY, RecordingClient
from sample_scenes import plain, scene
from scripted_model import Oracle, everywhere, offered, part, weighs, whole

VASE = ("vase_0", [("mesh", plain(), {})])
GLASS = {"parts": [part("vase", "glass", "sheet")]}
CERAMIC = {"parts": [part("vase", "ceramic", "sheet")]}


def asked(monkeypatch, oracle, record=None, **config):
    """Describe a vase with an oracle in the model's place."""
    settings = DescribeConfig(vlm="oracle:1", view_size=32, record=record, **config)

    def connected(spec, record):
        return RecordingClient(oracle, record) if record else oracle

    with monkeypatch.context() as patched:
        patched.setattr("corporeal.pipeline.stages.describe.connect_vlm", connected)
        return describe(scene(VASE), settings)


def replay(folder, answers):
    config = DescribeConfig(vlm=f"replay:{folder}", view_size=32, answers=answers)
    return describe(scene(VASE), config)


def by_turn(**answers):
    """Answer by which of several answers is wanted."""
    return {task: (lambda q, own=own: own[q.turn.number - 1]) for task, own in answers.items()}


def test_parts_are_asked_for_once_and_all_else_for_each_answer_in_its_own_chain(monkeypatch):
    oracle = Oracle(**by_turn(materials=[GLASS, CERAMIC, GLASS]))
    inventory = asked(monkeypatch, oracle, answers=3)
    tasks = [(t["task"], t.get("answer_number")) for t in inventory.transcript]
    chains = [(t, k) for k in (1, 2, 3) for t in ("materials", "placement", "mass")]
    assert tasks == [("parts", None), *chains, ("extents", None)]
    placements = {q.turn.number: list(offered(q)) for q in oracle.asked if q.task == "placement"}
    assert placements == {1: ["vase"], 2: ["vase"], 3: ["vase"]}
    texts = {q.turn.number: q.text for q in oracle.asked if q.task == "placement"}
    assert "vase: ceramic" in texts[2]
    assert "vase: glass" in texts[1]
    (thing,) = inventory.objects
    ways = {w.material: w.probability for w in thing.parts[0].hypotheses}
    assert ways == pytest.approx({"glass": 2 * 0.7 / 3, "ceramic": 0.7 / 3})
    assert [a.parts[0].material for a in thing.answers] == ["glass", "ceramic", "glass"]
    assert inventory.usage.questions == 11


def test_one_answer_is_recorded_as_ever_and_is_the_first_of_several(monkeypatch, tmp_path):
    one, three = tmp_path / "one", tmp_path / "three"
    masses = [weighs(0.5, k, 9.0) for k in (1.0, 2.0, 3.0)]
    alone = asked(monkeypatch, Oracle(materials=GLASS, mass=masses[0]), one)
    several = Oracle(**by_turn(materials=[GLASS, CERAMIC, CERAMIC], mass=masses))
    described = asked(monkeypatch, several, three, answers=3)
    for file in one.iterdir():
        assert (three / file.name).read_bytes() == file.read_bytes()
        assert ANSWER_NUMBER_KEY not in json.loads(file.read_text())
    assert len(list(three.iterdir())) == len(list(one.iterdir())) + 6
    assert [o.answers for o in alone.objects] == [()]
    assert words_of(replay(three, 3)) == words_of(described)
    assert words_of(replay(three, 1)) == words_of(alone)
    with pytest.raises(UserError, match=r"is answer 2 to 'materials'.*--answers"):
        replay(one, 2)


def words_of(inventory):
    """All that was said of the vase, whoever said it."""
    (thing,) = inventory.objects
    accounts = [a.parts for a in thing.answers] or [thing.parts]
    return [
        [(w.material, w.probability, {n: p.fraction for n, p in w.placements.items()})]
        for parts in [thing.parts, *accounts]
        for w in parts[0].hypotheses
    ], thing.evidence.likely


@pytest.mark.parametrize(
    "broken",
    [
        by_turn(materials=[GLASS, None, GLASS]),
        {"materials": GLASS} | by_turn(placement=[everywhere(0.5), None, everywhere(0.5)]),
    ],
)
def test_one_broken_answer_of_three_is_left_out_and_that_is_reported(monkeypatch, broken):
    def called(own):
        return lambda q: said(q) if callable(said := own(q) if callable(own) else own) else said

    oracle = Oracle(**{task: called(own) for task, own in broken.items()})
    inventory = asked(monkeypatch, oracle, answers=3)
    (thing,) = inventory.objects
    assert [a.parts[0].material for a in thing.answers] == ["glass", "glass"]
    told = " ".join(inventory.warnings)
    assert "got no usable answer 2 of 3 (the oracle is silent)" in told
    assert "2 of 3 answers count" in told
    places = {p.chosen_by for p in thing.parts[0].placements.values()}
    assert places == {"model"}


def test_where_no_answer_is_whole_the_file_has_the_word_as_with_one(monkeypatch):
    inventory = asked(monkeypatch, Oracle(materials=None), answers=2)
    (thing,) = inventory.objects
    assert thing.answers == ()
    assert "the first answer counts" in " ".join(inventory.warnings)
    alone = asked(monkeypatch, Oracle(materials=None))
    assert [p.material for p in thing.parts] == [p.material for p in alone.objects[0].parts]


def test_a_judged_mass_that_one_answer_lacks_is_left_to_the_others(monkeypatch):
    oracle = Oracle(materials=GLASS, **by_turn(mass=[weighs(1, 2, 4), None]))
    (thing,) = asked(monkeypatch, oracle, answers=2).objects
    assert len(thing.answers) == 2
    assert thing.evidence.likely == pytest.approx(2.0)


def test_a_second_answer_by_hand_is_written_beside_a_recorded_first(monkeypatch, tmp_path):
    asked(monkeypatch, Oracle(materials=GLASS, parts=whole("vase")), tmp_path)
    config = DescribeConfig(vlm=f"ask:{tmp_path}", view_size=32, answers=2)
    pages = tmp_path / "questions"

    def waiting():
        with pytest.raises(UserError, match="wait"):
            describe(scene(VASE), config)
        return {p for p in pages.glob("*.json") if p.read_text() == ""}

    first = waiting()
    assert len(first) == 2
    assert all("-answer-2-" in page.name for page in first)
    for page in first:
        said = CERAMIC if "-materials-" in page.name else weighs(1.0, 3.0, 9.0)
        page.write_text(json.dumps(said))
    (placing,) = waiting()
    assert "vase: ceramic" in placing.with_suffix(".md").read_text()
    page = placing.with_suffix(".md").read_text()
    names = [line[2:].split(":")[0] for line in page.splitlines() if line.startswith("- ")]
    values = [{"quantity": n, "fraction": 0.5, "reason": "Middle."} for n in names if n != "vase"]
    placing.write_text(json.dumps({"parts": [{"part": "vase", "values": values}]}))
    (thing,) = describe(scene(VASE), config).objects
    assert [a.parts[0].material for a in thing.answers] == ["glass", "ceramic"]
    assert words_of(replay(tmp_path, 2))[0] == words_of(describe(scene(VASE), config))[0]


@pytest.mark.parametrize("count", [0, 41])
def test_a_number_of_answers_that_cannot_be_is_refused(count):
    with pytest.raises(UserError, match="--answers"):
        describe(scene(VASE), DescribeConfig(answers=count))
