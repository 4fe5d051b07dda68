"""Output files of a run: video, report, tables, figures."""

import resource
import shutil
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from corporeal import materials
from corporeal.core import store
from corporeal.core.audit_data import Audit, Expectation, Outcome, RunAudit
from corporeal.core.progress import Progress
from corporeal.core.types import Inventory, Note, Reconstruction, Scene, Video
from corporeal.discretization.object_scaling import part_scales
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.stages.ground import grounding_warnings
from corporeal.pipeline.stages.report import ReportContent, report
from corporeal.pipeline.stages.video import CLOSE_UP_FILE
from corporeal.pipeline.viewer_data import bind_scene, record_trajectory, viewer_recording
from corporeal.render.figures import fields_figure, write_filmstrip
from corporeal.render.viewer_page import inline_view
from corporeal.showcase.scene_expectations import compare_with_expectations
from corporeal.simulation.audit import reject_expectations
from corporeal.simulation.audit_file import write_audit
from corporeal.simulation.run_hints import run_hints

MAX_VIEW_BYTES = 4_000_000
"""Maximum size of the 3D view in the report [bytes]."""
FRAME_STRIDES = (1, 2, 4)
"""Temporal decimation factors, tried until the view fits."""


@dataclass(frozen=True)
class RunCost:
    """Settings of a run, and its cost."""

    settings: Mapping[str, str]
    """Settings shown in the report."""
    seconds: dict[str, float]
    """Stage → duration [s]."""
    divided: bool = False
    """Whether the grouping into objects was set by the user."""


def write_run_files(
    folder: Path,
    made: StageResults,
    audit: Audit,
    spent: RunCost,
    progress: Progress,
    more: Mapping[str, Path] | None = None,
) -> None:
    """Write the output files of a run."""
    started = time.perf_counter()
    # Figures.
    figures = {
        "The video as a row of frames": folder / "strip.png",
        **_close_up(made.rendered_video, folder / "close-up.png"),
        "Materials, laws and values of every part": folder / "fields.png",
        **(more or {}),
    }
    fields_figure(made.scene, made.parts, made.field, folder / "fields.png")
    progress(0.5, "drawing the figures")
    write_filmstrip(made.rendered_video, folder / "strip.png")
    # What happened, and what it took.
    happened = made.played.outcome
    seen = tuple(compare_with_expectations(made.scene.name, happened))
    spent.seconds["report"] = time.perf_counter() - started
    whole = run_audit(made, audit, happened, seen, spent)
    # Files.
    shutil.copyfile(made.rendered_video.path, folder / "video.mp4")
    write_audit(folder, whole)
    heavy = made.particles.mass_real, part_scales(made.scene, made.parts)
    listed = materials.materials_json(made.field, made.parts, *heavy)
    store.write_json(folder / "materials.json", listed)
    story = ReportContent(
        scene=made.scene,
        parts=made.parts,
        field=made.field,
        particles=made.particles,
        video=made.rendered_video,
        audit=whole,
        figures=figures,
        sources=materials.cited_sources(),
        origin=made.reconstruct.statements if made.reconstruct else (),
        view=_view(made, whole),
    )
    report(story, folder / "report.html")


def _close_up(video: Video, path: Path) -> dict[str, Path]:
    """Copy the video's close-up beside the other files, where it has one."""
    drawn = video.path.parent / CLOSE_UP_FILE
    if not drawn.exists():
        return {}
    shutil.copyfile(drawn, path)
    return {"The first contact from close by": path}


def _view(made: StageResults, audit: RunAudit, max_bytes: int = MAX_VIEW_BYTES) -> str:
    """Return the 3D view for the report, decimated in time to fit its size."""
    cast = bind_scene(made.prepared)
    recording = record_trajectory(cast, made.trajectory)
    for step in FRAME_STRIDES:
        taken = viewer_recording(made.prepared, cast, audit.outcome, recording.every(step), audit)
        view = inline_view(taken)
        if len(view) <= max_bytes:
            return view
    return (
        f'<p class="lead">The 3D view of this run is larger than {max_bytes / 1e6:.0f} MB and is '
        "left out. Open it with: corporeal view RUN</p>"
    )


def run_audit(
    made: StageResults, audit: Audit, happened: Outcome, seen: tuple[Expectation, ...], spent: RunCost
) -> RunAudit:
    """Add outcomes and the cost of the run to a simulation's audit."""
    audit = audit.noting(_warnings(made, audit))
    return RunAudit(
        **{f.name: getattr(audit, f.name) for f in fields(Audit)},
        outcome=happened,
        expectations=reject_expectations(seen, audit),
        seconds=spent.seconds | {"total": sum(spent.seconds.values())},
        peak_memory_mb=peak_memory_mb(),
        settings=spent.settings,
        questions=made.inventory.usage,
        hints=run_hints(made.assembled.scene, happened, spent.divided, audit.findings),
    )


def _warnings(made: StageResults, audit: Audit) -> tuple[str, ...]:
    """Return the warnings of all stages, in their order.

    Those of photographs come last: they are many, and the terminal shows the first.
    """
    groups = (
        remaining_warnings(made.scene, made.inventory),
        made.inventory.warnings,
        made.parts.warnings,
        grounding_warnings(made.field, made.parts, made.scene),
        tuple(m.warning for m in made.field.mixtures if m.warning),
        made.particles.warnings,
        audit.notes,
        made.reconstruct.warnings if made.reconstruct else (),
    )
    return sort_warnings(made.reconstruct, (w for group in groups for w in group))


def sort_warnings(found: Reconstruction | None, warnings: Iterable[str]) -> tuple[str, ...]:
    """Return each warning once, those on unreliable shapes first."""
    doubted = () if found is None else found.doubts
    return tuple(dict.fromkeys((*doubted, *warnings)))


def remaining_warnings(scene: Scene, inventory: Inventory) -> tuple[str, ...]:
    """Return a scene's warnings without doubts about sizes that a model has answered."""
    judged = {o.name for o in inventory.objects if o.usual_extent}
    return tuple(w for w in scene.warnings if not (isinstance(w, Note) and w.size_of in judged))


def peak_memory_mb() -> float:
    """Largest resident memory of this process so far [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1e6 if sys.platform == "darwin" else 1e3), 1)
