"""Report: a self-contained HTML page with assumptions, results and their uncertainty.

Video and figures are embedded. Every value is shown with its measured range and source.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.audit_data import (
    AuditFinding,
    EffectKind,
    Expectation,
    FindingEffect,
    PredictedBreakage,
    RunAudit,
)
from corporeal.core.types import (
    Discretization,
    Material,
    MaterialField,
    ModelUsage,
    PartComponent,
    PartDescription,
    Particles,
    Parts,
    Provenance,
    Push,
    Scene,
    SceneObject,
    Structure,
    Video,
    Wind,
)
from corporeal.discretization.object_scaling import describe_mass, describe_scales
from corporeal.materials.material_candidates import fraction_of, is_logarithmic
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.render.html_page import data_url_of_file, escape_html, fill_page, html_figure, table_cells
from corporeal.render.mass_tables import mass_table
from corporeal.render.warning_subjects import parts_named_in
from corporeal.simulation.audit_messages import breakage_message, equilibrium_message
from corporeal.simulation.summary_text import SummarySection, split_advice, summary_sections

VALUE_UNITS = {
    "young_pa": ("Young's modulus E", "Pa"),
    "poisson": ("Poisson's ratio ν", ""),
    "density": ("density ρ", "kg/m³"),
    "yield_stress": ("yield stress σ_y", "Pa"),
    "friction_angle": ("friction angle φ", "rad"),
    "cohesion": ("cohesion c", "Pa"),
    "hardening": ("hardening modulus H", "Pa"),
    "friction": ("surface friction μ", ""),
    "restitution": ("restitution e", ""),
    "loss": ("loss factor η", ""),
    "shell_thickness": ("wall thickness", "m"),
    "strength_local": ("local strength", "Pa"),
    "viscosity": ("viscosity η", "Pa s"),
    "consistency": ("consistency K_c", "Pa sⁿ"),
    "flow_index": ("flow index n", ""),
    "yield_shear": ("yield shear stress τ_y", "Pa"),
}
SI_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
SOURCE_WORDS = {
    "annotation": "your annotation",
    "recording": "a recorded answer",
    "model": "a model",
    "metadata": "metadata of the file",
    "unknown": "unknown: neutral material",
}
CHOICE_WORDS = {
    "typical": "typical value",
    "fallback": "typical value: no answer that could be used",
    "model": "a model",
    "recording": "a recorded answer",
    "annotation": "your annotation",
    "evidence": "a draw, to fit the estimate of its mass",
    "field": "another method",
    "borrowed": "ours; the other method gives none",
}
EFFECT_NAMES: dict[EffectKind, tuple[str, str]] = {
    "deformation": ("largest deformation", "m"),
    "static_sag": ("compression by its load", "m"),
    "contact_time": ("duration of an impact", "s"),
    "contact_width": ("width of contact", "m"),
    "rebound": ("rebound over height of fall", ""),
    "depth_below_support": ("depth below where it can stand", "m"),
    "penetration": ("depth in what it touches", "m"),
    "separated_share": ("separated from its object", "%"),
    "unaccounted_energy": ("energy unaccounted for", "%"),
}
"""Kind of effect → name and unit."""
LONG_REASON_CHARACTERS = 60
"""Minimum length of a reason that is printed once, not at every value [characters]."""


@dataclass(frozen=True)
class ReportContent:
    """Everything that the page shows."""

    scene: Scene
    parts: Parts
    field: MaterialField
    particles: Particles
    video: Video
    audit: RunAudit
    figures: Mapping[str, Path]
    """Caption → picture, in order."""
    sources: Mapping[str, str]
    """Citation key → where it was read."""
    origin: tuple[str, ...] = ()
    """How the scene was found in pictures, in sentences."""
    view: str = ""
    """The 3D view as HTML (``render.viewer_page``), or why there is none."""


def report(story: ReportContent, path: Path) -> None:
    """Write the page to ``path``."""
    audit = story.audit
    text = fill_page(
        "corporeal.pipeline.stages",
        "report.html",
        title=escape_html(story.scene.name),
        summary=_summary(story),
        view=story.view,
        video=data_url_of_file(story.video.path),
        width=story.video.width,
        caption=_caption(audit.breakage),
        figures="".join(html_figure(caption, data_url_of_file(file)) for caption, file in story.figures.items()),
        verdict=_verdict(story),
        expectations=_expectations(audit.expectations),
        parts="".join(_part_row(story, k) for k in range(len(story.parts.catalogue))),
        masses=mass_table(story.field.mixtures),
        grounds="".join(_grounds(story, k) for k in range(len(story.parts.catalogue))),
        audit=_audit_table(audit),
        sources=_sources(story),
        credits=_credits(story.scene),
        settings=_settings(audit),
    )
    path.write_text(text, encoding="utf-8")


def _summary(story: ReportContent) -> str:
    """Summarize the simulation in a line or two, and list warnings by severity."""
    lists = "".join(_section(k, s, story) for k, s in summary_sections(story.audit).items() if s)
    return (
        f'<p class="lead">{_lead(story)}</p>'
        + (f'<div class="said" id="said">{lists}</div>' if lists else "")
        + _origin_list(story)
    )


def _lead(story: ReportContent) -> str:
    scene, field = story.scene, story.field
    objects = ", ".join(escape_html(o.name.replace("_", " ")) for o in scene.objects)
    seen = any(w.answered_by in ("model", "recording") for w in field.words)
    counted = (
        f"{len(scene.objects)} object{'s' * (len(scene.objects) != 1)} ({objects}), "
        f"{len(field.materials)} part{'s' * (len(field.materials) != 1)}, "
        f"{scene.duration:g} s simulated with {story.particles.count:,} particles."
    )
    if not seen:
        return (
            f"{counted} No vision-language model was asked: materials come from annotations and "
            "from metadata of the file."
        )
    answers = max((len(m.answers) for m in field.mixtures), default=0)
    return f"{counted} {_answer_source_words(story.audit.questions, answers)}"


def _section(section: SummarySection, sentences: Sequence[str], story: ReportContent) -> str:
    """List the sentences of a section: problem, reason, advice, part."""
    rows = "".join(f"<li>{_item(sentence, story)}</li>" for sentence in sentences)
    return f"<h3>{escape_html(section.head)}</h3><ul>{rows}</ul>"


def _item(sentence: str, story: ReportContent) -> str:
    first, rest = split_advice(sentence)
    following = f" <span>{escape_html(rest)}</span>" if rest else ""
    return f"{escape_html(first)}{following}{_subject(sentence, story)}"


def _origin_list(story: ReportContent) -> str:
    """List the origin of the scene."""
    scene = story.scene
    forced = [_forced(o) for o in scene.objects if o.push or o.wind or o.path]
    settled = equilibrium_message(story.audit.settling)
    statements = [
        *map(escape_html, story.origin),
        *forced,
        *map(escape_html, filter(None, [describe_scales(scene.objects), settled])),
    ]
    rows = "".join(f"<li>{sentence}</li>" for sentence in statements)
    return f"<details><summary>How it came about</summary><ul>{rows}</ul></details>" * bool(statements)


def _answer_source_words(questions: ModelUsage, answers: int) -> str:
    """Return who recognized the materials in pictures, and how many answers were sampled."""
    times = f", asked for {answers} answers each" if answers else ""
    return f"Materials were recognised in pictures by {escape_html(_answerers(questions))}{times}."


def _answerers(questions: ModelUsage) -> str:
    """Name who answered: a model, or who gave the answers that were recorded."""
    models = ", ".join(questions.models) or "source not recorded"
    return models if questions.calls else f"recorded answers ({models})"


def _forced(obj: SceneObject) -> str:
    """Describe the forces on an object in one sentence."""
    forces = []
    if obj.path is not None:
        rows = len(obj.path.time)
        forces.append(f"follows a prescribed path of {rows} rows, whatever it meets")
    if obj.push is not None:
        size = math.hypot(*obj.push.acceleration)
        forces.append(f"is accelerated by a push of {size:.3g} m/s² {_window(obj.push)}")
    if obj.wind is not None:
        gusts = f" with gusts of ± {obj.wind.gust:.0%}" if obj.wind.gust else ""
        size = math.hypot(*obj.wind.velocity)
        forces.append(f"is exposed to wind of {size:.3g} m/s{gusts} {_window(obj.wind)}")
    return f"{escape_html(obj.name.replace('_', ' '))} {' and '.join(forces)}."


def _window(force: Push | Wind) -> str:
    until = f"until {force.end:g} s" if math.isfinite(force.end) else "until the end"
    return f"from {force.start:g} s {until}"


def _caption(found: Sequence[PredictedBreakage]) -> str:
    """Caption of the video: what it shows whole although it may break."""
    doubted = [b for b in found if b.word != "holds"]
    return "".join(f"<p>{escape_html(breakage_message(b))}</p>" for b in doubted)


def _impact_words(story: ReportContent, k: int) -> str:
    """Describe predicted breakage of a brittle part; "" of all others."""
    owner = story.scene.objects[story.parts.catalogue[k].object].name
    mine = (owner, story.field.words[k].name)
    broken = [b for b in story.audit.breakage if (b.object, b.part) == mine]
    return "".join(f"<br>{escape_html(breakage_message(b))}" for b in broken)


def _verdict(story: ReportContent) -> str:
    """Say whether the result can be trusted, and which parts do not move by their measured values."""
    grave = [f for f in story.audit.findings if f.severity == "grave"]
    if grave:
        items = "".join(f"<li>{_item(f.sentence, story)}</li>" for f in grave)
        said = f'<div class="grave"><b>Contradicts the measured values</b><ul>{items}</ul></div>'
    elif not story.audit.warnings:
        said = '<p class="good">The audit found no violations.</p>'
    else:
        said = ""
    if story.audit.warnings:
        said += '<p>What limits this result stands at the <a href="#said">top of the page</a>.</p>'
    return said + _findings_table(story.audit.findings)


def _findings_table(findings: Sequence[AuditFinding]) -> str:
    """Lay out what is simulated with other values than measured, and what comes of it beside what should."""
    if not findings:
        return ""
    heads = (
        "",
        "object",
        "part",
        "E",
        "E t of its wall",
        "cells across",
        "effect",
        "in this run",
        "as measured",
    )
    head = "".join(f"<th>{name}</th>" for name in heads)
    rows = "".join(_finding_rows(f) for f in findings)
    return (
        '<p class="lead">Parts that are simulated with other values than the measured ones, and outcomes that do not '
        "follow from those: simulated over measured stiffness, and the most that measured values give.</p>"
        f'<div class="wide"><table id="findings"><tr>{head}</tr>{rows}</table></div>'
    )


def _finding_rows(found: AuditFinding) -> str:
    """One row per effect; the first names the part and its ratios."""
    ratios = (found.stiffness_ratio, found.in_plane_ratio, found.cells_across)
    numbers = ["–" if r is None else f"{r:.2g}" for r in ratios]
    told = table_cells(
        found.severity, escape_html(found.object or ""), escape_html(found.part or ""), *numbers, wrap=True
    )
    effects = [_effect_cells(e) for e in found.effects] or [table_cells("–", "–", "–")]
    rest = "".join(f"<tr>{table_cells(*[''] * 6)}{cells}</tr>" for cells in effects[1:])
    return f"<tr>{told}{effects[0]}</tr>{rest}"


def _effect_cells(effect: FindingEffect) -> str:
    name, unit = EFFECT_NAMES[effect.kind]
    values = [f"{100 * x:.3g} %" if unit == "%" else si_text(x, unit) for x in (effect.simulated, effect.expected)]
    return table_cells(f"<b>{name}</b>" if effect.grave else name, *values, wrap=True)


def _subject(sentence: str, story: ReportContent) -> str:
    """Link a sentence to the parts that it names."""
    named = parts_named_in(sentence, story.scene, story.parts)
    links = [f'<a href="#part-{k}">{escape_html(story.parts.catalogue[k].name)}</a>' for k in named]
    return f" ({', '.join(links)})" if links else ""


def _expectations(expectations: Sequence[Expectation]) -> str:
    if not expectations:
        return ""
    rows = "".join(
        f'<tr><td class="{"yes" if e.met else "no"}">{"✓" if e.met else "✗"}</td>'
        f"<td>{escape_html(e.sentence)}</td><td>{escape_html(e.value)}</td><td>{escape_html(e.target)}</td></tr>"
        for e in expectations
    )
    head = "<tr><th></th><th></th><th>measured</th><th>expected</th></tr>"
    return f'<h2>Expected outcomes of this scene</h2><table class="short">{head}{rows}</table>'


def _part_row(story: ReportContent, k: int) -> str:
    part, material = story.parts.catalogue[k], story.field.materials[k]
    treatment, words = story.particles.treatments[k], story.field.words[k]
    yields = "–" if material.yield_stress is None else si_text(material.yield_stress, "Pa")
    names = (story.scene.objects[part.object].name, part.name)
    liquid = CONSTITUTIVE_LAWS[material.law].liquid
    numbers = (
        "–" if liquid else si_text(material.young_pa, "Pa"),
        "–" if liquid else f"{material.poisson:.3g}",
        f"{material.density:.4g}",
        yields,
        describe_mass(story.particles.mass_real[k], story.scene.objects[part.object].scale),
    )
    row = (
        table_cells(*map(escape_html, names), wrap=True),
        table_cells(f"<b>{escape_html(material.name)}</b>"),
        table_cells(SOURCE_WORDS[words.answered_by], CONSTITUTIVE_LAWS[material.law].full_name, wrap=True),
        table_cells(*numbers),
        table_cells(escape_html(structure_words(story.field.structures[k])), escape_html(treatment.kind), wrap=True),
        table_cells(stiffness_words(treatment, liquid=liquid), wrap=True),
    )
    return f"<tr>{''.join(row)}</tr>"


def structure_words(structure: Structure) -> str:
    """Return how a part is built, and what is in it."""
    if structure.contents is None:
        packed = f"packed, {structure.solidity:.0%} of it material"
        return packed if structure.solidity < 1 else structure.kind
    return f"{structure.kind} with {structure.contents.name}"


def stiffness_words(treatment: Discretization, *, liquid: bool = False) -> str:
    """Return which Young's modulus was simulated, and how far it is from the real one.

    A liquid has none: its pressure follows from its volume and an artificial speed of sound.
    """
    if treatment.kind == "rigid":
        return "rigid"
    if liquid:
        return f"liquid, its sound slowed to {treatment.wave_speed:.2g} m/s"
    ratio = treatment.simulated_young_pa / treatment.young_pa
    factor = "as measured" if abs(ratio - 1) < 1e-3 else f"{ratio:.2g} × measured"
    return f"{si_text(treatment.simulated_young_pa, 'Pa')} ({factor})"


def _grounds(story: ReportContent, k: int) -> str:
    part, field = story.parts.catalogue[k], story.field
    material, words, structure = field.materials[k], field.words[k], field.structures[k]
    pieces = field.pieces[k] if field.pieces else ()
    usual = (material.shell_thickness or 0.0) * story.scene.objects[part.object].scale
    own = _values(material, structure, _wall_at_usual_thickness(story.particles, k, usual))
    tables = "".join(_piece_grounds(p) for p in pieces) or own
    fill = story.particles.fills[k] if k < len(story.particles.fills) else ""
    return (
        f'<details id="part-{k}"><summary><b>{escape_html(part.name)}</b> of '
        f"{escape_html(story.scene.objects[part.object].name)}: {escape_html(material.name)}</summary>"
        f"<p>{escape_html(words.reason)} (margin {words.margin:.2f}; {SOURCE_WORDS[words.answered_by]})"
        f"{alternative_words(words)}<br>{escape_html(structure.reason)} {escape_html(fill)}<br>"
        f"{escape_html(story.particles.treatments[k].reason)}{_impact_words(story, k)}</p>{tables}</details>"
    )


def _piece_grounds(piece: PartComponent) -> str:
    """Describe one of several pieces that share a part's mesh."""
    words = piece.words
    return (
        f"<p><b>{escape_html(words.name)}</b>: {escape_html(piece.material.name)}, "
        f"{words.volume_share:.0%} of the volume, {words.surface_share:.0%} of the surface. "
        f"{escape_html(words.reason)} (margin {words.margin:.2f}; {SOURCE_WORDS[words.answered_by]})"
        f"{alternative_words(words)} {escape_html(piece.structure.reason)}</p>"
        f"{_values(piece.material, piece.structure, piece.structure.kind != 'solid')}"
    )


