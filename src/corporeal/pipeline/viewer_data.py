"""Data of a run for the viewer: motion, parts and audit."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from corporeal import materials
from corporeal.core.audit_data import Outcome, RunAudit
from corporeal.core.types import Reconstruction, Scene, Trajectory
from corporeal.discretization.object_scaling import part_scales
from corporeal.render import colours
from corporeal.render.figures import CategoryPanel, NumericPanel, colour_panels, part_colours
from corporeal.render.recording_format import Recording, SceneBinding, pack_recording, record_frames
from corporeal.render.recording_gaussians import select_gaussians
from corporeal.render.skin_binding import bind_vertices
from corporeal.render.warning_subjects import parts_named_in
from corporeal.simulation.moving_gaussians import fluid_parts, granular_parts
from corporeal.simulation.simulation_result import PreparedScene

RAMP_COLOURS = 17
"""Colours that the page interpolates scales from."""
UNSOFTENED_MODULUS_RATIO = 0.999
"""Above this share of its modulus a part counts as not softened."""
MAX_RECORDING_FPS = 30.0
"""Maximum frame rate of a recording [1/s]."""


def bind_scene(prepared: PreparedScene) -> SceneBinding:
    """Bind the surfaces of a scene to its particles."""
    p = prepared
    skin = bind_vertices(p.scene, p.parts, p.particles, granular_parts(p.field), fluid_parts(p.field))
    return SceneBinding.of(p.scene, p.particles, skin)


def record_trajectory(cast: SceneBinding, trajectory: Trajectory, fps: float = MAX_RECORDING_FPS) -> Recording:
    """Record a trajectory with at most ``fps`` pictures a second, including the first and the last.

    Args:
        cast: From ``bind_scene``.
        trajectory: Frames are read one by one.
        fps: [1/s]
    """
    count = len(trajectory.frames)
    length = float(trajectory.time[-1] - trajectory.time[0]) if count > 1 else 0.0
    wanted = min(count, round(length * fps) + 1)
    numbers = np.unique(np.linspace(0, count - 1, max(wanted, 1)).round().astype(int))
    return record_frames(cast, (trajectory.frames[int(k)] for k in numbers))


def viewer_recording(
    prepared: PreparedScene,
    cast: SceneBinding,
    happened: Outcome | None = None,
    recording: Recording | None = None,
    audit: RunAudit | None = None,
    found: Reconstruction | None = None,
) -> bytes:
    """Return all data that a page needs to play a run.

    Args:
        prepared: The scene.
        cast: From ``bind_scene``.
        happened: Its outcome; None: not simulated.
        recording: From ``record_trajectory``; None: as for ``happened``.
        audit: Warnings and numbers, where the run has been reported on.
        found: Gaussians of the reconstruction, to be shown; None: surfaces only.
    """
    summary = scene_summary(prepared)
    if happened is not None:
        summary["marks"] = contact_times(happened)
    if audit is not None:
        summary["audit"] = audit_summary(audit, prepared)
    splats = None if found is None or not found.gaussians.count else select_gaussians(found, cast)
    return pack_recording(prepared.scene, prepared.parts, cast, recording, summary, splats)


def scene_summary(prepared: PreparedScene) -> dict[str, Any]:
    """Return the static data of a scene: parts, colours, credits."""
    scene, parts, field = prepared.scene, prepared.parts, prepared.field
    credits = dict.fromkeys(o.credit for o in scene.objects if o.credit)
    return {
        "cell": prepared.particles.cell,
        "particles": prepared.particles.count,
        "parts": part_cards(prepared),
        "panels": {name: _panel(p) for name, p in colour_panels(scene, parts, field).items()},
        "ramp": np.round(255 * colours.ramp_colours(np.linspace(0, 1, RAMP_COLOURS))).astype(int).tolist(),
        "credits": list(credits),
        "honest": resolution_statement(prepared),
    }


def part_cards(prepared: PreparedScene) -> list[dict]:
    """Return every part's card: material, values with ranges and sources, real and simulated E."""
    scene, parts, particles = prepared.scene, prepared.parts, prepared.particles
    heavy = particles.mass_real, part_scales(scene, parts)
    listed = materials.materials_json(prepared.field, parts, *heavy)["parts"]
    for k, (card, treatment) in enumerate(zip(listed, particles.treatments, strict=True)):
        numbers = ("kind", "simulated_young_pa", "young_pa", "density", "reason")
        card["simulated"] = {name: getattr(treatment, name) for name in numbers}
        card["fill"] = particles.fills[k] if k < len(particles.fills) else ""
    return listed


def resolution_statement(prepared: PreparedScene) -> str:
    """Describe the resolution of a scene in one line, and what is softened."""
    particles = prepared.particles
    softer = sorted(
        (t.simulated_young_pa / t.young_pa, prepared.scene.objects[part.object].name, part.name)
        for part, t in zip(prepared.parts.catalogue, particles.treatments, strict=True)
        if t.kind not in ("rigid", "foliage") and t.simulated_young_pa < UNSOFTENED_MODULUS_RATIO * t.young_pa
    )
    size = f"{particles.count:,} particles, cells of {1e3 * particles.cell:.3g} mm"
    if not softer:
        return f"{size}; no part is softened"
    (share, owner, name), count = softer[0], len(softer)
    who = owner if owner == name else f"{owner}/{name}"
    number = f"{count} part{'s' * (count > 1)}"
    return f"{size}; {number} softened, most of all {who}: {share:.2g} × its E"


def contact_times(happened: Outcome) -> list[dict]:
    """Return when bodies first touched, for the timeline."""
    return [
        {"time": pair.first_contact_s, "what": f"{name.replace('|', ' touches ')}"}
        for name, pair in happened.pairs.items()
        if pair.first_contact_s is not None and pair.first_contact_s > 0
    ]


def audit_summary(audit: RunAudit, prepared: PreparedScene) -> dict[str, Any]:
    """Return grave findings and warnings with the parts that they are about, expectations, numbers and settings."""
    grave = [f.sentence for f in audit.findings if f.severity == "grave"]
    numbers = (
        *("momentum_residual", "mechanical_growth", "max_penetration_dx", "max_penetration_m"),
        *("steps", "dt_min", "dt_max", "nan_count", "particles_out_of_domain"),
    )
    return {
        "warnings": _sentences_with_parts([w for w in audit.warnings if w not in grave], prepared),
        "grave": _sentences_with_parts(grave, prepared),
        "expectations": [asdict(e) for e in audit.expectations],
        "numbers": {name: getattr(audit, name) for name in numbers},
        "settings": dict(audit.settings),
        "seconds": dict(audit.seconds),
    }


def _sentences_with_parts(sentences: Sequence[str], prepared: PreparedScene) -> list[dict]:
    scene: Scene = prepared.scene
    return [{"text": w, "parts": parts_named_in(w, scene, prepared.parts)} for w in sentences]


def _panel(panel: CategoryPanel | NumericPanel) -> dict[str, Any]:
    shade = ["#" + "".join(f"{round(255 * c):02x}" for c in rgb) for rgb in part_colours(panel).tolist()]
    if isinstance(panel, CategoryPanel):
        return {"title": panel.title, "colours": shade, "labels": list(panel.label)}
    whole = {"values": [float(v) for v in panel.value], "unit": panel.unit, "log": panel.log}
    return {"title": panel.title, "colours": shade, **whole}
