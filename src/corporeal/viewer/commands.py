"""Validated commands of a page to a live simulation."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from corporeal.core.errors import UserError
from corporeal.core.types import Vector

MAX_POINT_M = 100.0
"""Of a point that is pulled to [m]."""
MIN_GRIP_FREQUENCY_HZ, MAX_GRIP_FREQUENCY_HZ = 0.5, 10.0
"""Natural frequency of what hangs on the hand [Hz]."""
MAX_GRAVITY_M_S2 = 25.0
"""Gravity [m/s²]."""
MAX_WIND_M_S = 40.0
"""Wind [m/s]."""
MAX_COMMAND_BYTES = 4096
"""Of one order [bytes]."""
MAX_COMMANDS_PER_SECOND = 200
MAX_NAME_CHARACTERS = 300
"""Of an object [letters]."""
COMMAND_KINDS = ("grab", "pull", "drop", "gravity", "wind", "play", "pause", "step", "reset", "contact")
COMMAND_KINDS += ("add",)


@dataclass(frozen=True, slots=True)
class Command:
    """One order; what its kind does not need is 0."""

    do: str
    seq: int = 0
    """The page's number of it, sent back with the pictures that show it."""
    object: int = 0
    point: Vector = (0.0, 0.0, 0.0)
    """Where an object is taken; what is pointed at, or in a record the middle of the underside of an object that is
    added [m].
    """
    to: Vector = (0.0, 0.0, 0.0)
    """Where it is pulled [m]; gravity [m/s²]; wind [m/s]; in its last place, how high above all that is under it an
    object that is added begins [m].
    """
    firm: float = 4.0
    """Natural frequency on the hand's spring [Hz]."""
    single: bool = False
    """One velocity field for all: the control."""
    twin: bool = False
    """The control runs beside: the same touches, one velocity field for all."""
    thing: str = ""
    """What is added: see ``Things``."""


def parse_command(text: str) -> Command:
    """Read an order.

    Raises:
        UserError: It is not in the table, or a number is not finite.
    """
    if len(text) > MAX_COMMAND_BYTES:
        raise UserError("An order is too long.")
    try:
        asked = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise UserError("An order is no JSON.") from error
    if not isinstance(asked, dict) or asked.get("do") not in COMMAND_KINDS:
        raise UserError(f"Unknown order. Choose one of: {', '.join(COMMAND_KINDS)}.")
    limit = {"gravity": MAX_GRAVITY_M_S2, "wind": MAX_WIND_M_S}.get(asked["do"], MAX_POINT_M)
    return Command(
        do=asked["do"],
        seq=_whole(asked, "seq"),
        object=_whole(asked, "object"),
        point=_vector(asked, "point", MAX_POINT_M),
        to=_vector(asked, "to", limit),
        firm=min(max(_number(asked.get("firm", 4.0)), MIN_GRIP_FREQUENCY_HZ), MAX_GRIP_FREQUENCY_HZ),
        single=asked.get("single") is True,
        twin=asked.get("twin") is True,
        thing=_name(asked.get("thing", "")),
    )


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UserError("A number of an order is not finite.")
    return float(value)


def _name(value: Any) -> str:
    if not isinstance(value, str) or len(value) > MAX_NAME_CHARACTERS:
        raise UserError("The object of a command is not a name.")
    return value


def _whole(asked: Mapping[str, Any], name: str) -> int:
    value = _number(asked.get(name, 0))
    if value != int(value) or not 0 <= value < 2**31:
        raise UserError(f"{name} of a command is not a valid number.")
    return int(value)


def _vector(asked: Mapping[str, Any], name: str, limit: float) -> Vector:
    value = asked.get(name, (0, 0, 0))
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise UserError(f"{name} of a command is not three numbers.")
    x, y, z = (min(max(_number(v), -limit), limit) for v in value)
    return x, y, z
