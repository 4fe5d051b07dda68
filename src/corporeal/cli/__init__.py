"""Command line: the program ``corporeal`` and its commands."""

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

# NumPy reads this when it is imported: threads of BLAS that wait for a core spin. A product of
# 900,000 places with a turn took 95 ms of processor time on two busy cores, and 6 ms on one
# thread. What gains by threads has its own. Child processes inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import tyro

from corporeal.cli.assets_command import command_assets
from corporeal.cli.capture_command import command_capture
from corporeal.cli.corpus_command import command_corpus
from corporeal.cli.evaluate_command import command_evaluate
from corporeal.cli.export_command import command_export
from corporeal.cli.masks_command import command_masks
from corporeal.cli.parse import parse
from corporeal.cli.run_summary import show_summary
from corporeal.cli.view_command import command_view
from corporeal.core.errors import UserError
from corporeal.core.process_resources import keep_freed_memory, relax_garbage_collection
from corporeal.core.terminal import console, progress_bars, show_table
from corporeal.core.version import __version__

Inputs = Annotated[
    tuple[Path, ...],
    tyro.conf.Positional,
    tyro.conf.arg(metavar="SCENE ...", help="Models, photographs, a video, a splat, or a scene.toml."),
]
Folder = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN", help="The folder of a run.")]
MATERIAL_WORDS = ("corporeal materials show NAME", "corporeal materials check FILE")


@dataclass(frozen=True)
class RunFolder:
    """Folder of the run, and resuming."""

    out: Path = Path("runs")
    """Parent folder; results are written to OUT/NAME."""
    name: str = ""
    """Name of the run's folder; by default the scene's name."""
    resume: bool = True
    """Continue an interrupted simulation from its checkpoint instead of starting it again."""


def command_run() -> None:
    """Run all stages on a scene: from files to a video and a report.

    SCENE is a model (GLB, glTF, OBJ, PLY, STL, OFF, 3MF, DAE, USD), several of them (each one
    object), or a scene.toml; or a folder of photographs, with poses (transforms.json, COLMAP,
    3 x 4 matrices) or without, a video, or a trained Gaussian splat.
    Results are written to runs/<name>/: video.mp4, report.html, materials.json, audit.json and
    pictures.
    Results that are up to date are reused.
    """
    from corporeal.pipeline.settings import Settings

    @dataclass(frozen=True)
    class Run:
        inputs: Inputs
        where: RunFolder = RunFolder()
        settings: Annotated[Settings, tyro.conf.arg(name="")] = field(default_factory=Settings)

    first = ("detail", "vlm", "annotations", "drop", "object-names", "out")
    asked = parse(Run, "run", command_run.__doc__, first=first)
    _run_stages(list(asked.inputs), _folder(asked.where, list(asked.inputs)), asked.settings, asked.where)


def command_demo() -> None:
    """Run one of the showcase scenes, end to end; needs no files, no key, no GPU.

    The first scene drops a rubber duck on mud. The scene is written to runs/<scene>/input/ as a GLB, and then run like
    any other.
    """
    from corporeal.pipeline.settings import Settings
    from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS, view_direction

    first = next(iter(SHOWCASE_SCENE_BUILDERS))

    @dataclass(frozen=True)
    class Demo:
        scene: tyro.conf.Positional[str] = first
        where: RunFolder = RunFolder()
        settings: Annotated[Settings, tyro.conf.arg(name="")] = field(default_factory=Settings)

    first_options = ("detail", "duration", "quality", "view", "name", "out")
    words = f"{command_demo.__doc__}\nScenes: {', '.join(SHOWCASE_SCENE_BUILDERS)}."
    asked = parse(Demo, "demo", words, first=first_options)
    from corporeal.pipeline.run_pipeline import write_cached_showcase

    where = replace(asked.where, name=asked.where.name or asked.scene)
    folder = where.out / where.name
    with console.status("building the scene"):
        path = write_cached_showcase(asked.scene, folder / "input")
    settings = asked.settings
    if settings.video.view is None:
        settings = replace(settings, video=replace(settings.video, view=view_direction(asked.scene)))
    _run_stages([path], folder, settings, where)


def command_status() -> None:
    """Show which stages of a run are finished, and the time that each took."""
    from corporeal.pipeline.run_pipeline import stage_states

    @dataclass(frozen=True)
    class Status:
        run: Folder

    rows = stage_states(parse(Status, "status", command_status.__doc__).run)
    show_table(
        ("verb", "state", "seconds"), [(r.verb, r.state, "" if r.seconds is None else f"{r.seconds:.1f}") for r in rows]
    )


