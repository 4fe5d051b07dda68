"""Attributes of parts in descriptions, matched to points without a model.

Three properties that words say and points show: colour, height, and whether it is long and thin. What words leave open
counts against no cluster, but neither for it: a name that says "green" gets what is green, and a name that says nothing
of colour gets what no other name explains.
"""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array, eye_array
from scipy.spatial import KDTree
from skimage.color import rgb2lab

from corporeal.core.types import FeatureCloud, PartDescription

UP_VECTOR = np.array([0.0, 0.0, 1.0])
"""Height of the top of what is upright."""
COLOUR_SIGMA_LAB = 15.0
"""Standard deviation of what is seen of a named colour in full light [CIELAB]."""
BLACK_LAB_OFFSET = np.array([16.0, 0.0, 0.0])
"""Measured from here light scales CIELAB as a whole: L + 16, a and b go with its cube root."""
SHADE_SIGMA = 0.3
"""Standard deviation of that scale."""
SHADE_RANGE = (0.5, 1.3)
"""Least and greatest: an eighth of the light, and twice."""
FADE_SIGMA, FADE_RANGE = 0.5, (0.5, 1.2)
"""The same of how colourful what goes by a colour's name is: from faded to full."""
HEIGHT_SIGMA_FRACTION = 0.12
"""Standard deviation of heights beyond those a word says, as a share of the object's height."""
THINNESS_SIGMA = 0.35
"""Standard deviation of how long and thin, from 0 to 1."""
UNSAID_SIGMAS = 1.5
"""What a word does not say counts as so many standard deviations off."""
MAX_SIGMAS = 4.0
"""Nothing counts as further off: words are as often wrong as that."""
MIN_LYING_SINE = 0.7
"""Least sine of the angle between an object's longest axis and the vertical where it may lie."""
MIN_LYING_LOG_GAIN = 0.1
"""Words must be so much likelier of an object that lies, in the mean over its points."""
SMALL_PART_PENALTY = 1.5
"""How much less likely any patch is a small part's."""
THINNESS_SAMPLE_POINTS = 8000
"""Points that thinness is measured on."""
THINNESS_RADIUS_FRACTION = 0.05
"""Radius of what is looked at for it, as a share of the object's diagonal."""
DARKER_LIGHTNESS_FACTOR, LIGHTER_LIGHTNESS_FACTOR = 0.6, 1.3
"""What "dark" and "light" do to lightness."""


@dataclass(frozen=True)
class DescribedAttributes:
    """What words say of one part."""

    colours: Float[np.ndarray, "S 3"]
    """CIELAB; empty: they do not say."""
    heights: tuple[float, float] | None
    """Share of the object's height, from and to."""
    thin: float | None
    """1: long and thin, 0: not."""
    small: bool = False
    """Whether it is a small object: a bulb, a button."""


@dataclass(frozen=True)
class ObservedAttributes:
    """What C clusters look like."""

    colour: Float[np.ndarray, "C 3"]
    """Median, CIELAB."""
    height: Float[np.ndarray, " C"]
    """Mean share of the object's height, from its foot to its top."""
    thin: Float[np.ndarray, " C"]
    """Mean of 1 - λ₂/λ₁ of what is near each point."""


def described_attributes(part: PartDescription) -> DescribedAttributes:
    """Read a part's name and its material's.

    A colour that the name states decides; without one it is that of the substances it names, and without those that of
    the material.
    """
    name, material = _words_of_name(part.name), _words_of_name(part.material or "")
    small = bool(set(name) & _attribute_table()["small"]["words"])
    return DescribedAttributes(_named_colours(name, material), _named_heights(name), _named_thinness(name), small)


