"""What a case found: its checks, and the row of the table."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Check:
    """One quantity held to its reference."""

    quantity: str
    """With its unit."""
    reference: float
    value: float
    error: float
    """Distance from the reference, in the unit of the target."""
    target: float
    """Largest error allowed."""
    unit: str = "%"
    """Of error and target: "%", "dx", or empty for ratios."""
    control: float | None = None
    """The same quantity where all bodies share one velocity field; None: it does not apply."""

    @property
    def met(self) -> bool:
        """Whether the error is within the target; a nan is not."""
        return bool(self.error <= self.target)


def relative(quantity: str, value: float, reference: float, percent: float, control: float | None = None) -> Check:
    """Hold a value to a reference within so many percent."""
    error = 100 * abs(value / reference - 1)
    return Check(quantity, reference, value, error, percent, "%", control)


def absolute(
    quantity: str, value: float, reference: float, margin: float, unit: str = "", control: float | None = None
) -> Check:
    """Hold a value to a reference within a margin."""
    return Check(quantity, reference, value, abs(value - reference), margin, unit, control)


def at_least(quantity: str, value: float, reference: float, least: float, control: float | None = None) -> Check:
    """Hold a value to a floor below its ideal reference; what lies above the ideal errs too."""
    return Check(quantity, reference, value, abs(reference - value), round(reference - least, 9), "", control)


@dataclass(frozen=True)
class Outcome:
    """What one case found."""

    case: str
    title: str
    setting: str
    """Resolution and what else a reader must know."""
    checks: tuple[Check, ...]
    seconds: float = 0.0

    @property
    def met(self) -> bool:
        """Whether every check is met."""
        return all(c.met for c in self.checks)

    @property
    def headline(self) -> Check:
        """The first check that is missed, or else the first."""
        return next((c for c in self.checks if not c.met), self.checks[0])

    def row(self) -> dict[str, Any]:
        """One row of the table: the headline, with all checks below it."""
        head = asdict(self.headline)
        return {
            "case": self.case,
            "title": self.title,
            "reference": head["reference"],
            "value": head["value"],
            "error": head["error"],
            "target": head["target"],
            "met": self.met,
            "control": head["control"],
            "unit": head["unit"],
            "quantity": head["quantity"],
            "setting": self.setting,
            "seconds": round(self.seconds, 1),
            "checks": [asdict(c) | {"met": c.met} for c in self.checks],
        }
