"""Deflection of a body under its own weight."""

MAX_INVISIBLE_STRAIN = 5e-3
"""Half a percent, of strain or of a shift over a length, is not seen."""


def cantilever_tip_deflection_ratio(
    load: float, young: float, length: float, depth: float
) -> float:
    """Shift of the tip of a bar that is held at one end, over its length [-].

    δ/L = 3 ρ a L³ / (2 E h²) (Euler–Bernoulli, a solid bar).

    Args:
        load: ρ a [N/m³].
        young: E [Pa].
        length: L [m].
        depth: h [m].

    """
    return 1.5 * load * length**3 / (young * depth**2)
