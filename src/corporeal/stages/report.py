"""Report: one self-contained page that shows what was assumed, what happened, and how sure it is.

The page holds its film and figures, so that it can be mailed. Every number carries the measured
range it was chosen from and where that range was read.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from corporeal.geometry.sizes import how_heavy, how_scaled
from corporeal.materials.scale import fraction_of, logarithmic
from corporeal.mpm.audit import how_settled
from corporeal.render.page import figure, inlined, page, safe
from corporeal.types import (
    Film,
    Ground,
    Material,
    MaterialField,
    Particles,
    Parts,
    PartWords,
    Piece,
    Push,
    Scene,
    SceneObject,
    Structure,
    Treatment,
    Wind,
)

UNITS = {
    "young": ("Young's modulus E", "Pa"),
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
}
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
LAWS = {
    "COROTATED": "fixed corotated",
    "NEO_HOOKEAN": "Neo-Hookean",
    "HENCKY": "Hencky",
    "DRUCKER_PRAGER": "Hencky + Drucker–Prager",
    "VON_MISES": "Hencky + von Mises",
}
WHO = {
    "annotation": "your annotation",
    "recording": "a recorded answer",
    "model": "a model",
    "metadata": "the file's own words",
    "unknown": "nobody: a neutral stand-in",
}
CHOSEN = {
    "typical": "nobody: the usual value",
    "fallback": "nobody could say: the usual value",
    "model": "a model",
    "recording": "a recorded answer",
    "annotation": "your annotation",
}


@dataclass(frozen=True)
class Story:
    """Everything the page tells."""

    scene: Scene
    parts: Parts
    field: MaterialField
    particles: Particles
    film: Film
    audit: Mapping[str, Any]
    figures: Mapping[str, Path]
    """Caption → picture, in order."""
    sources: Mapping[str, str]
    """Citation key → where it was read."""
    expectations: tuple[tuple[str, str, str, bool], ...] = ()
    """What should be seen: sentence, measured value and target in words, whether it was."""
    origin: tuple[str, ...] = ()
    """How the scene was found in pictures, in sentences."""


def report(story: Story, path: Path) -> None:
    """Write the page to ``path``."""
    audit = story.audit
    text = page(
        "corporeal.stages",
        "report.html",
        title=safe(story.scene.name),
        summary=_summary(story),
        film=inlined(story.film.path),
        width=story.film.width,
        figures="".join(figure(caption, inlined(file)) for caption, file in story.figures.items()),
        verdict=_verdict(audit),
        expectations=_expectations(story),
        parts="".join(_part_row(story, k) for k in range(len(story.parts.catalogue))),
        grounds="".join(_grounds(story, k) for k in range(len(story.parts.catalogue))),
        audit=_audit_table(audit),
        sources=_sources(story),
        credits=_credits(story.scene),
        settings=_settings(audit),
    )
    path.write_text(text, encoding="utf-8")


# ---------------------------------------------------------------- sentences


def _summary(story: Story) -> str:
    scene, field = story.scene, story.field
    things = ", ".join(safe(o.name.replace("_", " ")) for o in scene.objects)
    unknown = sum(w.answered_by == "unknown" for w in field.words)
    seen = any(w.answered_by in ("model", "recording") for w in field.words)
    sentences = [
        f"{len(scene.objects)} object{'s' * (len(scene.objects) != 1)} ({things}), "
        f"{len(field.materials)} part{'s' * (len(field.materials) != 1)}, "
        f"{scene.duration:g} s simulated with {story.particles.count:,} particles.",
        _looked(story.audit.get("questions", {}))
        if seen
        else "No vision-language model looked at pictures of this scene: materials come from "
        "annotations and from the words in the file.",
    ]
    sentences += map(safe, story.origin)
    sentences += [_forced(o) for o in scene.objects if o.push or o.wind]
    settled = how_settled(story.audit.get("settling"))
    sentences += filter(None, [safe(how_scaled(scene.objects)), safe(settled)])
    if unknown:
        sentences.append(
            f"<b>{unknown} part{'s' * (unknown != 1)} could not be recognised</b> and got a "
            "neutral stand-in material: name it with --annotations."
        )
    return " ".join(sentences)


def _looked(questions: Mapping[str, Any]) -> str:
    """Say who chose the materials from pictures."""
    return f"Materials were chosen from pictures by {safe(_answerers(questions))}."


def _answerers(questions: Mapping[str, Any]) -> str:
    """Name who answered: a model, or who gave the answers that were recorded."""
    models = ", ".join(questions.get("models", ())) or "not said by whom"
    return models if questions.get("calls") else f"recorded answers ({models})"


def _forced(thing: SceneObject) -> str:
    """Say in one sentence what pushes a thing and what blows on it."""
    said = []
    if thing.push is not None:
        size = math.hypot(*thing.push.acceleration)
        said.append(f"is pushed with {size:.3g} m/s² {_window(thing.push)}")
    if thing.wind is not None:
        gusts = f" in gusts of ± {thing.wind.gust:.0%}" if thing.wind.gust else ""
        size = math.hypot(*thing.wind.velocity)
        said.append(f"stands in a wind of {size:.3g} m/s{gusts} {_window(thing.wind)}")
    return f"{safe(thing.name.replace('_', ' '))} {' and '.join(said)}."


def _window(force: Push | Wind) -> str:
    until = f"to {force.end:g} s" if math.isfinite(force.end) else "to the end"
    return f"from {force.start:g} s {until}"


def _verdict(audit: Mapping[str, Any]) -> str:
    warnings = list(audit.get("warnings", ()))
    if not warnings:
        return '<p class="good">The audit found nothing to warn about.</p>'
    items = "".join(f"<li>{safe(w)}</li>" for w in warnings)
    return f'<div class="warn"><b>Read this before you trust the film.</b><ul>{items}</ul></div>'


def _expectations(story: Story) -> str:
    if not story.expectations:
        return ""
    rows = "".join(
        f'<tr><td class="{"yes" if met else "no"}">{"✓" if met else "✗"}</td>'
        f"<td>{safe(sentence)}</td><td>{safe(value)}</td><td>{safe(target)}</td></tr>"
        for sentence, value, target, met in story.expectations
    )
    head = "<tr><th></th><th></th><th>measured</th><th>wanted</th></tr>"
    return f'<h2>What must be seen in this scene</h2><table class="short">{head}{rows}</table>'


# ---------------------------------------------------------------- tables


def _part_row(story: Story, k: int) -> str:
    part, material = story.parts.catalogue[k], story.field.materials[k]
    treatment, words = story.particles.treatments[k], story.field.words[k]
    yields = "–" if material.yield_stress is None else si(material.yield_stress, "Pa")
    names = (story.scene.objects[part.object].name, part.name)
    numbers = (
        si(material.young, "Pa"),
        f"{material.poisson:.3g}",
        f"{material.density:.4g}",
        yields,
        how_heavy(story.particles.mass_real[k], story.scene.objects[part.object].scale),
    )
    cells = (
        _cells(*map(safe, names), f"<b>{safe(material.name)}</b>"),
        _cells(WHO[words.answered_by], LAWS[material.law.name], wrap=True),
        _cells(*numbers),
        _cells(safe(built(story.field.structures[k])), safe(treatment.kind), wrap=True),
        _cells(simulated(treatment), wrap=True),
    )
    return f"<tr>{''.join(cells)}</tr>"


def _cells(*texts: str, wrap: bool = False) -> str:
    return "".join(f"<td>{t}</td>" if wrap else f'<td class="n">{t}</td>' for t in texts)


def built(structure: Structure) -> str:
    """Say how a part is built, and what is in it."""
    if structure.contents is None:
        return structure.kind
    return f"{structure.kind} with {structure.contents.name}"


def simulated(treatment: Treatment) -> str:
    """Say which Young's modulus was simulated, and how far it is from the real one."""
    if treatment.kind == "rigid":
        return "rigid"
    ratio = treatment.young / treatment.young_real
    factor = "as real" if abs(ratio - 1) < 1e-3 else f"{ratio:.2g} × real"
    return f"{si(treatment.young, 'Pa')} ({factor})"


