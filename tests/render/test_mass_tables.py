"""What objects may weigh, as it stands in reports."""

from dataclasses import replace

from corporeal.core.types import AnsweredMass, MassEvidence, MassPosterior, PrintedFact, WeighedHypothesis
from corporeal.render.mass_tables import mass_table

WAYS = tuple(WeighedHypothesis(f"way {k}", 0.5 - 0.1 * k, 0.2, 1.0 + k) for k in range(3))
PRINTED = (PrintedFact("net weight", 0.453, "Net Wt 1 lb"),)
SAID = MassEvidence(0.4, 0.49, 0.6, "It says so.", PRINTED)
BOX = MassPosterior("box_0", 0.5, 0.4, 0.6, 0.7, 0.3, 1.2, WAYS, SAID, "Far.")
ANSWERS = (
    AnsweredMass(0.4, 0.3, 0.2, 0.8, "box: <card>, hollow", 0.9),
    AnsweredMass(0.8, None, 0.7, 0.9, "box: steel, solid", 0.6),
)


def test_the_leading_two_ways_and_the_estimate_of_a_mass_stand_beside_it():
    told = mass_table([BOX])
    for words in (
        "0.5 (0.4 to 0.6)", "0.7 (0.3 to 1.2)", "0.49 (0.4 to 0.6)", "Net Wt 1 lb", "<b>Far.</b>",
        "way 0: 1 kg, 50% (20%)", "way 1: 2 kg, 40% (20%)",
        "1 other way: 30%",
    ):  # fmt: skip
        assert words in told
    assert "way 2" not in told
    assert mass_table([]) == ""


def test_without_an_estimate_nothing_is_reported_of_what_it_changed():
    told = mass_table([replace(BOX, evidence=None)])
    assert "way 0: 1 kg, 50%<br>" in told


def test_each_of_several_answers_has_a_row_with_its_way_its_mass_and_its_estimate():
    told = mass_table([replace(BOX, answers=ANSWERS), replace(BOX, object="jar_0")])
    _, table = told.split("<h3>What each answer says</h3>")
    first, second, apart = (row.split("</tr>")[0] for row in table.split("<tr>")[2:])
    for words in ("box_0", ">1<", "box: &lt;card&gt;, hollow, 90%", "0.4 (0.2 to 0.8)", "0.3<"):
        assert words in first
    for words in (">2<", "box: steel, solid, 60%", "0.8 (0.7 to 0.9)", "–"):
        assert words in second
    assert ">apart<" in apart
    assert apart.endswith('by a factor of 2.00</td><td class="n">–</td>')
    assert "box_0" not in second
    assert "jar_0" not in table
    assert "What each answer says" not in mass_table([BOX])