def _wall_at_usual_thickness(particles: Particles, k: int, usual: float) -> bool:
    """Whether a wall or a sheet of a part is as thick as its material says it is here [m]."""
    made = particles.walls[k] if particles.walls else ()
    return any(t > 0 and math.isclose(t, usual, rel_tol=1e-6) for t in made)


def _values(material: Material, structure: Structure, walled: bool) -> str:
    """Lay out every value that is used with its range, who chose it, why, and its source."""
    shown = [
        (name, ground, "")
        for name, ground in material.grounds.items()
        if name in VALUE_UNITS and (walled or name != "shell_thickness")
    ]
    inner = structure.contents
    if inner is not None and "density" in inner.grounds:
        shown.append(("density", inner.grounds["density"], f" of the {inner.name} in it"))
    shared = _shared_reason([ground.reason for _, ground, _ in shown])
    rows = "".join(_ground_row(name, ground, of, shared) for name, ground, of in shown)
    above = f"<p>Reason where none is stated: {escape_html(shared)}</p>" if shared else ""
    return (
        f"{above}<table><tr><th>quantity</th><th>value</th><th>position in range</th>"
        f"<th>chosen by</th><th>reason</th><th>source of range</th></tr>{rows}</table>"
    )


def _shared_reason(reasons: Sequence[str]) -> str:
    """Return a long reason that several values share; it is printed once, above their table."""
    often, count = Counter(reasons).most_common(1)[0] if reasons else ("", 0)
    return often if count > 1 and len(often) > LONG_REASON_CHARACTERS else ""


