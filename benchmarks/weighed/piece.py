"""What a prop is built of: pieces with a volume, a density and a source; its mass is their sum."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Scene
from corporeal.showcase.prop_mesh import PropModel, PropPart
from corporeal.showcase.showcase_scenes import PlacedModel, scene_of_models

Profile = Float[np.ndarray, "N 2"]
"""Radius and height of a turned body, from its axis below to its axis above [m]."""


@dataclass(frozen=True)
class Piece:
    """One piece of one substance."""

    name: str
    volume: float
    """Of the substance itself [m³]."""
    density: float
    """[kg/m³]"""
    source: str
    """Where dimensions and density are from."""

    @property
    def mass(self) -> float:
        """How much it weighs [kg]."""
        return self.volume * self.density


@dataclass(frozen=True)
class Prop:
    """A thing as it is seen, and as it is built."""

    what: str
    """Its name, for whoever reads the results."""
    fill: str
    """solid, hollow or filled: whose errors are told apart."""
    seen: tuple[PropPart, ...]
    """Its outside."""
    built: tuple[Piece, ...]

    @property
    def mass(self) -> float:
        """How much all its pieces weigh [kg]."""
        return sum(p.mass for p in self.built)

    def scene(self, name: str) -> Scene:
        """Stand it on the floor under a neutral name; nothing in it says what it is made of."""
        model = PropModel(name, self.seen)
        model = model.moved((0, 0, -model.bounds()[0, 2]))
        made = scene_of_models(name, [model], [PlacedModel(name)], duration=1.0)
        surfaces = tuple(replace(s, name=f"surface {k}", extras={}) for k, s in enumerate(made.surfaces))
        finishes = tuple(replace(f, name=f"finish {k}") for k, f in enumerate(made.finishes))
        return replace(made, surfaces=surfaces, finishes=finishes)


def turned(profile: Profile) -> float:
    """Return the volume that a profile encloses when it is turned about its axis [m³].

    V = π/3 Σ (r₁² + r₁ r₂ + r₂²) (z₂ - z₁), a frustum per segment.
    """
    r, z = np.asarray(profile, float).T
    frusta = (r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) * np.diff(z)
    return float(np.pi / 3 * frusta.sum())


def swept(profile: Profile) -> float:
    """Return the area that a profile sweeps when it is turned about its axis [m²]."""
    r, z = np.asarray(profile, float).T
    return float(np.pi * ((r[:-1] + r[1:]) * np.hypot(np.diff(r), np.diff(z))).sum())


def inset(profile: Profile, wall: float) -> Profile:
    """Move a profile inwards by the thickness of a wall [m]; its ends stay on the axis."""
    p = np.asarray(profile, float)
    along = np.diff(p, axis=0)
    inwards = np.stack([-along[:, 1], along[:, 0]], 1)
    inwards /= np.linalg.norm(inwards, axis=1, keepdims=True)
    # Two walls meet where both are off by the wall: along the bisector, by 1 / cos of half the
    # angle between them. On the axis the mirrored wall is the other one.
    flipped = inwards * [-1, 1]
    before = np.concatenate([flipped[:1], inwards])
    after = np.concatenate([inwards, flipped[-1:]])
    both = before + after
    return p + wall * 2 * both / (both**2).sum(1, keepdims=True)


def below(profile: Profile, level: float) -> Profile:
    """Cut a profile off at a level [m] and close it there."""
    p = np.asarray(profile, float)
    above = int(np.argmax(p[:, 1] > level))
    a, b = p[above - 1], p[above]
    share = (level - a[1]) / (b[1] - a[1])
    edge = a + share * (b - a)
    return np.concatenate([p[:above], [edge, [0.0, level]]])
