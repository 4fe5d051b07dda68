"""`corporeal capture`: posed views of a scene, for reconstruction tools."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from corporeal.cli.parse import parse
from corporeal.core.terminal import progress_bars


def command_capture() -> None:
    """Render posed views of a scene: colour, depth, normals and object ids.

    SCENE is what `corporeal run` takes. The folder gets transforms.json, as instant-ngp and nerfstudio read it, and the
    pictures.
    """
    from corporeal.io.photos.transforms_json import write_views
    from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
    from corporeal.pipeline.stages.capture import CaptureConfig, capture

    @dataclass(frozen=True)
    class Capture:
        inputs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="SCENE ...")]
        out: Path = Path("views")
        """Output folder."""
        assemble: AssembleConfig = field(default_factory=AssembleConfig)
        capture: CaptureConfig = field(default_factory=CaptureConfig)

    first = ("views", "size", "drop", "stack", "extent", "out")
    asked = parse(Capture, "capture", command_capture.__doc__, first=first)
    with progress_bars() as tell:
        scene = assemble(list(asked.inputs), asked.assemble)
        views = capture(scene, asked.capture, tell("capture"))
        print(write_views(asked.out, views))