def alternative_words(words: PartDescription) -> str:
    """Return alternatives to a part's material, and its components."""
    maybe = [f"{name} ({p:.0%})" for name, p in words.alternatives]
    pieces = [f"{p.name}: {p.material or 'unknown'} ({p.volume_share:.0%} of the volume)" for p in words.pieces]
    rest = f" Alternatives: {', '.join(maybe)}." if maybe else ""
    return escape_html(rest + (f" Components: {'; '.join(pieces)}." if pieces else ""))


def _ground_row(name: str, ground: Provenance, of: str, shared: str) -> str:
    label, unit = VALUE_UNITS[name]
    label += escape_html(of)
    low, high = ground.range.low, ground.range.high
    place = min(max(fraction_of(ground.range, ground.value), 0), 1)
    bar = f'<div class="bar"><i style="left:{place:.1%}"></i></div>'
    scale = " (log)" if is_logarithmic(ground.range) else ""
    return (
        f"<tr><td>{label}</td><td>{si_text(ground.value, unit)}</td>"
        f'<td class="place">{si_text(low, unit)} {bar} {si_text(high, unit)}{scale}</td>'
        f"<td>{escape_html(CHOICE_WORDS.get(ground.chosen_by, ground.chosen_by))}</td>"
        f"<td>{'' if ground.reason == shared else escape_html(ground.reason)}</td>"
        f"<td>{escape_html(ground.range.source)}</td></tr>"
    )


