"""Constitutive laws as Warp functions: principal values by Jacobi, return maps, stress.

Twins of ``elasticity`` and ``plasticity``. Strains are kept as H = F - 1, so that float32 does not
round small ones away: b - 1 = H + Hᵀ + H Hᵀ has the principal values σ² - 1.
"""

from corporeal.mpm.device_layout import (
    APEX,
    CONE,
    HARD,
    LAMBDA,
    LAW,
    MU,
    YIELD,
    Particles,
    wp,
)

wp.set_module_options({"enable_backward": False})


@wp.struct
class Flowed:
    """Principal strains after a return map."""

    strain: wp.vec3
    plastic: wp.float32
    """‖Δε‖; times √(2/3) the increment of the equivalent plastic strain."""
    opened: wp.float32
    work: wp.float32
    """Plastic work per rest volume [J/m³]."""


@wp.struct
class Answer:
    """What a law makes of a trial strain."""

    strain: wp.mat33
    """F - 1 after the return map."""
    tau: wp.mat33
    """Kirchhoff stress [Pa]."""
    plastic: wp.float32
    opened: wp.float32
    work: wp.float32
    stiffness: wp.float32
    """Bound on ρ c² [Pa] at this strain."""


@wp.func
def log1p(x: wp.float32):
    """ln(1 + x), exact for small x (Kahan)."""
    u = 1.0 + x
    if u == 1.0:
        return x
    return wp.log(u) * x / (u - 1.0)


@wp.func
def expm1(x: wp.float32):
    """exp(x) - 1, exact for small x (Kahan)."""
    u = wp.exp(x)
    if u == 1.0:
        return x
    if u - 1.0 == -1.0:
        return -1.0
    return (u - 1.0) * x / wp.log(u)


@wp.func
def plane_turn(app: wp.float32, aqq: wp.float32, apq: wp.float32):
    """Cosine and sine of the turn that makes one element of a symmetric matrix zero."""
    if wp.abs(apq) <= 1.0e-9 * (wp.abs(app) + wp.abs(aqq)) + 1.0e-30:
        return wp.vec2(1.0, 0.0)
    tau = 0.5 * (aqq - app) / apq
    t = 1.0 / (wp.abs(tau) + wp.sqrt(1.0 + tau * tau))
    if tau < 0.0:
        t = -t
    c = 1.0 / wp.sqrt(1.0 + t * t)
    return wp.vec2(c, t * c)


@wp.func
def principal(E: wp.mat33):
    """E = V diag(l) Vᵀ of a symmetric matrix by four sweeps of Jacobi: (l, V)."""
    A = E
    V = wp.identity(n=3, dtype=wp.float32)
    for _ in range(4):
        r = plane_turn(A[0, 0], A[1, 1], A[0, 1])
        G = wp.mat33(r[0], r[1], 0.0, -r[1], r[0], 0.0, 0.0, 0.0, 1.0)
        A = wp.transpose(G) * A * G
        V = V * G
        r = plane_turn(A[0, 0], A[2, 2], A[0, 2])
        G = wp.mat33(r[0], 0.0, r[1], 0.0, 1.0, 0.0, -r[1], 0.0, r[0])
        A = wp.transpose(G) * A * G
        V = V * G
        r = plane_turn(A[1, 1], A[2, 2], A[1, 2])
        G = wp.mat33(1.0, 0.0, 0.0, 0.0, r[0], r[1], 0.0, -r[1], r[0])
        A = wp.transpose(G) * A * G
        V = V * G
    return wp.get_diag(A), V


@wp.func
def composed(V: wp.mat33, l: wp.vec3):
    """V diag(l) Vᵀ."""
    return V * wp.diag(l) * wp.transpose(V)


@wp.func
def flow_sand(p: Particles, k: int, trial: wp.vec3, opened: wp.float32):
    """Twin of ``plasticity.return_drucker_prager``."""
    mu = p.table[k, MU]
    lam = p.table[k, LAMBDA]
    apex = p.table[k, APEX]
    strain = trial + wp.vec3(opened / 3.0)
    trace = strain[0] + strain[1] + strain[2]
    deviator = strain - wp.vec3(trace / 3.0)
    size = wp.length(deviator)
    out = trace - apex
    slip = wp.clamp(size + p.table[k, CONE] * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * out, 0.0, size)
    new = strain - deviator * (slip / wp.max(size, 1.0e-30))
    before = float(0.0)
    if out > 0.0:
        # Beyond the apex what was open before is no new slip: only the change is.
        new = wp.vec3(apex / 3.0)
        before = opened
        slip = wp.sqrt(size * size + (out - opened) * (out - opened) / 3.0)
    after = new[0] + new[1] + new[2]
    tau = 2.0 * mu * new + wp.vec3(lam * after)
    f = Flowed()
    f.strain = new
    f.plastic = slip
    f.opened = trace - after
    f.work = wp.dot(tau, strain - new - wp.vec3(before / 3.0))
    return f


