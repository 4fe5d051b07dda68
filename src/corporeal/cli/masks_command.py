"""`corporeal masks`: masks of photographs, grown from a point, a box, or the cameras' common focus."""

from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Annotated

import tyro

from corporeal.cli.parse import parse
from corporeal.core.errors import UserError
from corporeal.core.terminal import progress_bars


def command_masks() -> None:
    """Grow masks of photographs with poses, from a point or a box in one of them.

    Segmentation in one photograph uses colours and edges; the visual hull propagates it to the others. Without a point
    or a box it begins at the cameras' common focus. The masks are PNG files with the names of the photographs; check
    and correct them, and give them to `corporeal run --masks`.
    """
    from corporeal.io.input_files import lacks_poses, scene_name
    from corporeal.io.photos.posed_photos import MASK_FOLDERS
    from corporeal.reconstruction.masks.grown_masks import grown_masks
    from corporeal.reconstruction.masks.mask_prompts import MaskPrompt

    @dataclass(frozen=True)
    class Masks:
        photographs: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PHOTOS")]
        at: tuple[float, float] | None = None
        """Column and row of a pixel on the object, in the photograph's pixels."""
        box: tuple[float, float, float, float] | None = None
        """Left, upper, right and lower edge of a box around the object [px]."""
        on: str = ""
        """Photograph that --at or --box refer to; by default the first."""
        out: Path | None = None
        """Folder of the masks; by default runs/masks/NAME."""

    asked = parse(Masks, "masks", command_masks.__doc__)
    if asked.at is not None and asked.box is not None:
        raise UserError("Give --at or --box, not both.")
    if not asked.photographs.exists():
        raise UserError(f"No such file: {asked.photographs}. Check the path.")
    if lacks_poses(asked.photographs):
        poses = Path("runs", scene_name(asked.photographs), "0-reconstruct", "poses")
        raise UserError(
            f"{asked.photographs} has no poses, which are needed to propagate a mask to the other "
            f"photographs. Find them with `corporeal run {quote(str(asked.photographs))}`, then "
            f"run `corporeal masks {quote(str(poses))}`."
        )
    pointed = None
    if asked.at is not None or asked.box is not None:
        pointed = MaskPrompt(asked.on, asked.at, asked.box)
    out = asked.out or Path("runs", "masks", scene_name(asked.photographs))
    with progress_bars() as tell:
        made = grown_masks(asked.photographs, out, pointed, tell("masks"))
    if made.folder is None:
        if pointed is None:
            raise UserError(f"{' '.join(made.said)} Point at the object with --at or --box.")
        raise UserError(
            "The selected object was not found in the other photographs: its colours do not appear "
            "where their poses place it. Select another point of it, in another photograph (--on), "
            "or a part of one colour (--at)."
        )
    print(*made.said, *filter(None, [made.beside]), sep="\n")
    photographs, masks = quote(str(asked.photographs)), quote(str(out))
    print(f"Check {out / MASK_FOLDERS[0]}. Next: corporeal run {photographs} --masks {masks}")