AUDIT_ROWS = (
    ("momentum_residual", "momentum residual, relative", ".2g"),
    ("mechanical_growth", "growth of kinetic and elastic energy, relative", ".2g"),
    ("impact_loss", "energy lost in normal contact, relative", ".2g"),
    ("impact_gain", "energy given by normal contact, relative", ".2g"),
    ("unbooked_loss", "energy lost in transfers and not booked, relative", ".2g"),
    ("energy_growth", "growth including dissipated energy, relative", ".2g"),
    ("max_penetration_dx", "largest penetration [grid cells]", ".2f"),
    ("max_penetration_m", "largest penetration [m]", ".2g"),
    ("particles", "particles", ",d"),
    ("steps", "time steps", ",d"),
    ("dt_min", "smallest step [s]", ".2g"),
    ("dt_max", "largest step [s]", ".2g"),
    ("nan_count", "values that are not finite", "d"),
    ("particles_out_of_domain", "particles outside the domain", "d"),
)


def _audit_table(audit: RunAudit) -> str:
    return "".join(
        f"<tr><td>{label}</td><td>{format(getattr(audit, name), spec)}</td></tr>"
        for name, label, spec in AUDIT_ROWS
        if getattr(audit, name) is not None
    )


def _sources(story: ReportContent) -> str:
    pieces = [p for shared in story.field.pieces for p in shared]
    made = [*story.field.structures, *(p.structure for p in pieces)]
    held = [s.contents for s in made if s.contents is not None]
    known = [*story.field.materials, *(p.material for p in pieces), *held]
    used = sorted({g.range.source for m in known for g in m.grounds.values()})
    return "".join(f"<dt>{escape_html(k)}</dt><dd>{escape_html(story.sources.get(k, k))}</dd>" for k in used)


