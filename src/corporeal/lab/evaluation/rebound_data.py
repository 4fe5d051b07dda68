"""Published rebounds of real objects, from ``life.toml``."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import exp, pi, sqrt

from corporeal.core.errors import BadFileError
from corporeal.core.types import GRAVITY_M_S2

AIR_DENSITY_KG_M3 = 1.2
"""Density of air [kg/m³]."""
SPHERE_DRAG_COEFFICIENT = 0.47
"""Drag coefficient of a smooth sphere at Reynolds numbers from 1e3 to 2e5 (Achenbach 1972) [-]."""


@dataclass(frozen=True)
class StruckBlock:
    """What an object is dropped on, where it is not the floor."""

    material: str
    size: tuple[float, float, float]
    """[m]"""


@dataclass(frozen=True)
class MeasuredRebound:
    """One ball that was dropped, and the range in which it came back."""

    name: str
    material: str | None
    """None: its name has to tell it."""
    wall: float | None
    """Thickness of its wall [m]; None: solid, or its name has to tell it."""
    inflation: float | None
    """Gauge pressure of the air in it [Pa]."""
    diameter: float
    """[m]"""
    speed: float
    """At which it strikes [m/s]."""
    floor: str
    on: StruckBlock | None
    low: float
    """Least published restitution [-]."""
    high: float
    """Greatest [-]."""
    source: str
    """Key of ``rebound_sources``."""
    blind: bool = False
    """Whether it was written down before it was tried for the first time."""
    scene: str = ""
    """Name of a measurement that several rows repeat, the same objects; "": none."""

    def off(self, restitution: float) -> float:
        """Return how far a restitution is from the range [-]; 0 in it."""
        return max(self.low - restitution, restitution - self.high, 0.0)


@cache
def _table() -> dict:
    place = files("corporeal.lab.evaluation").joinpath("life.toml")
    return tomllib.loads(place.read_text(encoding="utf-8"))


def rebound_sources() -> dict[str, str]:
    """Return every source's citation by its key, with what was read of it."""
    return {key: f"{row['cite']} ({row['check']})" for key, row in _table()["source"].items()}


def measured_rebounds() -> tuple[MeasuredRebound, ...]:
    """Return all published rebounds.

    Raises:
        BadFileError: A range is none, or its source is missing.
    """
    return tuple(_rebound(row) for row in _table()["rebound"])


def _rebound(row: dict) -> MeasuredRebound:
    air = _AirDrag(1e-3 * row["diameter_mm"], 1e-3 * row["mass_g"] if "mass_g" in row else None)
    speed = air.struck_at(row["drop_m"])
    low, high = row["e"] if "e" in row else (air.left_at(rise) / speed for rise in row["rise_m"])
    if not 0.0 <= low < high <= 1.0 or row["source"] not in _table()["source"]:
        raise BadFileError("life.toml", f"{row['name']}: no range with a source.", "Mend the row.")
    on, wall, pressure = row.get("on"), row.get("wall_mm"), row.get("inflation_kPa")
    x, y, z = (1e-3 * side for side in on["size_mm"]) if on else (0.0, 0.0, 0.0)
    return MeasuredRebound(
        name=row["name"],
        material=row.get("material"),
        wall=None if wall is None else 1e-3 * wall,
        inflation=None if pressure is None else 1e3 * pressure,
        diameter=1e-3 * row["diameter_mm"],
        speed=speed,
        floor=row.get("floor", "concrete"),
        on=StruckBlock(on["material"], (x, y, z)) if on else None,
        low=low,
        high=high,
        source=row["source"],
        blind=row.get("blind", False),
        scene=row.get("scene", ""),
    )


@dataclass(frozen=True)
class _AirDrag:
    """What air does to a ball that falls and rises: d(v²)/dh = ±2 g (1 ± v²/v_t²)."""

    diameter: float
    """[m]"""
    mass: float | None
    """[kg]; None: as in a vacuum."""

    @property
    def terminal(self) -> float:
        """Square of the speed at which drag bears the weight, v_t² = 2 m g/(ρ c A) [m²/s²]."""
        area = 0.25 * pi * self.diameter**2
        return 2.0 * (self.mass or 0.0) * GRAVITY_M_S2 / (AIR_DENSITY_KG_M3 * SPHERE_DRAG_COEFFICIENT * area)

    def struck_at(self, height: float) -> float:
        """Speed after a fall from rest [m/s]."""
        free = 2.0 * GRAVITY_M_S2 * height
        if self.mass is None:
            return sqrt(free)
        return sqrt(self.terminal * (1.0 - exp(-free / self.terminal)))

    def left_at(self, height: float) -> float:
        """Speed with which it rises so high [m/s]."""
        free = 2.0 * GRAVITY_M_S2 * height
        if self.mass is None:
            return sqrt(free)
        return sqrt(self.terminal * (exp(free / self.terminal) - 1.0))
