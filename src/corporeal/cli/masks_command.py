"""`corporeal masks`: masks of photographs, grown from a point, a box, or what all look at."""

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

    Colours and edges decide in one photograph; the visual hull carries it to the others. Without
    a point and a box it begins at what all cameras look at. The masks are PNG pictures with the
    names of the photographs, to be looked at, corrected, and given to `corporeal run --masks`.
    """
    from corporeal.io.input_files import lacks_poses, scene_name
    from corporeal.io.photos.posed_photos import MASK_FOLDERS
    from corporeal.reconstruction.masks.grown_masks import grown_masks
    from corporeal.reconstruction.masks.mask_prompts import MaskPrompt

    @dataclass(frozen=True)
    class Masks:
        photographs: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PHOTOS")]
        at: tuple[float, float] | None = None
        """Column and row of a pixel on the object, in the photograph's own pixels."""
        box: tuple[float, float, float, float] | None = None
        """Left, upper, right and lower end of a box around the object [px]."""
        on: str = ""
        """Name of the photograph that --at or --box are of; by default the first."""
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
            f"{asked.photographs} has no poses, by which a mask is carried from one photograph to "
            f"the others. Let `corporeal run {quote(str(asked.photographs))}` find them, and go on "
            f"with `corporeal masks {quote(str(poses))}`."
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
            "What was pointed at was found in no place in space: the other photographs do not show "
            "its colours where their poses have it. Point at another place of it, in another "
            "photograph (--on), or at a part of one colour (--at)."
        )
    print(*made.said, *filter(None, [made.beside]), sep="\n")
    photographs, masks = quote(str(asked.photographs)), quote(str(out))
    print(
        f"Look at {out / MASK_FOLDERS[0]}. Go on with: corporeal run {photographs} --masks {masks}"
    )