def _grounds(story: Story, k: int) -> str:
    part, field = story.parts.catalogue[k], story.field
    material, words, structure = field.materials[k], field.words[k], field.structures[k]
    pieces = field.pieces[k] if field.pieces else ()
    usual = (material.shell_thickness or 0.0) * story.scene.objects[part.object].scale
    own = _values(material, structure, _walled(story.particles, k, usual))
    tables = "".join(_piece_grounds(p) for p in pieces) or own
    fill = story.particles.fills[k] if k < len(story.particles.fills) else ""
    return (
        f"<details><summary><b>{safe(part.name)}</b> of "
        f"{safe(story.scene.objects[part.object].name)}: {safe(material.name)}</summary>"
        f"<p>{safe(words.reason)} (margin {words.margin:.2f}; {WHO[words.answered_by]})"
        f"{others(words)}<br>{safe(structure.reason)} {safe(fill)}<br>"
        f"{safe(story.particles.treatments[k].why)}</p>{tables}</details>"
    )


def _piece_grounds(piece: Piece) -> str:
    """Tell of one of several things that share a part's mesh why it is as it is."""
    words = piece.words
    return (
        f"<p><b>{safe(words.name)}</b>: {safe(piece.material.name)}, "
        f"{words.volume_share:.0%} of the volume, {words.surface_share:.0%} of the surface. "
        f"{safe(words.reason)} (margin {words.margin:.2f}; {WHO[words.answered_by]})"
        f"{others(words)} {safe(piece.structure.reason)}</p>"
        f"{_values(piece.material, piece.structure, piece.structure.kind != 'solid')}"
    )


