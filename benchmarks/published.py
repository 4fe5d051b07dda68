"""Weigh everyday things of published size and mass by their names alone: nobody is asked.

    python benchmarks/published.py [--second | --ware | --ware-meshes | --ware-second] [--rows]
                                   [--only NAME ...] [--held-rows]

The lists (recognition/published.toml, sixty things; --second: published_second.toml, forty of other
classes; --ware: ware.toml, 52 pieces of open ware, of which the outside is given, as photographs
show it; --ware-meshes: the same as meshes that fill their hollow) were written with sizes, masses
and sources before the program had weighed any of it, and were halved by a coin. ``--rows`` prints
the things of the open half, which rules may be mended by; of the other half only figures are
printed, unless ``--held-rows`` asks for its things, too, which ends its worth. Intervals are those
of ``evaluate mass``; their score is that of ln m.
"""

import argparse
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from names import Weighed, weigh
from recognition.shapes import shape

from corporeal.discretization.object_masses import warn_of_thick_walls
from corporeal.geometry.scene_transforms import scale_to_life_size
from corporeal.pipeline.mass_posterior import MassSampler, sample_masses
from corporeal.pipeline.settings import GroundConfig

FOLDER = Path(__file__).parent / "recognition"
LIST, SECOND = FOLDER / "published.toml", FOLDER / "published_second.toml"
WARE, MORE_WARE = FOLDER / "ware.toml", FOLDER / "ware_second.toml"
HALVES = ("open", "held")
DRAWS = 200
MISS = 20.0
"""What lying outside a 90 % interval costs in its score: 2/α per unit of the logarithm, α = .1."""
OFF, NEAR = 2.5, 1.5
"""Factors: a mass that is further off is implausible, and one that is nearer needs no warning."""


@dataclass(frozen=True)
class Found:
    """What came out of one thing."""

    name: str
    half: str
    true: float
    """Published mass [kg]."""
    mass: float
    """[kg]"""
    low: float
    high: float
    words: str
    known: bool
    """Its material is."""
    warned: bool
    """Something is said of its size, mass or wall."""

    @property
    def off(self) -> float:
        """Logarithm of found over published mass."""
        return log(self.mass / self.true)

    @property
    def score(self) -> float:
        """Interval score of ln m (Gneiting and Raftery 2007, JASA 102): the lower the better."""
        low, true, high = log(self.low), log(self.true), log(self.high)
        return high - low + MISS * (max(low - true, 0.0) + max(true - high, 0.0))

    @property
    def silent(self) -> bool:
        """Whether it is implausible, taken for known, and nothing is said."""
        return abs(self.off) > log(OFF) and self.known and not self.warned

    @property
    def false_alarm(self) -> bool:
        """Whether it is doubted although it weighs what is published."""
        return abs(self.off) < log(NEAR) and self.warned


def look_at(row: dict, folder: Path, from_pictures: bool = False) -> Found:
    """Take one thing of the list through the pipeline's functions by its name and shape."""
    mesh, path = shape(row["shape"]), folder / f"{row['name']}.glb"
    seen = weigh(mesh, path, from_pictures=from_pictures)
    words = seen.field.words[0]
    low, high = interval(seen)
    wall = warn_of_thick_walls(seen.scene, seen.anatomies, seen.makes, seen.field)
    built = f"{words.material or 'unknown'} {words.structure or 'solid'}"
    return Found(
        name=row["name"],
        half=row["half"],
        true=row["kg"],
        mass=sum(seen.masses),
        low=low,
        high=high,
        words=f"{built} of {words.contents}" if words.contents else built,
        known=words.material is not None,
        warned=bool(seen.size or seen.weight or wall),
    )


def interval(seen: Weighed) -> tuple[float, float]:
    """Return the bounds within which nine of ten draws from all ranges lie [kg]."""
    (thing,) = seen.inventory.objects
    described = replace(seen.inventory, objects=(replace(thing, parts=tuple(seen.field.words)),))
    scale = MassSampler(scale_to_life_size(seen.scene), seen.parts, GroundConfig(), 0)
    (mixture,) = sample_masses(scale, described, DRAWS).mixtures
    return mixture.low, mixture.high


def summary(found: Sequence[Found]) -> str:
    """Say how far masses are off, and whether it is said."""
    off = np.array([abs(f.off) for f in found])
    inside = sum(f.low <= f.true <= f.high for f in found)
    width = np.median([f.high / f.low for f in found])
    return (
        f"{len(found)} things: ALDE {off.mean():.3f}, median factor "
        f"{exp(float(np.median(off))):.2f}; within a factor of 1.5 "
        f"{(off <= log(1.5)).mean():.0%}, of 2 {(off <= log(2)).mean():.0%}; "
        f"inside the interval {inside / len(found):.0%}, its median width {width:.2f}, "
        f"score {np.mean([f.score for f in found]):.2f}; unknown "
        f"{sum(not f.known for f in found)}; off by more than {OFF:g} "
        f"{sum(abs(f.off) > log(OFF) for f in found)}, of these known and without a warning "
        f"{sum(f.silent for f in found)}; false alarms {sum(f.false_alarm for f in found)}"
    )


def main() -> None:
    """Weigh both halves and print what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--second", action="store_true", help="weigh the second list")
    which.add_argument("--ware", action="store_true", help="weigh open ware as from photographs")
    which.add_argument("--ware-meshes", action="store_true", help="weigh it as full meshes")
    which.add_argument("--ware-second", action="store_true", help="weigh more ware, as --ware")
    parser.add_argument("--rows", action="store_true", help="print the things of the open half")
    parser.add_argument("--held-rows", action="store_true", help="print those of the other, too")
    parser.add_argument("--only", nargs="+", help="these things of the open half alone")
    asked = parser.parse_args()
    listed = WARE if asked.ware or asked.ware_meshes else SECOND if asked.second else LIST
    listed = MORE_WARE if asked.ware_second else listed
    rows = tomllib.loads(listed.read_text(encoding="utf-8"))["things"]
    if asked.only:
        rows = [r for r in rows if r["name"] in asked.only and r["half"] == "open"]
    pictured = asked.ware or asked.ware_second
    with TemporaryDirectory() as folder:
        found = [look_at(row, Path(folder), pictured) for row in rows]
    shown = [h for h, asks in zip(HALVES, (asked.rows, asked.held_rows), strict=True) if asks]
    for one in sorted(found, key=lambda f: -abs(f.off)):
        if one.half in shown or asked.only:
            print(_line(one))
    for half in HALVES:
        mine = [f for f in found if f.half == half]
        if mine:
            print(f"{half}: {summary(mine)}")


def _line(one: Found) -> str:
    marks = " SILENT" * one.silent + " FALSE ALARM" * one.false_alarm + " warned" * one.warned
    inside = "inside" if one.low <= one.true <= one.high else ""
    return (
        f"{one.name:32} {one.words:38} {one.mass:9.3g} of {one.true:<7.3g} x {exp(one.off):<5.2f} "
        f"[{one.low:.3g}, {one.high:.3g}] {inside}{marks}"
    )


if __name__ == "__main__":
    main()