@wp.func
def flow_metal(p: Particles, k: int, trial: wp.vec3, plastic: wp.float32):
    """Twin of ``plasticity.return_von_mises``."""
    mu = p.table[k, MU]
    hard = p.table[k, HARD]
    mean = (trial[0] + trial[1] + trial[2]) / 3.0
    deviator = trial - wp.vec3(mean)
    size = wp.length(deviator)
    excess = 2.0 * mu * size - wp.sqrt(2.0 / 3.0) * (p.table[k, YIELD] + hard * plastic)
    slip = wp.max(excess / (2.0 * mu + 2.0 / 3.0 * hard), 0.0)
    left = 1.0 - slip / wp.max(size, 1.0e-30)
    f = Flowed()
    f.strain = deviator * left + wp.vec3(mean)
    f.plastic = slip
    f.opened = 0.0
    f.work = 2.0 * mu * size * left * slip
    return f


@wp.func
def swelling(H: wp.mat33):
    """J - 1 of F = 1 + H, exact for small H."""
    minors = H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0] + H[0, 0] * H[2, 2] - H[0, 2] * H[2, 0]
    minors += H[1, 1] * H[2, 2] - H[1, 2] * H[2, 1]
    return wp.trace(H) + minors + wp.determinant(H)


@wp.func
def relieved(p: Particles, k: int, H: wp.mat33, relief: wp.float32):
    """Pressure that a swelling of J + relief instead of J adds [Pa]: ``elasticity.tau_relief``."""
    own = swelling(H)
    mean = wp.max(own + relief, -0.999)
    if p.table[k, LAW] == 0.0:
        return p.table[k, LAMBDA] * ((1.0 + mean) * mean - (1.0 + own) * own)
    return p.table[k, LAMBDA] * (log1p(mean) - log1p(wp.max(own, -0.999)))


@wp.func
def answer(p: Particles, k: int, H: wp.mat33, plastic: wp.float32, opened: wp.float32):
    """Stress of material k at F = 1 + H, after its return map."""
    law = int(p.table[k, LAW])
    mu = p.table[k, MU]
    lam = p.table[k, LAMBDA]
    E = H + wp.transpose(H) + H * wp.transpose(H)
    j1 = swelling(H)
    r = Answer()
    r.strain = H
    r.opened = opened
    r.stiffness = lam + 2.0 * mu
    if law == 1:
        l = lam * log1p(wp.max(j1, -0.999))
        r.tau = mu * E + wp.diag(wp.vec3(l))
        bound = wp.max(E[0, 0] + wp.abs(E[0, 1]) + wp.abs(E[0, 2]), 0.0)
        bound = wp.max(bound, E[1, 1] + wp.abs(E[0, 1]) + wp.abs(E[1, 2]))
        bound = wp.max(bound, E[2, 2] + wp.abs(E[0, 2]) + wp.abs(E[1, 2]))
        r.stiffness = lam + 2.0 * mu * (1.0 + bound)
    elif law < 5:
        l3, V = principal(E)
        l3 = wp.max(l3, wp.vec3(-0.9999))
        sigma = wp.vec3(wp.sqrt(1.0 + l3[0]), wp.sqrt(1.0 + l3[1]), wp.sqrt(1.0 + l3[2]))
        if law == 0:
            less = wp.cw_div(l3, wp.vec3(1.0) + sigma)  # σ - 1
            top = wp.max(wp.max(sigma), 1.0)
            if j1 < -1.0:  # inside out: the smallest stretch is negative
                for i in range(3):
                    if sigma[i] == wp.min(sigma):
                        sigma[i] = -sigma[i]
                        less[i] = sigma[i] - 1.0
            pull = 2.0 * mu * wp.cw_mul(sigma, less) + wp.vec3(lam * (1.0 + j1) * j1)
            r.tau = composed(V, pull)
            J = wp.max(1.0 + j1, 1.0)
            r.stiffness = 2.0 * mu * top * (2.0 * top - 1.0) + lam * J * (2.0 * J - 1.0)
        else:
            trial = 0.5 * wp.vec3(log1p(l3[0]), log1p(l3[1]), log1p(l3[2]))
            strain = trial
            if law > 2:
                f = Flowed()
                if law == 3:
                    f = flow_sand(p, k, trial, opened)
                else:
                    f = flow_metal(p, k, trial, plastic)
                strain = f.strain
                r.plastic = f.plastic
                r.opened = f.opened
                r.work = f.work
                gone = strain - trial
                M = composed(V, wp.vec3(expm1(gone[0]), expm1(gone[1]), expm1(gone[2])))
                r.strain = H + M + M * H
            trace = strain[0] + strain[1] + strain[2]
            r.tau = composed(V, 2.0 * mu * strain + wp.vec3(lam * trace))
    return r
