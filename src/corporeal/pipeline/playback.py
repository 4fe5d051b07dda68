"""What the viewer shows of a run: how its objects move, and what is known of them."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from corporeal import materials
from corporeal.core.findings import Outcome, RunAudit
from corporeal.core.types import Reconstruction, Scene, Trajectory
from corporeal.discretization.sizes import scale_of_part
from corporeal.render import colours
from corporeal.render.figures import Names, Numbers, panels, shades
from corporeal.render.skin import bind
from corporeal.render.subject import parts_named
from corporeal.render.take import Cast, Recording, record, take
from corporeal.render.take_splats import splats_of
from corporeal.simulation.moving_gaussians import fluid, granular
from corporeal.simulation.played import Prepared

RAMP = 17
"""Colours that the page mixes all others of a scale from."""
AS_MEASURED = 0.999
"""Above this share of its modulus a part is as stiff as it is."""
FAST = 30.0
"""Most pictures a second that a recording needs."""


def cast_of(prepared: Prepared) -> Cast:
    """Bind the surfaces of a scene to its particles."""
    p = prepared
    skin = bind(p.scene, p.parts, p.particles, granular(p.field), fluid(p.field))
    return Cast.of(p.scene, p.particles, skin)


def recorded(cast: Cast, trajectory: Trajectory, fps: float = FAST) -> Recording:
    """Take down a trajectory with at most ``fps`` pictures a second, its first and last included.

    Args:
        cast: From ``cast_of``.
        trajectory: Frames are read one by one.
        fps: [1/s]

    """
    count = len(trajectory.frames)
    length = float(trajectory.time[-1] - trajectory.time[0]) if count > 1 else 0.0
    wanted = min(count, round(length * fps) + 1)
    numbers = np.unique(np.linspace(0, count - 1, max(wanted, 1)).round().astype(int))
    return record(cast, (trajectory.frames[int(k)] for k in numbers))


def playback(
    prepared: Prepared,
    cast: Cast,
    happened: Outcome | None = None,
    recording: Recording | None = None,
    audit: RunAudit | None = None,
    found: Reconstruction | None = None,
) -> bytes:
    """Return all that a page needs to play a run: see ``render.take``.

    Args:
        prepared: The scene.
        cast: From ``cast_of``.
        happened: What happened in it; None: it has not been simulated.
        recording: From ``recorded``; None: as for ``happened``.
        audit: Warnings and numbers, where the run has been reported on.
        found: Gaussians that the scene was made of, to be looked at; None: its surfaces alone.

    """
    summary = summary_of(prepared)
    if happened is not None:
        summary["marks"] = marks(happened)
    if audit is not None:
        summary["audit"] = audit_of(audit, prepared)
    splats = None if found is None or not found.gaussians.count else splats_of(found, cast)
    return take(prepared.scene, prepared.parts, cast, recording, summary, splats)


def summary_of(prepared: Prepared) -> dict[str, Any]:
    """Return what is known of a scene before it moves: parts, colours, credits."""
    scene, parts, field = prepared.scene, prepared.parts, prepared.field
    credits = dict.fromkeys(o.credit for o in scene.objects if o.credit)
    return {
        "cell": prepared.particles.cell,
        "particles": prepared.particles.count,
        "parts": cards(prepared),
        "panels": {name: _panel(p) for name, p in panels(scene, parts, field).items()},
        "ramp": np.round(255 * colours.ramp(np.linspace(0, 1, RAMP))).astype(int).tolist(),
        "credits": list(credits),
        "honest": slowed(prepared),
    }


def cards(prepared: Prepared) -> list[dict]:
    """Return every part's card: material, values with ranges and sources, real and simulated E."""
    scene, parts, particles = prepared.scene, prepared.parts, prepared.particles
    heavy = particles.mass_real, scale_of_part(scene, parts)
    listed = materials.materials_json(prepared.field, parts, *heavy)["parts"]
    for k, (card, treatment) in enumerate(zip(listed, particles.treatments, strict=True)):
        numbers = ("kind", "young", "young_real", "density", "why")
        card["simulated"] = {name: getattr(treatment, name) for name in numbers}
        card["fill"] = particles.fills[k] if k < len(particles.fills) else ""
    return listed


def slowed(prepared: Prepared) -> str:
    """Say in one line how fine a scene is simulated, and what of it softer than it is."""
    particles = prepared.particles
    softer = sorted(
        (t.young / t.young_real, prepared.scene.objects[part.object].name, part.name)
        for part, t in zip(prepared.parts.catalogue, particles.treatments, strict=True)
        if t.kind not in ("rigid", "foliage") and t.young < AS_MEASURED * t.young_real
    )
    size = f"{particles.count:,} particles, cells of {1e3 * particles.cell:.3g} mm"
    if not softer:
        return f"{size}; nothing is simulated softer than it is"
    (share, owner, name), count = softer[0], len(softer)
    who = owner if owner == name else f"{owner}/{name}"
    number = f"{count} part{'s' * (count > 1)}"
    return f"{size}; {number} softer than in reality, most of all {who}: {share:.2g} × its E"


def marks(happened: Outcome) -> list[dict]:
    """Return when bodies first touched, for the timeline."""
    return [
        {"time": pair.first_contact_s, "what": f"{name.replace('|', ' touches ')}"}
        for name, pair in happened.pairs.items()
        if pair.first_contact_s is not None and pair.first_contact_s > 0
    ]


def audit_of(audit: RunAudit, prepared: Prepared) -> dict[str, Any]:
    """Return warnings with the parts that they are about, expectations, numbers and settings."""
    numbers = (
        *("momentum_residual", "mechanical_growth", "max_penetration_dx", "max_penetration_m"),
        *("steps", "dt_min", "dt_max", "nan_count", "particles_out_of_domain"),
    )
    return {
        "warnings": _pointed(audit.warnings, prepared),
        "expectations": [asdict(e) for e in audit.expectations],
        "numbers": {name: getattr(audit, name) for name in numbers},
        "settings": dict(audit.settings),
        "seconds": dict(audit.seconds),
    }


def _pointed(warnings: Sequence[str], prepared: Prepared) -> list[dict]:
    scene: Scene = prepared.scene
    return [{"text": w, "parts": parts_named(w, scene, prepared.parts)} for w in warnings]


def _panel(panel: Names | Numbers) -> dict[str, Any]:
    shade = ["#" + "".join(f"{round(255 * c):02x}" for c in rgb) for rgb in shades(panel).tolist()]
    if isinstance(panel, Names):
        return {"title": panel.title, "colours": shade, "labels": list(panel.label)}
    whole = {"values": [float(v) for v in panel.value], "unit": panel.unit, "log": panel.log}
    return {"title": panel.title, "colours": shade, **whole}
