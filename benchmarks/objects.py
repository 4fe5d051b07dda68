"""Tell things apart that touch: settled pairs of real models, in three ways side by side.

    python benchmarks/objects.py MODELS ... [--out runs/objects] [--gaussians] [--docs]

MODELS are folders of models, or a pool that ``corporeal assets index`` made of them; the pairs are
composed from them by ``corporeal assemble``, by name. Points are spread over what 24 pictures show;
with ``--gaussians`` the means of Gaussians that are learned from the pictures are told apart, too
(minutes each). What lies in ``--out`` already is not composed, learned or judged again. ``--docs``
writes docs/reference/object-separation-benchmark.md and its figure.
"""

import argparse
import pickle
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from segmentation.objects_evaluation import (
    ObjectsEvaluationConfig,
    ObjectsResult,
    ObjectsRow,
    evaluate_objects,
)
from segmentation.objects_figure import draw_objects

from corporeal.core.deserialize import from_plain
from corporeal.core.store import read_json, write_json
from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.object_segmentation import segment_objects

DOCS = Path(__file__).parents[1] / "docs"
PAIRS = {
    "ball_box": ("onto", 1, "cardboard_box_gazebo", "ball_smallhouse"),
    "can_vase": ("row", 1, "soda_can_coke", "vase_smallhouse"),
    "ball_chair": ("onto", 1, "chair_smallhouse_a", "ball_smallhouse"),
    "duck_couch": ("onto", 1, "couch_smallhouse", "duck_khronos"),
    "twins": ("row", 1, "013_apple", "013_apple"),
}
STACKS = {
    "sponge_packet": ("stack", 1, "026_sponge", "009_gelatin_box"),
    "two_sponges": ("stack", 1, "026_sponge", "026_sponge"),
    "three_packets": ("stack", 1, "009_gelatin_box", "009_gelatin_box", "009_gelatin_box"),
}
MORE = {
    "teddy_couch": ("onto", 1, "couch_smallhouse", "teddy_bullet_notex"),
    "duck_armchair": ("onto", 1, "armchair_kaolin", "duck_khronos"),
    "duck_block": ("onto", 2, "cinder_block_gazebo", "duck_khronos"),
    "bottle_box": ("row", 2, "006_mustard_bottle", "004_sugar_box"),
    "cat_table": ("onto", 2, "table_polyhaven", "cat_statue_playcanvas"),
    "plant_bin": ("row", 2, "plant_potted_market", "trash_can_smallhouse"),
    "softballs": ("row", 2, "054_softball", "054_softball"),
    "lamp_armchair": ("row", 2, "lamp_barn_khronos", "armchair_kaolin"),
    "two_cans": ("stack", 2, "005_tomato_soup_can", "005_tomato_soup_can"),
    "bowl_avocado": ("onto", 2, "024_bowl", "avocado_khronos"),
}
SIZES = ((100_000, 768), (500_000, 768))
"""Points and channels of what is timed."""


def composed(models: list[Path], out: Path) -> None:
    """Compose all scenes that are not there."""
    pool = models
    if not (len(models) == 1 and (models[0] / "pool.json").exists()):
        pool = [out / "pool"]
        command = ["assets", "index", "--pool", str(pool[0]), *map(str, models)]
        subprocess.run([sys.executable, "-m", "corporeal.cli", *command], check=True)
    for name, (arrangement, seed, *assets) in (PAIRS | STACKS | MORE).items():
        if (out / "scenes" / name / "scene.toml").exists():
            continue
        command = ["assemble", "--from", str(pool[0]), "--out", str(out / "scenes")]
        command += ["--name", name, "--seed", str(seed), "--arrangement", arrangement]
        command += ["--interaction", "none", "--views", "2", "--assets", *assets]
        subprocess.run([sys.executable, "-m", "corporeal.cli", *command], check=True)


def segmented(out: Path, names: list[str], gaussians: bool) -> list[ObjectsResult]:
    """Judge scenes one after the other; what was judged before is kept."""
    source = "gaussians" if gaussians else "surface"
    config = ObjectsEvaluationConfig(points_from=source, kept=out / "gaussians")
    found: list[ObjectsResult] = []
    for name in names:
        path = out / source / f"{name}.pickle"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(pickle.dumps(evaluate_objects(out / "scenes" / name, config)[0]))
        found.append(pickle.loads(path.read_bytes()))
        print(line(found[-1].row), flush=True)
    return found


@dataclass(frozen=True)
class Timing:
    """What segmenting so many points took."""

    points: int
    cpu_s: float
    clock_s: float
    peak_gb: float


@dataclass(frozen=True)
class Timings:
    """As kept in ``times.json``."""

    rows: tuple[Timing, ...]


