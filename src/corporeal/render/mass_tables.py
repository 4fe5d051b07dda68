"""HTML tables of mass posteriors: over hypotheses, and by answer."""

from collections.abc import Sequence

from corporeal.core.types import AnsweredMass, MassEvidence, MassPosterior, WeighedHypothesis
from corporeal.render.html_page import escape_html, table_cells

MAX_HYPOTHESES_SHOWN = 2
"""Ways an object may be, of those that were drawn."""
MASSES_CAPTION = (
    "Median and 90 % interval over the ways the objects may be, the measured ranges and what the "
    "meshes leave open, at real size. Estimates of masses made without the library reweight the "
    "ways; they set no value. Where there is one, what is simulated is of the likeliest way, with "
    "values that make it weigh most nearly the median."
)
ANSWERS_CAPTION = (
    "Each answer by itself, before its estimate reweights it; ways are of the parts that are in "
    "doubt. Above, all answers count the same: their ways are mixed, and of their estimates the "
    "geometric mean is taken, as uncertain as they say themselves and as they lie apart."
)


def mass_table(mixtures: Sequence[MassPosterior]) -> str:
    """Lay out what each object may weigh, the two likeliest ways it may be, and the evidence."""
    if not mixtures:
        return ""
    rows = "".join(_mixture_row(m) for m in mixtures)
    return (
        f'<h2>Masses over all ways the objects may be</h2><p class="lead">{MASSES_CAPTION}</p>'
        '<div class="wide"><table><tr><th>object</th><th>mass [kg]</th>'
        "<th>without outside evidence [kg]</th><th>likeliest ways: mass, share (without "
        "estimates)</th><th>estimate of its mass [kg]</th><th>printed on it</th></tr>"
        f"{rows}</table></div>{_answers(mixtures)}"
    )


def _mixture_row(m: MassPosterior) -> str:
    estimated = m.evidence is not None
    ways = [_hypothesis_cell(h, estimated) for h in m.hypotheses[:MAX_HYPOTHESES_SHOWN]]
    left = m.hypotheses[MAX_HYPOTHESES_SHOWN:]
    if left:
        share = sum(h.probability for h in left)
        ways.append(f"{len(left)} other way{'s' * (len(left) > 1)}: {share:.0%}")
    ways += [f"<b>{escape_html(m.warning)}</b>"] if m.warning else []
    printed = "; ".join(dict.fromkeys(f.words for f in m.evidence.printed)) if m.evidence else ""
    row = (
        table_cells(escape_html(m.object), _interval(m.low, m.mass, m.high)),
        table_cells(_interval(m.low_without, m.mass_without, m.high_without)),
        table_cells("<br>".join(ways), wrap=True),
        table_cells(_estimate(m.evidence)),
        table_cells(escape_html(printed) or "–", wrap=True),
    )
    return f"<tr>{''.join(row)}</tr>"


def _hypothesis_cell(h: WeighedHypothesis, estimated: bool) -> str:
    """Return how likely a way is, and what the estimates of mass changed of that."""
    before = f" ({h.prior:.0%})" if estimated else ""
    return f"{escape_html(h.words)}: {h.mass:.3g} kg, {h.probability:.0%}{before}"


def _estimate(evidence: MassEvidence | None) -> str:
    return _interval(evidence.low, evidence.likely, evidence.high) if evidence else "–"


def _interval(low: float, middle: float, high: float) -> str:
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _answers(mixtures: Sequence[MassPosterior]) -> str:
    """Lay out what each of several answers says, and how far they lie apart; "" where one was."""
    several = [m for m in mixtures if m.answers]
    if not several:
        return ""
    rows = "".join(_answer_rows(m) for m in several)
    return (
        f'<h3>What each answer says</h3><p class="lead">{ANSWERS_CAPTION}</p>'
        '<div class="wide"><table><tr><th>object</th><th>answer</th><th>its likeliest way</th>'
        "<th>mass over its ways [kg]</th><th>its estimate of the mass [kg]</th></tr>"
        f"{rows}</table></div>"
    )


def _answer_rows(m: MassPosterior) -> str:
    """Lay out the answers about one object, and by what factor they differ."""
    named = [escape_html(m.object), *[""] * len(m.answers)]
    rows = [table_cells(name, str(k + 1)) for k, name in enumerate(named[:-1])]
    rows = [row + _answered(a) for row, a in zip(rows, m.answers, strict=True)]
    judged = [a.judged for a in m.answers if a.judged]
    apart = (_spread_factor([a.mass for a in m.answers]), _spread_factor(judged))
    rows.append(table_cells("", "apart", "", *apart))
    return "".join(f"<tr>{row}</tr>" for row in rows)


def _answered(answer: AnsweredMass) -> str:
    way = f"{escape_html(answer.words)}, {answer.probability:.0%}"
    mass = _interval(answer.low, answer.mass, answer.high)
    judged = "–" if answer.judged is None else f"{answer.judged:.3g}"
    return table_cells(way, wrap=True) + table_cells(mass, judged)


def _spread_factor(masses: Sequence[float]) -> str:
    """Say by what factor masses differ; of one there is nothing to say."""
    if len(masses) < 2:
        return "–"
    return f"by a factor of {max(masses) / max(min(masses), 1e-300):.2f}"
