"""Results of a corpus: one record per scene, and one per simulated part."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.audit_data import FLOOR_NAME, Outcome, RunAudit
from corporeal.core.errors import UserError
from corporeal.core.types import Law
from corporeal.io.scene_toml import read_scene_file
from corporeal.jobs.job import ManifestRow, read_manifest_rows
from corporeal.lab.corpus.corpus_plan import CorpusPlan, PlannedScene, read_plan
from corporeal.lab.corpus.run_corpus import RUNS_FOLDER, SCENE_TOML_FILE, SCENES_FOLDER, VIEWS_FOLDER
from corporeal.materials import find_material_or_default
from corporeal.pipeline.run_pipeline import Settings, read_run_request
from corporeal.render.colours import LAW_COLOURS
from corporeal.scene.collision_chain import impact_hops
from corporeal.scene.interactions import InteractionKind
from corporeal.scene.rest_certificate import RestCertificate
from corporeal.scene.scene_composition import (
    CERTIFICATE_FILE,
    COMPOSITION_FILE,
    SceneComposition,
    read_certificate,
    read_composition,
)
from corporeal.simulation.audit_file import AUDIT_FILE, read_run_audit
from corporeal.simulation.audit_messages import breach_messages

MIN_WIND_MOTION_M = 1e-3
"""Least movement or deformation that counts as having been moved by the wind [m]."""
RIGID_BODY_LAW = "rigid body"


@dataclass(frozen=True)
class SceneMeasures:
    """What was measured in one scene, as scenes are compared."""

    clean: bool
    """No bound of the audit is broken, and it has no grave finding."""
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
    assembled: ManifestRow | None
    ran: ManifestRow | None
    certificate: RestCertificate | None
    """None where there is none: a scene of the showcase, or one that was not assembled."""
    composition: SceneComposition | None
    """As above."""
    numbers: SceneMeasures | None
    """What was measured; None: it was not run."""
    parts: tuple[PartRecord, ...] = ()
    picture: Path | None = None
    """The video as a row of frames; of a scene that was not run, a view of it at rest."""
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
class CorpusResults:
    """A whole corpus."""

    name: str
    plan: CorpusPlan
    scenes: tuple[SceneRecord, ...]

    @property
    def run(self) -> list[SceneRecord]:
        """Scenes with numbers."""
        return [s for s in self.scenes if s.numbers is not None]


def collect_results(folder: Path) -> CorpusResults:
    """Read a corpus.

    Raises:
        UserError: The folder is no corpus, or a file of it is damaged.
    """
    plan = read_plan(folder)
    assembled, ran = read_manifest_rows(folder, "assemble"), read_manifest_rows(folder, "run")
    scenes = [_record(folder, s, assembled.get(s.name), ran.get(s.name)) for s in plan.scenes]
    return CorpusResults(folder.resolve().name, plan, tuple(scenes))


def _record(folder: Path, planned: PlannedScene, assembled: ManifestRow | None, ran: ManifestRow | None) -> SceneRecord:
    scene, run = folder / SCENES_FOLDER / planned.name, folder / RUNS_FOLDER / planned.name
    finished = (run / store.META_FILE).exists() and (run / AUDIT_FILE).exists()
    audit = read_run_audit(run) if finished else None
    settings = read_run_request(run).settings if finished else None
    return SceneRecord(
        planned=planned,
        made=(scene / store.META_FILE).exists(),
        assembled=assembled,
        ran=ran,
        certificate=read_certificate(scene) if (scene / CERTIFICATE_FILE).exists() else None,
        composition=read_composition(scene) if (scene / COMPOSITION_FILE).exists() else None,
        numbers=None if audit is None else scene_measures(audit, planned.interaction, _launched_objects(scene)),
        parts=() if audit is None or settings is None else _parts(planned.name, audit, settings),
        picture=_picture(run / "strip.png", scene / VIEWS_FOLDER / "rgb"),
        settings=settings,
    )


def _picture(strip: Path, views: Path) -> Path | None:
    if strip.exists():
        return strip
    found = sorted(views.glob("*.png"))
    return found[len(found) // 2] if found else None


def _launched_objects(scene: Path) -> list[str]:
    """Name what a scene file sends off."""
    path = scene / SCENE_TOML_FILE
    entries = read_scene_file(path).objects if path.exists() else ()
    return [e.name for e in entries if e.name and e.velocity is not None]


def scene_measures(audit: RunAudit, kind: InteractionKind, sent: Sequence[str] = ()) -> SceneMeasures:
    """Condense an audit into the numbers that scenes are compared by."""
    happened, wanted = audit.outcome, audit.expectations
    objects = happened.objects.values()
    wrong = [*breach_messages(audit), *(f.sentence for f in audit.findings if f.severity == "grave")]
    first = happened.duration_s / max(1, audit.frames - 1)
    landed = sum((p.first_contact_s or 0.0) > first for p in happened.with_floor)
    met = [p for p in happened.between_objects if p.first_contact_s is not None]
    return SceneMeasures(
        clean=not wrong,
        breaches=tuple(wrong),
        warnings=audit.warnings,
        objects=len(objects),
        at_rest=sum(t.at_rest for t in objects),
        impacts=len(happened.order) + landed,
        met=len(met),
        separated=sum(bool(p.separated) for p in met),
        seen=all(e.met for e in wanted) if wanted else _did_interaction_happen(kind, happened, landed, sent),
        touched_before=tuple(
            " and ".join(name.split("|"))
            for name, pair in happened.pairs.items()
            if not name.endswith(f"|{FLOOR_NAME}") and pair.first_contact_s == 0.0
        ),
        met_in_order=tuple(" and ".join(pair) for pair in happened.order),
        expected=len(wanted),
        expected_met=sum(e.met for e in wanted),
        largest_dent_dx=max((t.dent_depth_dx for t in objects), default=0.0),
        seconds=audit.seconds["total"],
        seconds_simulate=audit.seconds["simulate"],
        duration_s=happened.duration_s,
        **{name: getattr(audit, name) for name in COPIED_AUDIT_FIELDS},
    )


COPIED_AUDIT_FIELDS = (
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


def _did_interaction_happen(kind: InteractionKind, happened: Outcome, landed: int, sent: Sequence[str]) -> bool:
    """Return whether what the interaction promises happened.

    fall: something came down on the floor or on another. fall-onto, collision: two objects met.
    chain: what was struck struck a third. wind: something moved or gave way by a millimetre.
    """
    met = happened.order
    if kind == "fall":
        return len(met) + landed > 0
    if kind == "wind":
        moves = (max(t.moved_level_m, t.deepest_squeeze_m) for t in happened.objects.values())
        return max(moves, default=0.0) > MIN_WIND_MOTION_M
    return max(impact_hops(met, sent).values(), default=0) > 1 if kind == "chain" else len(met) > 0


def _parts(scene: str, audit: RunAudit, settings: Settings) -> tuple[PartRecord, ...]:
    objects, source = audit.outcome.objects, settings.ground.library
    return tuple(
        PartRecord(
            scene=scene,
            object=p.object,
            material=p.material,
            group=_group(scene, p.material, source),
            law=RIGID_BODY_LAW if p.treatment == "rigid" else LAW_COLOURS[Law[p.law.upper()]][0],
            mass=p.mass_kg,
            at_rest=objects[p.object].at_rest,
        )
        for p in audit.parts
        if p.object is not None
    )


def _group(scene: str, material: str, source: str) -> str:
    try:
        return find_material_or_default(material, source).group
    except UserError as error:
        raise UserError(
            f"Scene {scene} was run with the materials of {source}, and the classes of these "
            f"cannot be read: {error} Restore the library, or run this where the corpus was run."
        ) from error