def command_materials() -> None:
    """Show the measured library: `materials`, `materials show NAME`, `materials check FILE`."""
    from corporeal import materials

    @dataclass(frozen=True)
    class Menu:
        words: tyro.conf.Positional[tuple[str, ...]] = ()
        library: str = "default"
        """Material library: "default", "reference" (22 materials as first published, a baseline), or a TOML file."""

    asked = parse(Menu, "materials", command_materials.__doc__)
    if not asked.words:
        print(materials.list_materials(asked.library))
    elif asked.words[0] == "show" and len(asked.words) == 2:
        print(materials.describe_material(asked.words[1], asked.library))
    elif asked.words[0] == "check" and len(asked.words) == 2:
        problems = materials.check_library(Path(asked.words[1]))
        if problems:
            count = "one error" if len(problems) == 1 else f"{len(problems)} errors"
            lines = [f"{asked.words[1]} has {count}:", *map(str, problems)]
            raise UserError("\n  ".join(lines))
        print(f"{asked.words[1]}: no errors found.")
    else:
        raise UserError(f"Use `corporeal materials`, or one of: {'; '.join(MATERIAL_WORDS)}.")


def command_doctor() -> None:
    """Check engines, libraries, encoder and keys on this machine, with advice."""
    from corporeal.cli.doctor import check_installation

    parse(dataclass(frozen=True)(type("Doctor", (), {})), "doctor", command_doctor.__doc__)
    show_table(
        ("", "", "found", "advice"),
        [("✓" if f.works else "–", f.what, f.found, f.advice) for f in check_installation()],
    )


def _redo_command(verb: str) -> Callable[[], None]:
    def redo() -> None:
        from corporeal.pipeline.run_pipeline import Settings, read_run_request

        known = verb in Settings.__dataclass_fields__
        kept = read_run_request(Path(sys.argv[2])).settings if _names_a_run() else Settings()
        config: Any = getattr(kept, verb, None)

        @dataclass(frozen=True)
        class Redo:
            run: Folder

        shape = Redo
        if known:
            shape = dataclass(frozen=True)(
                type("Redo", (), {"__annotations__": {"run": Folder, "config": type(config)}, "config": config})
            )
        words = f"Redo `{verb}` of a run with other settings, and all later stages."
        asked = parse(shape, verb, words, first=FIRST_OPTIONS.get(verb, ()))
        before = read_run_request(asked.run)
        settings = before.settings
        if known:
            settings = replace(settings, **{verb: asked.config})
        _run_stages(before.inputs, asked.run, settings, RunFolder(), verb, again=True)

    redo.__doc__ = f"Redo `{verb}` of a run with other settings."
    return redo


def command_assemble() -> None:
    """Compose a scene at rest from a pool of models, or redo `assemble` of a run."""
    from corporeal.cli.assemble_command import compose_from_pool

    return _redo_command("assemble")() if _names_a_run() else compose_from_pool()


def command_simulate() -> None:
    """Redo `simulate` of a run with other settings, or over the ranges: --samples N.

    With --samples N an ensemble is simulated beside the run's own simulation: N sets of values are drawn from the
    measured ranges and the stated alternatives. ensemble.json and ensemble.png in the run's folder hold the spread of
    rebounds, dents and displacements.
    """
    from corporeal.pipeline.run_pipeline import read_run_request
    from corporeal.pipeline.stages.simulate import SimulateConfig

    known = read_run_request(Path(sys.argv[2])).settings.simulate if _names_a_run() else SimulateConfig()

    @dataclass(frozen=True)
    class Simulate:
        run: Folder
        samples: int | None = None
        """Number of ensemble members."""
        seed: int = 0
        """Seed of the ensemble."""
        config: SimulateConfig = known

    asked = parse(Simulate, "simulate", command_simulate.__doc__)
    if asked.samples is not None:
        return _spread(asked)
    before = read_run_request(asked.run)
    settings = replace(before.settings, simulate=asked.config)
    _run_stages(before.inputs, asked.run, settings, RunFolder(), "simulate", again=True)


def _spread(asked: Any) -> None:
    """Simulate an ensemble and print the spread of its outcomes."""
    from corporeal.lab.evaluation import outcome_ensemble
    from corporeal.lab.evaluation.outcome_ensemble import simulate_ensemble

    with progress_bars() as tell:
        result = simulate_ensemble(asked.run, asked.samples, asked.seed, asked.config, tell)
    show_table(outcome_ensemble.SPREAD_HEADS, outcome_ensemble.spread_rows(result))
    outcome_ensemble.spread_figure(result, asked.run / "ensemble.png")
    written = (asked.run / name for name in ("ensemble.json", "ensemble.png"))
    print(*outcome_ensemble.failed_members(result), *written, sep="\n")