def _credits(scene: Scene) -> str:
    credits = dict.fromkeys(o.credit for o in scene.objects if o.credit)
    return "".join(f"<li>{escape_html(c)}</li>" for c in credits) or "<li>none stated in the files</li>"


def _settings(audit: RunAudit) -> str:
    spent = ", ".join(f"{verb} {value:.1f} s" for verb, value in audit.seconds.items())
    settings = ", ".join(f"{name} {escape_html(value)}" for name, value in audit.settings.items())
    peak = f"Peak memory {audit.peak_memory_mb:,.0f} MB."
    return f"{settings}.<br>Time: {spent}. {peak}{usage_words(audit.questions)}"


def usage_words(questions: ModelUsage) -> str:
    """Describe the cost of the questions to models."""
    if not questions.questions:
        return ""
    who, number = escape_html(_answerers(questions)), questions.questions
    if not questions.calls:
        return f"<br>{number} questions, answered from the disk by {who}, at no cost."
    cost = questions.dollars
    paid = "price not known" if cost is None else f"about ${cost:.3f} at the list prices of {questions.prices_of}"
    return (
        f"<br>{number} questions to {who}: "
        f"{questions.calls} calls, {questions.input_tokens:,} tokens in, "
        f"{questions.output_tokens:,} out, {questions.seconds:.0f} s waited, {paid}."
    )


def si_text(value: float, unit: str) -> str:
    """Write a number with three digits, a prefix where the unit takes one, angles in degrees."""
    if unit == "rad":
        return f"{math.degrees(value):.3g}°"
    if unit == "kg/m³":
        return f"{value:.4g} {unit}"
    if unit not in ("Pa", "m", "s") or value == 0:
        return f"{value:.3g} {unit}".strip()
    for size, prefix in SI_PREFIXES:
        if abs(value) >= size * 0.9995:
            return f"{value / size:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"