def _walled(particles: Particles, k: int, usual: float) -> bool:
    """Whether a wall or a sheet of a part is as thick as its material says it is here [m]."""
    made = particles.walls[k] if particles.walls else ()
    return any(t > 0 and math.isclose(t, usual, rel_tol=1e-6) for t in made)


def _values(material: Material, structure: Structure, walled: bool) -> str:
    """Lay out every value that is used with its range, who chose it, why, and its source."""
    rows = "".join(
        _ground_row(name, ground)
        for name, ground in material.grounds.items()
        if name in UNITS and (walled or name != "shell_thickness")
    )
    inner = structure.contents
    if inner is not None and "density" in inner.grounds:
        rows += _ground_row("density", inner.grounds["density"], f" of the {inner.name} in it")
    return (
        "<table><tr><th>quantity</th><th>value</th><th>place in the range</th>"
        f"<th>chosen by</th><th>why</th><th>source</th></tr>{rows}</table>"
    )


def others(words: PartWords) -> str:
    """Say what else a part may be made of, and what a model told apart in it."""
    maybe = [f"{name} ({p:.0%})" for name, p in words.alternatives]
    pieces = [
        f"{p.name}: {p.material or 'unknown'} ({p.volume_share:.0%} of the volume)"
        for p in words.pieces
    ]
    said = f" It may also be {', '.join(maybe)}." if maybe else ""
    return safe(said + (f" Told apart in it: {'; '.join(pieces)}." if pieces else ""))


def _ground_row(name: str, ground: Ground, of: str = "") -> str:
    label, unit = UNITS[name]
    label += safe(of)
    low, high = ground.range.low, ground.range.high
    place = min(max(fraction_of(ground.range, ground.value), 0), 1)
    bar = f'<div class="bar"><i style="left:{place:.1%}"></i></div>'
    scale = " (log)" if logarithmic(ground.range) else ""
    return (
        f"<tr><td>{label}</td><td>{si(ground.value, unit)}</td>"
        f"<td>{si(low, unit)} {bar} {si(high, unit)}{scale}</td>"
        f"<td>{safe(CHOSEN.get(ground.chosen_by, ground.chosen_by))}</td>"
        f"<td>{safe(ground.reason)}</td><td>{safe(ground.range.source)}</td></tr>"
    )