def timed() -> Timings:
    """Tell four balls in a heap apart by features of 768 numbers: seconds, and the memory."""
    made = []
    for count, depth in SIZES:
        rng = np.random.default_rng(0)
        centres = np.array([[0, 0, 0.3], [0.6, 0, 0.3], [0.3, 0.52, 0.3], [0.3, 0.17, 0.79]])
        owner, normal = rng.integers(0, 4, count), rng.normal(size=(count, 3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        looks = rng.normal(size=(4, depth)).astype(np.float32)
        feature = np.empty((count, depth), np.float16)
        for k in range(0, count, 10_000):
            rows = looks[owner[k : k + 10_000]]
            rows = rows + rng.normal(size=rows.shape)
            feature[k : k + 10_000] = rows / np.linalg.norm(rows, axis=1, keepdims=True)
        position = centres[owner] + 0.3 * normal
        cloud = FeatureCloud(position, 0 * position + 0.5, feature, feature, np.ones(count, int))
        clock, spent = time.perf_counter(), time.process_time()
        segment_objects(cloud, 4, normal)
        spent, clock = time.process_time() - spent, time.perf_counter() - clock
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        made.append(Timing(count, spent, clock, peak))
        print(made[-1], flush=True)
    return Timings(tuple(made))


HEAD = "| scene | points | identity | ours | warned | with masks | not counted | components |"


def line(row: ObjectsRow) -> str:
    """Set one scene as a row of a table."""
    uncounted = f"{row.uncounted:.2f} ({row.counted})"
    cells = (row.identity, row.ours, "yes" if row.warnings else "", row.with_masks, uncounted)
    text = [f"{c:.2f}" if isinstance(c, float) else c for c in (*cells, row.components)]
    return f"| {row.scene.replace('_', ' ')} | {row.points} | {' | '.join(text)} |"


def table(rows: list[ObjectsRow]) -> str:
    """Set scenes as Markdown."""
    return "\n".join([HEAD, "|---|---:|---:|---:|---|---:|---:|---:|", *map(line, rows)])


def main() -> None:
    """Compose, judge, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, default=Path("runs/objects"))
    parser.add_argument("--gaussians", action="store_true", help="learn Gaussians of the pairs")
    parser.add_argument("--docs", action="store_true", help="write the page of results")
    asked = parser.parse_args()
    composed(asked.models, asked.out)
    shown = segmented(asked.out, list(PAIRS) + list(STACKS), gaussians=False)
    learned = segmented(asked.out, list(PAIRS) if asked.gaussians else [], gaussians=True)
    more = segmented(asked.out, list(MORE), gaussians=False)
    tables = {
        "surface": table([j.row for j in shown if j.row.scene in PAIRS]),
        "stacks": table([j.row for j in shown if j.row.scene in STACKS]),
        "more": table([j.row for j in more]),
        "gaussians": table([j.row for j in learned]),
    }
    times = asked.out / "times.json"
    if not times.exists():
        write_json(times, timed())
    if asked.docs:
        draw_objects(shown, DOCS / "images" / "objects.png")
        costs = (
            f"{t.points // 1000}k points: {t.cpu_s:.0f} s, {t.peak_gb:.1f} GB"
            for t in from_plain(Timings, read_json(times)).rows
        )
        words = PAGE
        for name, text in (tables | {"times": "; ".join(costs)}).items():
            words = words.replace(f"{{{name}}}", text)
        (DOCS / "reference" / "object-separation-benchmark.md").write_text(words, encoding="utf-8")


PAGE = """# Object separation benchmark

Settled objects touch, so that distance alone does not separate them. The methods are explained in
[surfaces from Gaussians](../explanation/surfaces-from-gaussians-and-segmentation.md#objects):

| method | needs |
|---|---|
| identity | a model's nodes, a settled scene, or numbers per pixel: exact by construction |
| appearance and concavity | points with features; better with normals and the number of objects |
| the same with instance masks | masks on views; instance numbers need not agree between views |
| `components` | points; the published rule (20 nearest, connected components), for comparison |

**Warnings** are given where a different cut costs less than 1.3 times as much, or where an object
is thin (less than a third as high as wide) and lies on or under another: provide instance masks, or
check the result.

## Results

Written by `python benchmarks/objects.py objects/ ycb/ --gaussians --docs` on 27 November 2026.
Pairs are composed from public models with `corporeal assemble`; objects side by side are pushed
until they touch. Points lie on the surface seen in 24 pictures of 256², colours come from the
pictures, and features are the [descriptor](../how-to/use-image-features.md), which needs no
weights. Numbers are the mean IoU of objects after Hungarian matching. "Ours" is given the number of
objects; "not counted" estimates it (in brackets). Masks are exact, numbered anew in each view.
`python benchmarks/objects_of_scenes.py SCENES` does the same for any settled scenes.

{surface}

![Points of the pairs: colours, true instances, found instances](../images/objects.png)

Stacks of thin objects, which warn:

{stacks}

Other pairs. Constants were chosen with most of these scenes in view, so that no figure on this page
is of a held-out scene:

{more}

Points that are means of Gaussians learned from the same pictures (`draft`, one mask for all objects
together):

{gaussians}

- **Can and vase by Gaussians**: 1.00 in seven of seven draws of 98 % of the Gaussians; where the
  number is not given, five of seven count 5 objects (.91).
- **Teddy on couch** fails: both are off-white without texture, and the couch is made of loose
  cushions. **Cat on table** is borderline: the cat nearly covers the table's width. **Duck on
  armchair** fails: cushions differ more from the frame than from the duck. Instance masks resolve
  all three; two of them warn.
- **Pairs that warn are not reproducible.** With 19,000 to 22,000 points (`python
  benchmarks/objects_of_scenes.py SCENES --surface-points N`) three packets are separated with .39
  to .99, cat on table with .33 to .51, duck on armchair with .34 to .48. Ball on box, which does
  not warn, keeps .98 to .99, but is counted as 2 to 4 objects where their number is not given.
- **Normals** matter. Without them they are estimated from the points and oriented upwards at the
  highest point, which is much worse for some pairs (bottle beside box, cat on table).
- **No number here comes from learned features.** CLIP features separate by what objects are; how
  much better that is must be measured with the weights.

## Speed

Four balls in a heap, 768 channels in half precision; CPU seconds and the process's peak memory,
features included: {times}."""


if __name__ == "__main__":
    main()