def _names_a_run() -> bool:
    return len(sys.argv) > 2 and (Path(sys.argv[2]) / "run.json").exists()


COMMANDS: dict[str, Callable[[], None]] = {
    "demo": command_demo,
    "run": command_run,
    "view": command_view,
    "status": command_status,
    "materials": command_materials,
    "assets": command_assets,
    "capture": command_capture,
    "masks": command_masks,
    "export": command_export,
    "corpus": command_corpus,
    "evaluate": command_evaluate,
    "doctor": command_doctor,
}
FIRST_OPTIONS = {
    "reconstruct": ("object-names", "count", "up", "metres-per-unit", "training", "apart"),
    "assemble": ("drop", "lift", "velocity", "extent", "stack", "duration"),
    "describe": ("vlm", "annotations", "record", "critic", "views", "parallel"),
    "video": ("quality", "width", "height", "speed", "view", "colour-by"),
}
"""Options of a command that are listed first in its help."""
REDO_COMMANDS = ("reconstruct", "assemble", "describe", "segment", "ground", "fill", "simulate", "video")
REDO_COMMANDS = (*REDO_COMMANDS, "report")
COMMANDS |= {verb: _redo_command(verb) for verb in REDO_COMMANDS}
COMMANDS |= {"assemble": command_assemble, "simulate": command_simulate}


def _folder(where: RunFolder, inputs: list[Path]) -> Path:
    return where.out / (where.name or "-".join(map(_scene_name, inputs[:3])) or "scene")


def _scene_name(path: Path) -> str:
    """Return a scene's name: a file's own, but of the many that are scene.toml their folder's."""
    from corporeal.io.input_files import scene_name

    return path.resolve().parent.name if path.name == "scene.toml" else scene_name(path)


def _run_stages(
    inputs: list[Path], folder: Path, settings: Any, where: RunFolder, until: str = "report", again: bool = False
) -> None:
    """Run all stages up to ``until``; run ``again`` even if its settings are unchanged."""
    from corporeal.cli.validate_settings import validate_settings
    from corporeal.pipeline.run_pipeline import delete_simulation, invalidate_stage, run

    validate_settings(folder, settings)
    if again:
        invalidate_stage(folder, until)
    if not where.resume:
        delete_simulation(folder)
    with progress_bars() as tell:
        run(inputs, folder, settings, tell, until)
    if until == "report":
        show_summary(folder)
        print(folder / "report.html")
        print(folder / "video.mp4")
    else:
        print(f"{until} done. Go on with: corporeal report {quote(str(folder))}")


def _usage() -> str:
    lines = [f"corporeal {__version__}: measured materials for 3D scenes, and their simulation.", ""]
    for name, verb in COMMANDS.items():
        first = (verb.__doc__ or "").strip().splitlines()[0]
        lines.append(f"  corporeal {name:10} {first}")
    return "\n".join([*lines, "", "Options of a command: corporeal VERB --help"])


def main() -> None:
    """Run the command line; a user's error prints one line and exits with code 2."""
    verb = sys.argv[1] if len(sys.argv) > 1 else "--help"
    if verb in ("--help", "-h", "help"):
        print(_usage())
    elif verb == "--version":
        print(__version__)
    elif verb not in COMMANDS:
        sys.exit(_report_error(f"Unknown command {verb!r}. Choose one of: {', '.join(COMMANDS)}."))
    else:
        sys.exit(_run_command(COMMANDS[verb]))


def _run_command(verb: Callable[[], None]) -> int:
    """Return the exit code: 0, 1 for an internal error, 2 for a user's error, 130 if interrupted."""
    keep_freed_memory()
    relax_garbage_collection()
    try:
        verb()
        return 0
    except UserError as error:
        return _report_error(str(error), getattr(error, "__notes__", ()))
    except KeyboardInterrupt:
        _report_error("Stopped. Finished work is kept: the same command resumes from there.")
        return 130
    except BrokenPipeError:  # `corporeal materials | head`: the reader has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except MemoryError:
        return _report_error("Out of memory. Use --detail draft, or a smaller scene.")
    except Exception as error:  # an internal error: the details go to a file
        return _report_crash(error)


def _report_error(message: str, notes: Sequence[str] = ()) -> int:
    """Print an error in one line, and each earlier warning in a line."""
    print(f"corporeal: {message}", file=sys.stderr)
    for note in dict.fromkeys(notes):
        print(f"  Noticed before: {note}", file=sys.stderr)
    return 2


def _report_crash(error: Exception) -> int:
    path = Path("corporeal-crash.txt")
    path.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    print(
        f"corporeal: internal error ({type(error).__name__}: {error}). The details are in {path}; please report them.",
        file=sys.stderr,
    )
    return 1
