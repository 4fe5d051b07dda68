"""What a run leaves in its folder for people and programs: film, report, tables, figures."""

import resource
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

from corporeal import materials
from corporeal.core import store
from corporeal.core.findings import Audit, Expectation, Outcome, RunAudit
from corporeal.core.types import Film, Inventory, Note, Reconstruction, Scene
from corporeal.discretization.sizes import scale_of_part
from corporeal.pipeline.playback import cast_of, playback, recorded
from corporeal.pipeline.results import Results
from corporeal.pipeline.stages.film import CLOSE_UP
from corporeal.pipeline.stages.ground import doubts
from corporeal.pipeline.stages.report import Story, report
from corporeal.render.figures import fields_figure, strip
from corporeal.render.viewer_page import inline_view
from corporeal.showcase.expectations import expect
from corporeal.simulation.audit import believed
from corporeal.simulation.audit_file import write_audit
from corporeal.simulation.hints import hints

Progress = Callable[[float, str], None]

LARGEST = 4_000_000
"""Of the 3D view in the report [bytes]."""
THINNER = (1, 2, 4)
"""One of so many pictures is kept, until it fits."""


@dataclass(frozen=True)
class Spent:
    """What a run was asked for, and what it took."""

    settings: Mapping[str, str]
    """What the report says of them."""
    seconds: dict[str, float]
    """Verb → what it took [s]; the report's own are added before they are written down."""
    divided: bool = False
    """Whether it was asked for which nodes of a file are objects."""


def write_results(
    folder: Path,
    made: Results,
    audit: Audit,
    spent: Spent,
    progress: Progress,
    more: Mapping[str, Path] | None = None,
) -> None:
    """Write everything that a run leaves.

    Args:
        folder: The run's.
        made: What each verb made.
        audit: The simulation's.
        spent: What was asked for, and what it took.
        progress: Told the fraction done and what is being done.
        more: Figures that verbs drew, by caption.

    """
    started = time.perf_counter()
    # Figures.
    figures = {
        "The film as a row of frames": folder / "strip.png",
        **_close_up(made.movie, folder / "close-up.png"),
        "Materials, laws and values of every part": folder / "fields.png",
        **(more or {}),
    }
    fields_figure(made.scene, made.parts, made.field, folder / "fields.png")
    progress(0.5, "drawing the figures")
    strip(made.movie, folder / "strip.png")
    # What happened, and what it took.
    happened = made.played.outcome
    seen = tuple(expect(made.scene.name, happened))
    spent.seconds["report"] = time.perf_counter() - started
    whole = run_audit(made, audit, happened, seen, spent)
    # Files.
    shutil.copyfile(made.movie.path, folder / "film.mp4")
    write_audit(folder, whole)
    heavy = made.particles.mass_real, scale_of_part(made.scene, made.parts)
    listed = materials.materials_json(made.field, made.parts, *heavy)
    store.write_json(folder / "materials.json", listed)
    story = Story(
        scene=made.scene,
        parts=made.parts,
        field=made.field,
        particles=made.particles,
        film=made.movie,
        audit=whole,
        figures=figures,
        sources=materials.sources(),
        origin=made.reconstruct.statements if made.reconstruct else (),
        view=_view(made, whole),
    )
    report(story, folder / "report.html")


def _close_up(movie: Film, path: Path) -> dict[str, Path]:
    """Copy the film's close-up beside the other files, where it has one."""
    drawn = movie.path.parent / CLOSE_UP
    if not drawn.exists():
        return {}
    shutil.copyfile(drawn, path)
    return {"The first contact from close by": path}


def _view(made: Results, audit: RunAudit) -> str:
    """Return the 3D view for the report, with as many pictures a second as it has room for."""
    cast = cast_of(made.prepared)
    recording = recorded(cast, made.trajectory)
    for step in THINNER:
        taken = playback(made.prepared, cast, audit.outcome, recording.every(step), audit)
        view = inline_view(taken)
        if len(view) <= LARGEST:
            return view
    return (
        f'<p class="lead">The 3D view of this run would take more than {LARGEST / 1e6:.0f} MB and '
        "is left out. Look at it with: corporeal view RUN</p>"
    )


def run_audit(
    made: Results,
    audit: Audit,
    happened: Outcome,
    seen: tuple[Expectation, ...],
    spent: Spent,
) -> RunAudit:
    """Put beside a simulation's audit what happened and what the whole run took."""
    audit = audit.noting(_warnings(made, audit))
    return RunAudit(
        **{f.name: getattr(audit, f.name) for f in fields(Audit)},
        outcome=happened,
        expectations=believed(seen, audit),
        seconds=spent.seconds | {"total": sum(spent.seconds.values())},
        peak_memory_mb=peak_memory_mb(),
        settings=spent.settings,
        questions=made.inventory.usage,
        hints=hints(
            made.assembled.scene, happened, spent.divided, audit.unbooked_loss, audit.parts
        ),
    )


def _warnings(made: Results, audit: Audit) -> tuple[str, ...]:
    """Return what every verb warns of, in the order of the verbs.

    What was noticed of photographs comes last: it is most, and the terminal shows the first.
    """
    groups = (
        still_doubted(made.scene, made.inventory),
        made.inventory.warnings,
        made.parts.warnings,
        doubts(made.field, made.parts, made.scene),
        tuple(m.warning for m in made.field.mixtures if m.warning),
        made.particles.warnings,
        audit.notes,
        made.reconstruct.warnings if made.reconstruct else (),
    )
    return doubts_first(made.reconstruct, (w for group in groups for w in group))


def doubts_first(found: Reconstruction | None, warnings: Iterable[str]) -> tuple[str, ...]:
    """Return each warning once, before all others where shapes are not to be believed."""
    doubted = () if found is None else found.doubts
    return tuple(dict.fromkeys((*doubted, *warnings)))


def still_doubted(scene: Scene, inventory: Inventory) -> tuple[str, ...]:
    """Return a scene's warnings, less doubts about sizes that a model has judged since."""
    judged = {o.name for o in inventory.objects if o.usual_extent}
    return tuple(w for w in scene.warnings if not (isinstance(w, Note) and w.size_of in judged))


def peak_memory_mb() -> float:
    """Largest resident memory of this process so far [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1e6 if sys.platform == "darwin" else 1e3), 1)
