"""Read what a corpus left on the disk: one record per scene, and one per simulated part."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.findings import FLOOR, Outcome, RunAudit
from corporeal.core.types import Law
from corporeal.io.scene_file import read_scene_file
from corporeal.jobs.manifest import Row, read_rows
from corporeal.lab.corpus.plan import Plan, PlannedScene, read_plan
from corporeal.lab.corpus.run import RUNS, SCENE, SCENES, VIEWS
from corporeal.materials import named
from corporeal.pipeline.runner import Settings, reopen
from corporeal.render.colours import LAWS
from corporeal.scene.certificate import Certificate
from corporeal.scene.composition import (
    CERTIFICATE,
    COMPOSITION,
    Composition,
    read_certificate,
    read_composition,
)
from corporeal.scene.interactions import Kind
from corporeal.scene.rehearsal import hops
from corporeal.simulation.audit_file import AUDIT, read_run_audit
from corporeal.simulation.audit_words import breaches

SWAY = 1e-3
"""Least movement or deformation that counts as having been moved by the wind [m]."""
RIGID = "rigid body"


@dataclass(frozen=True)
class Numbers:
    """What was measured in one scene, as scenes are compared."""

    clean: bool
    """No bound of the audit is broken."""
    breaches: tuple[str, ...]
    """Sentences for the bounds that are."""
    warnings: tuple[str, ...]
    objects: int
    at_rest: int
    """Objects at rest at the end."""
    impacts: int
    """Objects that were apart and met, or met the floor after the first frame."""
    met: int
    """Pairs of objects that touched."""
    separated: int
    """Of those, pairs that parted again."""
    seen: bool
    """What the interaction promises happened; in the showcase, all that is expected."""
    touched_before: tuple[str, ...]
    """Pairs of objects that touched from the start, in words: none of them can strike the other."""
    met_in_order: tuple[str, ...]
    """Pairs of objects that were apart and met, in words, by time."""
    expected: int
    """How much is expected of a scene of the showcase."""
    expected_met: int
    largest_dent_dx: float
    """[cells]"""
    seconds: float
    """Of computing [s]."""
    seconds_simulate: float
    """Of simulating alone [s]."""
    duration_s: float
    """Simulated [s]."""
    particles: int
    steps: int
    cell_m: float
    """Grid spacing [m]."""
    momentum_residual: float
    energy_growth: float
    mechanical_growth: float
    mass_error: float
    max_penetration_dx: float
    """[cells]"""
    max_penetration_m: float
    floor_penetration_m: float
    pair_penetration_m: float
    nan_count: int
    particles_out_of_domain: int
    peak_memory_mb: float


@dataclass(frozen=True)
class PartRecord:
    """One part of one object, as it was simulated."""

    scene: str
    object: str
    material: str
    group: str
    """Material class: metal, polymer, …"""
    law: str
    """In words; "rigid body" where no law acts."""
    mass: float
    """[kg]"""
    at_rest: bool
    """Whether its object was, at the end."""


@dataclass(frozen=True)
class SceneRecord:
    """One scene: what was planned, and as far as it came, what was made and what happened."""

    planned: PlannedScene
    made: bool
    """Whether it is assembled."""
    assembled: Row | None
    ran: Row | None
    certificate: Certificate | None
    """None where there is none: a scene of the showcase, or one that was not assembled."""
    composition: Composition | None
    """As above."""
    numbers: Numbers | None
    """What was measured; None: it was not run."""
    parts: tuple[PartRecord, ...] = ()
    picture: Path | None = None
    """The film as a row of frames; of a scene that was not run, a view of it at rest."""
    settings: Settings | None = None

    @property
    def name(self) -> str:
        """Of the scene."""
        return self.planned.name

    @property
    def error(self) -> str:
        """Why it was not made or not run; empty where nothing failed."""
        for verb, row in (("assemble", self.assembled), ("run", self.ran)):
            if row is not None and row.status == "failed":
                return f"{verb}: {row.error}"
        return ""


@dataclass(frozen=True)
class Collected:
    """A whole corpus."""

    name: str
    plan: Plan
    scenes: tuple[SceneRecord, ...]

    @property
    def run(self) -> list[SceneRecord]:
        """Scenes with numbers."""
        return [s for s in self.scenes if s.numbers is not None]


def collect(folder: Path) -> Collected:
    """Read a corpus.

    Raises:
        UserError: The folder is no corpus, or a file of it is damaged.

    """
    plan = read_plan(folder)
    assembled, ran = read_rows(folder, "assemble"), read_rows(folder, "run")
    scenes = [_record(folder, s, assembled.get(s.name), ran.get(s.name)) for s in plan.scenes]
    return Collected(folder.resolve().name, plan, tuple(scenes))


def _record(
    folder: Path, planned: PlannedScene, assembled: Row | None, ran: Row | None
) -> SceneRecord:
    scene, run = folder / SCENES / planned.name, folder / RUNS / planned.name
    finished = (run / store.META).exists() and (run / AUDIT).exists()
    audit = read_run_audit(run) if finished else None
    settings = reopen(run).settings if finished else None
    return SceneRecord(
        planned=planned,
        made=(scene / store.META).exists(),
        assembled=assembled,
        ran=ran,
        certificate=read_certificate(scene) if (scene / CERTIFICATE).exists() else None,
        composition=read_composition(scene) if (scene / COMPOSITION).exists() else None,
        numbers=None if audit is None else measures(audit, planned.interaction, _sent(scene)),
        parts=() if audit is None or settings is None else _parts(planned.name, audit, settings),
        picture=_picture(run / "strip.png", scene / VIEWS / "rgb"),
        settings=settings,
    )


def _picture(strip: Path, views: Path) -> Path | None:
    if strip.exists():
        return strip
    found = sorted(views.glob("*.png"))
    return found[len(found) // 2] if found else None


def _sent(scene: Path) -> list[str]:
    """Name what a scene file sends off."""
    path = scene / SCENE
    entries = read_scene_file(path).objects if path.exists() else ()
    return [e.name for e in entries if e.name and e.velocity is not None]


# ---------------------------------------------------------------- numbers of one scene


def measures(audit: RunAudit, kind: Kind, sent: Sequence[str] = ()) -> Numbers:
    """Condense an audit into the numbers that scenes are compared by.

    Args:
        audit: Of a finished run.
        kind: What was to happen.
        sent: Objects that were sent off at the start.

    """
    happened, wanted = audit.outcome, audit.expectations
    objects, wrong = happened.objects.values(), breaches(audit)
    first = happened.duration_s / max(1, audit.frames - 1)
    landed = sum((p.first_contact_s or 0.0) > first for p in happened.with_floor)
    met = [p for p in happened.between_objects if p.first_contact_s is not None]
    return Numbers(
        clean=not wrong,
        breaches=tuple(wrong),
        warnings=audit.warnings,
        objects=len(objects),
        at_rest=sum(t.at_rest for t in objects),
        impacts=len(happened.order) + landed,
        met=len(met),
        separated=sum(bool(p.separated) for p in met),
        seen=all(e.met for e in wanted) if wanted else _seen(kind, happened, landed, sent),
        touched_before=tuple(
            " and ".join(name.split("|"))
            for name, pair in happened.pairs.items()
            if not name.endswith(f"|{FLOOR}") and pair.first_contact_s == 0.0
        ),
        met_in_order=tuple(" and ".join(pair) for pair in happened.order),
        expected=len(wanted),
        expected_met=sum(e.met for e in wanted),
        largest_dent_dx=max((t.dent_depth_dx for t in objects), default=0.0),
        seconds=audit.seconds["total"],
        seconds_simulate=audit.seconds["simulate"],
        duration_s=happened.duration_s,
        **{name: getattr(audit, name) for name in COPIED},
    )


COPIED = (
    "particles",
    "steps",
    "cell_m",
    "momentum_residual",
    "energy_growth",
    "mechanical_growth",
    "mass_error",
    "max_penetration_dx",
    "max_penetration_m",
    "floor_penetration_m",
    "pair_penetration_m",
    "nan_count",
    "particles_out_of_domain",
    "peak_memory_mb",
)


def _seen(kind: Kind, happened: Outcome, landed: int, sent: Sequence[str]) -> bool:
    """Tell whether what the interaction promises happened.

    fall: something came down on the floor or on another. fall-onto, collision: two objects met.
    chain: what was struck struck a third. wind: something moved or gave way by a millimetre.
    """
    met = happened.order
    if kind == "fall":
        return len(met) + landed > 0
    if kind == "wind":
        moves = (max(t.moved_level_m, t.deepest_squeeze_m) for t in happened.objects.values())
        return max(moves, default=0.0) > SWAY
    return max(hops(met, sent).values(), default=0) > 1 if kind == "chain" else len(met) > 0


# ---------------------------------------------------------------- parts


def _parts(scene: str, audit: RunAudit, settings: Settings) -> tuple[PartRecord, ...]:
    objects, source = audit.outcome.objects, settings.ground.library
    return tuple(
        PartRecord(
            scene=scene,
            object=p.object,
            material=p.material,
            group=_group(scene, p.material, source),
            law=RIGID if p.treatment == "rigid" else LAWS[Law[p.law.upper()]][0],
            mass=p.mass_kg,
            at_rest=objects[p.object].at_rest,
        )
        for p in audit.parts
        if p.object is not None
    )


def _group(scene: str, material: str, source: str) -> str:
    try:
        return named(material, source).group
    except UserError as error:
        raise UserError(
            f"Scene {scene} was run with the materials of {source}, and the classes of these "
            f"cannot be read: {error} Bring the library back, or ask from where the corpus was run."
        ) from error