AUDIT_ROWS = (
    ("momentum_residual", "momentum not accounted for, relative", ".2g"),
    ("mechanical_growth", "energy of motion and strain created, relative", ".2g"),
    ("energy_growth", "the same with booked losses, relative", ".2g"),
    ("max_penetration_dx", "deepest penetration, in grid cells", ".2f"),
    ("max_penetration_m", "deepest penetration [m]", ".2g"),
    ("particles", "particles", ",d"),
    ("steps", "time steps", ",d"),
    ("dt_min", "smallest step [s]", ".2g"),
    ("dt_max", "largest step [s]", ".2g"),
    ("nan_count", "numbers that are not numbers", "d"),
    ("particles_out_of_domain", "particles lost", "d"),
)


def _audit_table(audit: Mapping[str, Any]) -> str:
    rows = [(label, audit.get(key), spec) for key, label, spec in AUDIT_ROWS]
    return "".join(
        f"<tr><td>{label}</td><td>{'–' if value is None else format(value, spec)}</td></tr>"
        for label, value, spec in rows
    )


def _sources(story: Story) -> str:
    pieces = [p for shared in story.field.pieces for p in shared]
    made = [*story.field.structures, *(p.structure for p in pieces)]
    held = [s.contents for s in made if s.contents is not None]
    known = [*story.field.materials, *(p.material for p in pieces), *held]
    used = sorted({g.range.source for m in known for g in m.grounds.values()})
    return "".join(f"<dt>{safe(k)}</dt><dd>{safe(story.sources.get(k, k))}</dd>" for k in used)


def _credits(scene: Scene) -> str:
    credits = dict.fromkeys(o.credit for o in scene.objects if o.credit)
    return "".join(f"<li>{safe(c)}</li>" for c in credits) or "<li>none stated in the files</li>"


def _settings(audit: Mapping[str, Any]) -> str:
    seconds = audit.get("seconds", {})
    spent = ", ".join(f"{stage} {value:.1f} s" for stage, value in seconds.items())
    memory = audit.get("peak_memory_mb")
    peak = "" if memory is None else f" Peak memory {memory:,.0f} MB."
    settings = ", ".join(f"{k} {safe(str(v))}" for k, v in audit.get("settings", {}).items())
    return f"{settings}.<br>Time: {spent}.{peak}{asked(audit.get('questions', {}))}"


def asked(questions: Mapping[str, Any]) -> str:
    """Say what the questions to models took."""
    if not questions:
        return ""
    if not questions["calls"]:
        who = safe(_answerers(questions))
        return f"<br>{questions['questions']} questions answered from the disk, by {who}: no cost."
    cost = questions["dollars"]
    paid = (
        "price not known"
        if cost is None
        else f"about ${cost:.3f} at the list prices of {questions['prices_of']}"
    )
    return (
        f"<br>{questions['questions']} questions to {safe(_answerers(questions))}: "
        f"{questions['calls']} calls, {questions['input_tokens']:,} tokens in, "
        f"{questions['output_tokens']:,} out, {questions['seconds']:.0f} s of waiting, {paid}."
    )


# ---------------------------------------------------------------- small things


def si(value: float, unit: str) -> str:
    """Write a number with three digits, a prefix where the unit takes one, angles in degrees."""
    if unit == "rad":
        return f"{math.degrees(value):.3g}°"
    if unit == "kg/m³":
        return f"{value:.4g} {unit}"
    if unit not in ("Pa", "m") or value == 0:
        return f"{value:.3g} {unit}".strip()
    for size, prefix in PREFIXES:
        if abs(value) >= size * 0.9995:
            return f"{value / size:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"
