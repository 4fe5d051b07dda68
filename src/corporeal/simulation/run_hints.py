"""Hints on unexpected but valid results, with the option that changes them.

Warnings say why a result may not be trusted; hints name alternative settings.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from corporeal.core.audit_data import AuditFinding, ObjectOutcome, Outcome
from corporeal.core.types import Scene
from corporeal.recognition.parts_by_name import name_words

MIN_VISIBLE_MOTION_RATIO = 0.01
"""Of an object's length: what moves or bends less cannot be seen [-]."""
MIN_VISIBLE_TURN_DEG = 1.0
"""The same of its turning [degrees]."""
START_HINT = "Let it fall (--drop 0.5), throw it (--velocity NAME=1,0,0) or push it (scene.toml)."


def run_hints(scene: Scene, happened: Outcome, divided: bool, findings: Sequence[AuditFinding] = ()) -> tuple[str, ...]:
    """Return hints for the next run, in sentences.

    Args:
        scene: What was simulated.
        happened: The outcome.
        divided: Whether it was asked for which nodes of a file are objects of their own.
        findings: Of the audit.
    """
    joined = () if divided else _one_object_hint(scene)
    return (*scene.hints, *joined, *_motionless_hint(scene, happened), *_minor_findings_hint(findings))


def _minor_findings_hint(findings: Sequence[AuditFinding]) -> Iterator[str]:
    """Say which parts are simulated with other values than measured, where no effect of that can be seen."""
    minor = [f for f in findings if f.severity == "minor" and f.stiffness_ratio is not None]
    softer = [f for f in minor if f.stiffness_ratio is not None and 0.0 < f.stiffness_ratio < 1.0]
    if not softer:
        return
    worst = min(softer, key=lambda f: f.stiffness_ratio or 0.0)
    are = "part is" if len(minor) == 1 else "parts are"
    yield (
        f"{len(minor)} {are} simulated with other values than the measured ones, without an effect that can be seen, "
        f"most of all {worst.object}: {worst.part}, with {worst.stiffness_ratio:.2g} of its Young's modulus. "
        "The report lists the ratios under Validity."
    )


def _one_object_hint(scene: Scene) -> Iterator[str]:
    """Say of a file with several named pieces that they are one object."""
    names = dict.fromkeys(s.name for s in scene.surfaces if name_words(s.name))
    if len(scene.objects) != 1 or len(names) < 2:
        return
    shown = ", ".join(list(names)[:3]) + (", …" if len(names) > 3 else "")
    yield (
        f"The file is one object: its {len(names)} named pieces ({shown}) stay together. "
        "With --objects nodes each of its nodes is an object."
    )


def _motionless_hint(scene: Scene, happened: Outcome) -> Iterator[str]:
    """Hint at scenes without motion, and at forces that are too weak."""
    held = [o for o in scene.objects if _is_still(happened.objects.get(o.name))]
    pushed = [o.name for o in held if o.push is not None]
    blown = [o.name for o in held if o.wind is not None]
    if pushed:
        is_ = "is" if len(pushed) == 1 else "are"
        yield (
            f"{', '.join(pushed)} {is_} pushed and yet not moved: friction or an obstacle holds "
            "it. The acceleration of a push has to exceed friction coefficient "
            "times gravity."
        )
    if blown:
        yield f"{', '.join(blown)}: the wind is too weak to move it visibly."
    if len(held) == len(scene.objects) and not pushed and not blown:
        yield f"Nothing moves: everything stands at rest, as it did at the start. {START_HINT}"


def _is_still(what: ObjectOutcome | None) -> bool:
    if what is None:
        return False
    far = float(np.linalg.norm(what.moved_m))
    turns = what.turned_deg > MIN_VISIBLE_TURN_DEG
    return (
        not turns and far < MIN_VISIBLE_MOTION_RATIO * what.length_m and what.shape_error_max < MIN_VISIBLE_MOTION_RATIO
    )
