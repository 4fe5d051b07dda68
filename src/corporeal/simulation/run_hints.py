"""Hints on unexpected but valid results, with the option that changes them.

Warnings say why a result may not be trusted; hints name alternative settings.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from corporeal.core.audit_data import ObjectOutcome, Outcome, PartAudit
from corporeal.core.types import Law, Scene
from corporeal.recognition.parts_by_name import name_words

MIN_VISIBLE_MOTION_RATIO = 0.01
"""Of an object's length: what moves or bends less cannot be seen [-]."""
MIN_VISIBLE_TURN_DEG = 1.0
"""The same of its turning [degrees]."""
REPORTED_LOSS_FRACTION = 0.1
"""Share of energy lost numerically that is reported [-]."""
FLOWING_LAWS = frozenset(law.name.lower() for law in (Law.FLUID, Law.DRUCKER_PRAGER))
"""Laws of materials without shape memory."""
START_HINT = "Let it fall (--drop 0.5), throw it (--velocity NAME=1,0,0) or push it (scene.toml)."


def run_hints(
    scene: Scene, happened: Outcome, divided: bool, lost: float | None = None, parts: Sequence[PartAudit] = ()
) -> tuple[str, ...]:
    """Return hints for the next run, in sentences.

    Args:
        scene: What was simulated.
        happened: The outcome.
        divided: Whether it was asked for which nodes of a file are objects of their own.
        lost: Share of the energy that no booked loss accounts for [-]; None: it is not known.
        parts: How each part was simulated.

    """
    joined = () if divided else _one_object_hint(scene)
    return (*scene.hints, *joined, *_motionless_hint(scene, happened), *_energy_loss_hint(lost, parts))


def _energy_loss_hint(share: float | None, parts: Sequence[PartAudit]) -> Iterator[str]:
    """Hint at numerical energy loss of soft parts on coarse cells."""
    soft = dict.fromkeys(p.object for p in parts if p.object and _springs_back(p))
    if share is not None and share > REPORTED_LOSS_FRACTION and soft:
        yield (
            f"{share:.0%} of the energy was lost numerically in transfers between material points "
            f"and grid: soft objects of few cells ({', '.join(soft)}) rebound and swing too "
            "little. A finer --detail loses less."
        )


def _springs_back(part: PartAudit) -> bool:
    """Return whether a part is elastic: not liquid, not granular."""
    return part.treatment != "rigid" and part.law not in FLOWING_LAWS


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