def observed_attributes(
    cloud: FeatureCloud, cluster_of_point: Int[np.ndarray, " N"], count: int, up: np.ndarray = UP_VECTOR
) -> ObservedAttributes:
    """Measure clusters; each must have points."""
    seen = rgb2lab(np.clip(cloud.colour, 0, 1)[None])[0]
    thin = _thinness(cloud.position)
    rows = [np.flatnonzero(cluster_of_point == c) for c in range(count)]
    return ObservedAttributes(
        colour=np.array([np.median(seen[r], axis=0) for r in rows]).reshape(-1, 3),
        height=_means(relative_heights(cloud.position, up), cluster_of_point, count),
        thin=np.array([thin[r].mean() for r in rows]),
    )


def relative_heights(position: Float[np.ndarray, "N 3"], up: np.ndarray = UP_VECTOR) -> Float[np.ndarray, " N"]:
    """Return how high each point is, as a share of the object's height."""
    z = position @ up
    return (z - z.min()) / (np.ptp(z) or 1.0)


def _means(rows: np.ndarray, group: np.ndarray, count: int) -> np.ndarray:
    return np.bincount(group, rows, minlength=count) / np.bincount(group, minlength=count)


def top_direction(
    cloud: FeatureCloud, cluster_of_point: Int[np.ndarray, " N"], count: int, parsed: Sequence[DescribedAttributes]
) -> Float[np.ndarray, "3"]:
    """Return where an object's top is: up, but in a long object that lies, where words fit better.

    Of something that has fallen over along its longest axis they say most when heights are measured along it. They have
    to be likelier by ``MIN_LYING_LOG_GAIN`` in the mean over points.
    """
    local = cloud.position - cloud.position.mean(axis=0)
    axis = np.linalg.eigh(local.T @ local)[1][:, 2]
    if np.hypot(*axis[:2]) < MIN_LYING_SINE:
        return UP_VECTOR
    seen = observed_attributes(cloud, cluster_of_point, count)
    share = np.bincount(cluster_of_point, minlength=count) / cloud.count

    def fit(up: np.ndarray) -> float:
        along = _means(relative_heights(cloud.position, up), cluster_of_point, count)
        return float(share @ log_likelihood(replace(seen, height=along), parsed).max(axis=1))

    best = max((axis, -axis), key=fit)
    return best if fit(best) > fit(UP_VECTOR) + MIN_LYING_LOG_GAIN else UP_VECTOR


def log_likelihood(seen: ObservedAttributes, parsed: Sequence[DescribedAttributes]) -> Float[np.ndarray, "C K"]:
    """Return how well each cluster fits each description, up to a constant.

    -½ Σ (deviation / σ)² over colour, height and thinness, each at most ``MAX_SIGMAS`` σ, and ``UNSAID_SIGMAS`` σ where
    words do not say; less ``SMALL_PART_PENALTY`` for what is small.
    """
    made = np.empty((len(seen.height), len(parsed)))
    for k, part in enumerate(parsed):
        off = np.stack([_colour_misfit(seen, part), _height_misfit(seen, part), _thinness_misfit(seen, part)])
        made[:, k] = -0.5 * np.sum(np.minimum(off, MAX_SIGMAS) ** 2, axis=0) - SMALL_PART_PENALTY * part.small
    return made


def _colour_misfit(seen: ObservedAttributes, part: DescribedAttributes) -> np.ndarray:
    if not len(part.colours):
        return np.full(len(seen.height), UNSAID_SIGMAS)
    v, r = seen.colour[:, None] + BLACK_LAB_OFFSET, part.colours[None] + BLACK_LAB_OFFSET
    shade = np.clip(_best_scale(v, r), *SHADE_RANGE)
    lit = shade[..., None] * r
    faded = np.clip(_best_scale(v[..., 1:], lit[..., 1:]), *FADE_RANGE)
    lit[..., 1:] *= faded[..., None]
    hue = np.linalg.norm(v - lit, axis=2) / COLOUR_SIGMA_LAB
    off = np.sqrt(hue**2 + ((1 - shade) / SHADE_SIGMA) ** 2 + ((1 - faded) / FADE_SIGMA) ** 2)
    return off.min(axis=1)


