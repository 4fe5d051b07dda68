"""What a run leaves in its folder for people and programs: film, report, tables, figures."""

import resource
import shutil
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from corporeal import materials, store
from corporeal.geometry.sizes import scale_of_part
from corporeal.mpm.outcome import outcome
from corporeal.render.figures import fields_figure, strip
from corporeal.showcase.expectations import expect
from corporeal.stages.ground import doubts
from corporeal.stages.report import Story, report
from corporeal.types import Inventory, Scene

Progress = Callable[[float, str], None]

FILES = (
    *("film.mp4", "report.html", "materials.json", "audit.json", "fields.png", "strip.png"),
    *("ensemble.json", "ensemble.png"),
)
"""All that may lie in a run's folder beside the folders of its verbs."""


def write_results(
    folder: Path,
    made: Mapping[str, Any],
    audit: Mapping[str, Any],
    settings: Mapping[str, str],
    seconds: dict[str, float],
    progress: Progress,
) -> None:
    """Write everything that a run leaves.

    Args:
        folder: The run's.
        made: What each verb made.
        audit: The simulation's.
        settings: What the report says of them.
        seconds: That each verb took; this one's are added before they are written down.
        progress: Told the fraction done and what is being done.

    """
    started = time.perf_counter()
    scene, parts, field, particles = (made[v] for v in ("assemble", "segment", "ground", "fill"))
    movie, found = made["film"], made.get("reconstruct")
    figures = {
        "The film as a row of frames": folder / "strip.png",
        "Materials, laws and values of every part": folder / "fields.png",
    }
    fields_figure(scene, parts, field, folder / "fields.png")
    progress(0.5, "drawing the figures")
    strip(movie, folder / "strip.png")
    happened = outcome(scene, particles, made["simulate"])
    seen = expect(scene.name, happened)
    seconds["report"] = time.perf_counter() - started
    audit = dict(audit) | {
        "outcome": happened,
        "expectations": [asdict(e) for e in seen],
        "seconds": seconds | {"total": sum(seconds.values())},
        "peak_memory_mb": peak_memory_mb(),
        "settings": settings,
        "questions": made["describe"].usage,
        "warnings": _warnings(made, audit),
    }
    shutil.copyfile(movie.path, folder / "film.mp4")
    store.write_json(folder / "audit.json", audit)
    heavy = particles.mass_real, scale_of_part(scene, parts)
    store.write_json(folder / "materials.json", materials.materials_json(field, parts, *heavy))
    story = Story(
        scene=scene,
        parts=parts,
        field=field,
        particles=particles,
        film=movie,
        audit=audit,
        figures=figures,
        sources=materials.sources(),
        expectations=tuple((e.sentence, e.value, e.target, e.met) for e in seen),
        origin=found.statements if found else (),
    )
    report(story, folder / "report.html")


def _warnings(made: Mapping[str, Any], audit: Mapping[str, Any]) -> list[str]:
    """Return what every verb warns of, each sentence once, in the order of the verbs."""
    scene, inventory, found = made["assemble"], made["describe"], made.get("reconstruct")
    said = (
        found.warnings if found else (),
        still_doubted(scene, inventory),
        inventory.warnings,
        made["segment"].warnings,
        doubts(made["ground"], made["segment"], scene),
        made["fill"].warnings,
        audit["warnings"],
    )
    return list(dict.fromkeys(w for group in said for w in group))


def still_doubted(scene: Scene, inventory: Inventory) -> tuple[str, ...]:
    """Return a scene's warnings, less doubts about sizes that a model has judged since."""
    judged = [f"--extent {o.name}=" for o in inventory.objects if o.usual_extent]
    return tuple(w for w in scene.warnings if not any(words in w for words in judged))


def peak_memory_mb() -> float:
    """Largest resident memory of this process so far [MB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (1e6 if sys.platform == "darwin" else 1e3), 1)
