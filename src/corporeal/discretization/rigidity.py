"""Test whether a part visibly deforms."""

from math import inf, sqrt

from corporeal.core.types import Material
from corporeal.discretization.filled_shells import judge_filled_shell
from corporeal.discretization.part_geometry import (
    ExpectedMotion,
    PartGeometry,
    RigidityVerdict,
    part_width,
    tube_diameter,
    wall_factors,
    wall_thickening_ratio,
)
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.mpm.physics.time_step_limits import bounded_poisson, p_wave_speed, yield_speed

MAX_INVISIBLE_STRAIN = 5e-3
"""Half a percent, of strain or of a shift over a length, is not seen."""


def cantilever_tip_deflection_ratio(load: float, young_pa: float, length: float, depth: float) -> float:
    """Shift of the tip of a bar that is held at one end, over its length [-].

    δ/L = 3 ρ a L³ / (2 E h²) (Euler–Bernoulli, a solid bar).

    Args:
        load: ρ a [N/m³].
        young_pa: E [Pa].
        length: L [m].
        depth: h [m].
    """
    return 1.5 * load * length**3 / (young_pa * depth**2)


def judge_rigidity(part: PartGeometry, motion: ExpectedMotion) -> RigidityVerdict:
    """Return whether a part would yield or visibly flex.

    ε = max(v/c, ρ a L/E, tip shift of a cantilever / L, what prescribed motion presses it by) and v_y = σ_y/(ρ c);
    rigid when ε is below half a percent and v below v_y. A thin wall is judged by its mapped values at a tenth of the
    part's width, which is the wall the finest detail would
    simulate: so the verdict depends neither on the detail nor on what else is in the scene, but for what presses it. A
    tube is judged as the bar that it is.
    """
    if part.prescribed:
        return RigidityVerdict(0.0, inf, True, "the motion of its object is prescribed, as one rigid body")
    if part.structure.holds:
        reason = f"its contents, {part.structure.holds}, move by themselves and its wall holds them"
        return RigidityVerdict(0.0, inf, True, reason)
    if CONSTITUTIVE_LAWS[part.material.law].liquid:
        return RigidityVerdict(1.0, 0.0, False, "it flows", 1.0, 1.0)
    if part.structure.contents is not None:
        return judge_filled_shell(part, motion, judge_rigidity)
    material, speed = part.material, motion.impact_speed
    young_pa, poisson = bounded_poisson(material.young_pa, material.poisson)
    density = material.density
    ratio = 1.0 if tube_diameter(part) else wall_thickening_ratio(part, part_width(part) / 10)
    stiffer, _, denser = wall_factors(part, ratio, speed)
    real = p_wave_speed(young_pa, poisson, density)
    mapped = stiffer / denser
    weight = max(
        density * motion.acceleration * part.size[2] / (young_pa * mapped),
        # The shape of a plant has its own weight and its leaves' in it already.
        cantilever_sag(part, motion.driven if part.burden else motion.acceleration),
    )
    impact = speed / (real * sqrt(mapped))
    by_itself = max(impact, weight)
    strain = max(by_itself, part.pressed)
    yields_at = yield_speed(flow_resistance(material), real, density)
    rigid = strain < MAX_INVISIBLE_STRAIN and speed < yields_at
    reason = explain_rigidity(by_itself, speed, yields_at)
    if part.pressed > max(by_itself, MAX_INVISIBLE_STRAIN):
        reason = f"prescribed motion presses it by about {part.pressed:.2g} of its thickness"
    return RigidityVerdict(strain, yields_at, rigid, reason, weight, impact, part.pressed)


def explain_rigidity(strain: float, speed: float, yields_at: float) -> str:
    """Return the verdict in words."""
    if strain >= MAX_INVISIBLE_STRAIN:
        return f"it would visibly flex: a strain of about {strain:.2g} is expected"
    if speed >= yields_at:
        return f"it would yield: {speed:.2g} m/s exceeds its yield speed of {yields_at:.2g} m/s"
    return f"it would neither yield nor visibly flex: a strain of about {strain:.1g} is expected"


def flow_resistance(material: Material) -> float | None:
    """Stress [Pa] that the material bears before it flows; None: it does not flow."""
    if CONSTITUTIVE_LAWS[material.law].granular:
        return material.cohesion or 0.0
    return material.yield_stress


def cantilever_sag(part: PartGeometry, acceleration: float) -> float:
    """Tip shift over length of the part as a cantilever in a uniform acceleration [-].

    The second moment of a thin tube, A d²/8, is that of a solid bar with the depth h = √1.5 d.
    """
    length, depth = part.size[2], sqrt(1.5) * tube_diameter(part) or 2 / 3 * part_width(part)
    if depth <= 0 or length < 4 * depth:
        return 0.0
    density, young_pa = part.material.density, part.material.young_pa
    # A load at the tip bends 8/3 as much as one spread along.
    loaded = 1.0 + 8 / 3 * part.burden
    return cantilever_tip_deflection_ratio(loaded * density * acceleration, young_pa, length, depth)