def _best_scale(v: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return how many r make the most of v; 1 where r is nothing."""
    length = (r * r).sum(axis=2)
    return np.where(length > 1, (v * r).sum(axis=2) / np.maximum(length, 1), 1.0)


def _height_misfit(seen: ObservedAttributes, part: DescribedAttributes) -> np.ndarray:
    if part.heights is None:
        return np.full(len(seen.height), UNSAID_SIGMAS)
    low, high = part.heights
    return np.maximum(np.maximum(low - seen.height, seen.height - high), 0) / HEIGHT_SIGMA_FRACTION


def _thinness_misfit(seen: ObservedAttributes, part: DescribedAttributes) -> np.ndarray:
    if part.thin is None:
        return np.full(len(seen.height), UNSAID_SIGMAS / 2)
    return np.abs(seen.thin - part.thin) / THINNESS_SIGMA


def _thinness(position: np.ndarray) -> np.ndarray:
    """Return 1 - λ₂/λ₁ of the spread of the points about each: 1 on a wire, 0 on a plate."""
    some = position[:: max(1, -(-len(position) // THINNESS_SAMPLE_POINTS))]
    local = some - some.mean(axis=0)
    radius = THINNESS_RADIUS_FRACTION * float(np.linalg.norm(np.ptp(position, axis=0)))
    tree = KDTree(some)
    a, b = tree.query_pairs(radius, output_type="ndarray").T
    pairs = csr_array((np.ones(len(a)), (a, b)), shape=(len(some), len(some)))
    near = pairs + pairs.T + eye_array(len(some))
    size = near.sum(axis=1)
    mean = (near @ local) / size[:, None]
    squares = (local[:, :, None] * local[:, None]).reshape(-1, 9)
    spread = ((near @ squares) / size[:, None]).reshape(-1, 3, 3)
    # About the point itself: about the mean, the rim of a plate would look like a wire.
    mixed = mean[:, :, None] * local[:, None]
    spread += local[:, :, None] * local[:, None] - mixed - mixed.swapaxes(1, 2)
    values = np.linalg.eigvalsh(spread)
    thin = 1 - values[:, 1] / np.maximum(values[:, 2], 1e-300)
    return np.where(size > 3, thin, 0.0)[tree.query(position)[1]]


def _words_of_name(name: str) -> list[str]:
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return [_singular_word(w) for w in re.findall("[a-z]+", spaced.lower())]


def _singular_word(word: str) -> str:
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word


def _named_colours(name: list[str], material: list[str]) -> np.ndarray:
    table = _attribute_table()
    found = [c for w in name for c in table["colour"].get(w, ())]
    for words in (name, material):
        if not found:
            rows = [row for row in table["substance"] if set(words) & row["words"]]
            found = [c for row in rows for c in row["colours"]]
    if not found:
        return np.zeros((0, 3))
    srgb = [[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in found]
    lab = rgb2lab(np.array(srgb)[None])[0]
    lab[:, 0] *= DARKER_LIGHTNESS_FACTOR if "dark" in name else LIGHTER_LIGHTNESS_FACTOR if "light" in name else 1.0
    lab[:, 0] = np.minimum(lab[:, 0], 100.0)
    return lab


def _named_heights(name: list[str]) -> tuple[float, float] | None:
    """Return where parts of all these names are together, from and to."""
    rows = [row for w in name for row in _attribute_table()["place"] if w in row["words"]]
    return (min(r["low"] for r in rows), max(r["high"] for r in rows)) if rows else None


def _named_thinness(name: list[str]) -> float | None:
    rows = [row for w in reversed(name) for row in _attribute_table()["form"] if w in row["words"]]
    return rows[0]["thin"] if rows else None


@cache
def _attribute_table() -> dict:
    text = files("corporeal.reconstruction.segment").joinpath("attributes.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    rows = [*table["substance"], *table["place"], *table["form"], table["small"]]
    for row in rows:
        row["words"] = frozenset(map(_singular_word, row["words"]))
    return table
