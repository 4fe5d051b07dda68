"""Measure masks that are grown from photographs against masks that were drawn.

    python benchmarks/masks.py FOLDER ... [--pointed 6] [--json FILE]

FOLDER is a folder of posed photographs with masks, or one of such folders; ``as_photographed.py``
writes some. Masks are hidden, grown from what all cameras look at (*seen*), and, from so many
photographs in turn, from a point in the middle of what the drawn mask shows (*point*) and from a
box around it that is a twentieth larger (*box*). Printed are the intersections over union with the
drawn masks: the mean over views, and the worst view; how far outlines of the masks lie beyond
drawn ones, in pixels of pictures of 384; and why masks were doubted.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import binary_erosion, distance_transform_edt

from corporeal.core.errors import UserError
from corporeal.io.photos.posed_photos import has_posed_photos, read_posed_photos
from corporeal.reconstruction.masks.mask_prompts import PicturePrompt, seeds_from_prompt
from corporeal.reconstruction.masks.mask_quality import mask_doubt
from corporeal.reconstruction.masks.mask_seeds import MaskSeeds, seeds_from_cameras
from corporeal.reconstruction.masks.reduce_views import reduce_views
from corporeal.reconstruction.masks.region_growing import (
    MASK_PICTURE_PX,
    ROUND_PICTURE_PX,
    RegionGrowingResult,
    grow_masks,
)

ON = 128
"""Of 255: from here on a drawn mask shows an object."""
MARGIN = 0.05
"""Of a box's sides, beside what it is around."""
INNERMOST = 0.5
"""Quantile of the distance from the outline at which a person may point."""


def agreement(inside: np.ndarray, masks: np.ndarray) -> tuple[float, float]:
    """Return the intersection over union, in the mean and in the worst view."""
    made = inside > 0.5
    both, either = (made & masks).sum(axis=(1, 2)), (made | masks).sum(axis=(1, 2))
    share = both / np.maximum(either, 1)
    return float(share.mean()), float(share.min())


def beyond(inside: np.ndarray, masks: np.ndarray) -> float:
    """Return how far outlines lie outside drawn ones [px]; the median of each view, their mean."""
    far = []
    for made, drawn in zip(inside > 0.5, masks, strict=True):
        outline = made & ~binary_erosion(made)
        if outline.any() and drawn.any():
            within, without = distance_transform_edt(drawn), distance_transform_edt(~drawn)
            # Pixels of one and the same outline are 1 px within.
            far.append(np.median(np.where(drawn, 1 - within, without)[outline]))
    return float(np.mean(far)) if far else np.nan


def spots(mask: np.ndarray) -> dict[str, np.ndarray]:
    """Return where a person may point, and the box that they may draw, in a mask's pixels."""
    rows, columns = np.nonzero(mask)
    middle = np.array([np.median(columns), np.median(rows)])
    nearest = np.argmin(np.hypot(columns - middle[0], rows - middle[1]))
    low = np.array([columns.min(), rows.min()])
    high = np.array([columns.max() + 1, rows.max() + 1])
    room = MARGIN * (high - low)
    size = np.array(mask.shape[::-1]) - 1e-3
    return {
        "point": np.array([[columns[nearest] + 0.5, rows[nearest] + 0.5]]),
        "box": np.stack([np.maximum(low - room, 0), np.minimum(high + room, size)]),
    }


def measured(folder: Path, pointed: int) -> dict:
    """Measure one set."""
    shown, drawn = (read_posed_photos(folder, MASK_PICTURE_PX, bare=True), read_posed_photos(folder, MASK_PICTURE_PX))
    if drawn.masks is None or drawn.masks.shape != shown.views.rgb.shape[:3]:
        raise SystemExit(f"{folder} has no mask for each of its photographs.")
    masks = drawn.masks >= ON
    rough = reduce_views(shown.views, ROUND_PICTURE_PX)
    small = reduced_masks(masks, rough.rgb.shape[1:3])

    def grown(seeds: MaskSeeds) -> RegionGrowingResult | None:
        return grow_masks(shown.views, seeds)

    begun = time.perf_counter()
    seen = grown(seeds_from_cameras(rough, shown.points))
    row = {
        "set": folder.parent.name if folder.name == "views" else folder.name,
        "views": len(masks),
        "seen": None if seen is None else agreement(seen.inside, masks),
        "beyond": None if seen is None else beyond(seen.inside, masks),
        "doubt": mask_doubt(seen),
        "seconds": time.perf_counter() - begun,
        "point": [],
        "box": [],
    }
    for k in np.linspace(0, len(masks) - 1, min(pointed, len(masks))).round().astype(int):
        for how, corners in spots(small[k]).items():
            try:
                found = grown(seeds_from_prompt(rough, shown.points, PicturePrompt(int(k), corners)))
            except UserError:
                found = None
            row[how].append((0.0, 0.0) if found is None else agreement(found.inside, masks))
    return row


def reduced_masks(masks: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return masks at another size, by their nearest pixels."""
    rows = (np.arange(size[0]) + 0.5) * masks.shape[1] / size[0]
    columns = (np.arange(size[1]) + 0.5) * masks.shape[2] / size[1]
    return masks[:, rows.astype(int)][:, :, columns.astype(int)]


def table(rows: list[dict]) -> str:
    """Write the rows as Markdown."""
    heads = ("set", "views", "seen: mean", "worst", "beyond [px]", "believed")
    heads = (*heads, "point: median, worst", "box")
    lines = ["| " + " | ".join(heads) + " |", "|---|---:|---:|---:|---:|---|---|---|"]
    for row in rows:
        cells = [row["set"], str(row["views"])]
        cells += ["–", "–"] if row["seen"] is None else [f"{n:.3f}" for n in row["seen"]]
        cells.append("–" if row["beyond"] is None else f"{row['beyond']:+.2f}")
        cells.append("yes" if row["doubt"] is None else f"no: {row['doubt']}")
        for how in ("point", "box"):
            means = [mean for mean, _ in row[how]]
            cells.append(f"{np.median(means):.3f}, {min(means):.3f}" if means else "–")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Measure every set that is named."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("folders", type=Path, nargs="+")
    asked.add_argument("--pointed", type=int, default=6)
    asked.add_argument("--json", type=Path)
    given = asked.parse_args()
    folders = ([f] if has_posed_photos(f) else sorted(f.iterdir()) for f in given.folders)
    sets = [folder for some in folders for folder in some]
    rows = []
    for folder in sets:
        rows.append(measured(folder, given.pointed))
        print(table(rows[-1:]).splitlines()[-1], flush=True)
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
