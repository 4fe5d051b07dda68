"""Every law in C++, alone, at one lane and at eight, against float64 NumPy."""

import re

import numpy as np
import pytest

from corporeal.core.types import Law
from corporeal.mpm import formulas, laws
from corporeal.mpm.formulas.one_lane import (
    RESPONSE_OPENED,
    RESPONSE_PLASTIC_STRAIN,
    RESPONSE_PLASTIC_WORK,
    RESPONSE_STRAIN,
    RESPONSE_WAVE,
    law_response,
    mean_pressure,
)
from corporeal.mpm.laws import hencky
from corporeal.mpm.laws.constitutive_law import YieldParameters, lame_parameters
from corporeal.mpm.laws.drucker_prager import apex_strain, cone_slope
from corporeal.mpm.laws.kinematics import determinant
from corporeal.mpm.quiet_warp import wp

wp.set_module_options(formulas.formula_options(cpu_compiler_flags="-march=native -O3 -ffp-contract=fast"))

COUNT = 8000
YOUNG_PA, POISSON, YIELD, HARDENING, ANGLE = 1e5, 0.3, 2e3, 1e4, np.radians(30.0)
DRAG = 5e4
"""K_c/dtⁿ of a liquid [Pa]."""
PLACES = 20
"""Numbers of a response."""
TOLERANCE = 2e-6
"""Of stresses, as a share of E ‖F - 1‖; of large ones, of themselves."""
ELASTIC = tuple(law for law in Law if not laws.CONSTITUTIVE_LAWS[law].flows)
PLASTIC = tuple(law for law in Law if laws.CONSTITUTIVE_LAWS[law].flows)
BULKY = tuple(law for law in Law if laws.CONSTITUTIVE_LAWS[law].volumetric)
UPPER = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])
"""Rows and columns of what is kept of a symmetric matrix."""

Floats = wp.array(dtype=wp.float32)
Doubles = wp.array(dtype=wp.float64)


@wp.kernel
def at_one_lane(H: wp.array(dtype=wp.mat33), past: wp.array(dtype=wp.vec2), t: Floats, out: Floats):
    i = wp.tid()
    r = law_response(t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8], H[i], past[i][0], past[i][1])
    for k in range(PLACES):
        out[PLACES * i + k] = r[k]


@wp.func_native("""
  typedef mpm::f8 R;
  typedef mpm::Lanes<R> S;
  const float *m = (const float *)t.data;
  mpm::Material<R> material = {S::all(m[0]), S::all(m[1]), S::all(m[2]), S::all(m[3]),
                               S::all(m[4]), S::all(m[5]), S::all(m[6]),
                               S::all(m[7]), S::all(m[8])};
  R F[9];
  const R *from = (const R *)H.data + 9 * i, *before = (const R *)past.data + 2 * i;
  for (int k = 0; k < 9; k++) F[k] = from[k];
  mpm::Response<R> a;
  mpm::Laws<R>::respond(material, before[0], before[1], F, a);
  R *to = (R *)out.data + 20 * i;
  for (int k = 0; k < 6; k++) to[k] = a.tau[k];
  for (int k = 0; k < 9; k++) to[6 + k] = F[k];
  to[15] = a.wave;
  to[16] = a.j1;
  to[17] = a.plastic;
  to[18] = a.opened;
  to[19] = a.work;
""")
def eight(H: Floats, past: Floats, t: Floats, i: int, out: Floats): ...


@wp.kernel
def at_eight_lanes(H: Floats, past: Floats, t: Floats, out: Floats):
    eight(H, past, t, wp.tid(), out)


@wp.kernel
def mean_at_one_lane(law: float, bulk: float, H: wp.array(dtype=wp.mat33), r: Floats, out: Floats):
    i = wp.tid()
    found = mean_pressure(law, bulk, H[i], r[i])
    out[2 * i] = found[0]
    out[2 * i + 1] = found[1]


@wp.func_native("""
  typedef mpm::f8 R;
  typedef mpm::Lanes<R> S;
  mpm::Material<R> t;
  t.law = S::all(law);
  R own = mpm::Strain<R>::volume((const R *)H.data + 9 * i), wave = S::all(0.0f);
  R *to = (R *)out.data + 2 * i;
  to[0] = mpm::Laws<R>::mean_pressure(t, S::all(bulk), own, ((const R *)r.data)[i], wave);
  to[1] = wave;
""")
def mean_eight(law: float, bulk: float, H: Floats, r: Floats, i: int, out: Floats): ...


@wp.kernel
def mean_at_eight_lanes(law: float, bulk: float, H: Floats, r: Floats, out: Floats):
    mean_eight(law, bulk, H, r, wp.tid(), out)


@wp.func_native("""
  const double *strain = (const double *)H.data + 9 * i, log_volume_ratio = ((const double *)r.data)[i];
  ((double *)out.data)[i] = mpm::mean_energy(law, bulk, strain, log_volume_ratio);
""")
def stored_in_mean(law: int, bulk: wp.float64, H: Doubles, r: Doubles, i: int, out: Doubles): ...


@wp.kernel
def mean_energies(law: int, bulk: wp.float64, H: Doubles, r: Doubles, out: Doubles):
    stored_in_mean(law, bulk, H, r, wp.tid(), out)


@wp.func_native("""
  ((double *)out.data)[i] = mpm::stored_energy(law, mu, lam, (const double *)H.data + 9 * i);
""")
def stored(law: int, mu: wp.float64, lam: wp.float64, H: Doubles, i: int, out: Doubles): ...


@wp.kernel
def energies(law: int, mu: wp.float64, lam: wp.float64, H: Doubles, out: Doubles):
    stored(law, mu, lam, H, wp.tid(), out)


@pytest.fixture(scope="module", name="H")
def strains():
    """Strains from 1e-4 to 0.15 and more, as float32 sees them, none nearly flat."""
    rng = np.random.default_rng(1)
    wide = rng.choice([1e-4, 1e-2, 0.15], 2 * COUNT)[:, None, None]
    strains = (rng.normal(size=(2 * COUNT, 3, 3)) * wide).astype(np.float32)
    good = np.linalg.det(np.eye(3) + strains.astype(np.float64)) > 0.2
    return strains[good][:COUNT]


@pytest.fixture(scope="module", name="wild")
def large_strains():
    """Strains of order 1, as float32 sees them: half of them turned inside out.

    Formulas see squares of stretches, so those that are small beside others lose digits; and of
    two that are nearly equal it is anybody's guess which one was turned.
    """
    rng, many = np.random.default_rng(2), 40 * COUNT
    strains = rng.normal(size=(many, 3, 3)) * rng.choice([0.3, 0.6], many)[:, None, None]
    strains = strains.astype(np.float32)
    stretch = np.linalg.svd(np.eye(3) + strains.astype(np.float64), compute_uv=False)
    turned = np.linalg.det(np.eye(3) + strains.astype(np.float64)) < 0.0
    good = (stretch[:, 0] < 4.0 * stretch[:, 2]) & (stretch[:, 1] > 1.1 * stretch[:, 2])
    half = COUNT // 2
    return np.concatenate([strains[good & ~turned][:half], strains[good & turned][:half]])


def on_processor(array, dtype=wp.float32):
    return wp.array(np.ascontiguousarray(array), dtype=dtype, device="cpu")


def in_lanes(rows):
    """Rows of eight particles, (batch, channel, lane)."""
    return rows.reshape(COUNT // 8, 8, -1).transpose(0, 2, 1).ravel()


def responses(law, H, width, past=None, apex=0.0, index=0.4):
    """Give the 20 numbers of a response for every strain, (COUNT, 20).

    ``past`` is the plastic strain and the volume correction so far, (COUNT, 2).
    """
    mu, lam = lame_parameters(YOUNG_PA, POISSON)
    cone = float(cone_slope(ANGLE)) if law == Law.DRUCKER_PRAGER else 0.0
    numbers = [law.value, mu, lam, YIELD, HARDENING, cone, apex, DRAG, index]
    table = np.array(numbers, np.float32)
    past = np.zeros((COUNT, 2), np.float32) if past is None else past
    out = on_processor(np.zeros(COUNT * PLACES, np.float32))
    if width == 1:
        arrays = [on_processor(H, wp.mat33), on_processor(past, wp.vec2), on_processor(table), out]
        wp.launch(at_one_lane, COUNT, arrays, device="cpu")
        return out.numpy().reshape(COUNT, PLACES)
    arrays = [on_processor(in_lanes(H)), on_processor(in_lanes(past)), on_processor(table), out]
    wp.launch(at_eight_lanes, COUNT // 8, arrays, device="cpu")
    return out.numpy().reshape(-1, PLACES, 8).transpose(0, 2, 1).reshape(COUNT, PLACES)


def moduli():
    """μ and λ of every particle [Pa]."""
    mu, lam = lame_parameters(np.full(COUNT, YOUNG_PA), np.full(COUNT, POISSON))
    return np.asarray(mu), np.asarray(lam)


def flowed(law, F, past=None, cohesion=0.0, index=0.4):
    """What NumPy makes of the return map: the strain that is left, and what flowed."""
    full = lambda value: np.full(COUNT, float(value))  # noqa: E731
    past = np.zeros((COUNT, 2)) if past is None else past.astype(np.float64)
    cone, apex = cone_slope(ANGLE), apex_strain(ANGLE, cohesion, *lame_parameters(YOUNG_PA, POISSON))
    numbers = YieldParameters(*moduli(), *map(full, (YIELD, HARDENING, cone, apex, DRAG, index)))
    return laws.flow(np.full(COUNT, law.value), F, numbers, past[:, 0], past[:, 1])


def astray(law, F, H, found):
    """By how much a stress is not that of float64, as a share of E ‖F - 1‖ or of itself."""
    exact = laws.tau(np.full(COUNT, law.value), F, *moduli())[:, *UPPER]
    size = YOUNG_PA * np.linalg.norm(H.astype(np.float64), axis=(1, 2))
    wrong = np.linalg.norm(found[:, :6] - exact, axis=1)
    return wrong / size, wrong / np.maximum(size, np.linalg.norm(exact, axis=1))


@pytest.mark.slow
@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("law", list(Law))
def test_the_stress_of_every_law_is_that_of_float64(law, width, H):
    F = np.eye(3) + H.astype(np.float64)
    left = flowed(law, F).F if law in PLASTIC else F
    found = responses(law, H, width)
    assert astray(law, left, H, found)[0].max() < TOLERANCE
    strain = found[:, int(RESPONSE_STRAIN) : int(RESPONSE_STRAIN) + 9].reshape(-1, 3, 3)
    assert np.abs(strain - (left - np.eye(3))).max() < TOLERANCE


@pytest.mark.parametrize("width", [1, 8])
def test_what_is_turned_inside_out_is_pushed_back_as_in_float64(width, wild):
    F = np.eye(3) + wild.astype(np.float64)
    assert (np.linalg.det(F) < 0.0).sum() == COUNT // 2
    found = responses(Law.COROTATED, wild, width)
    assert astray(Law.COROTATED, F, wild, found)[1].max() < TOLERANCE


@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("law", [law for law in ELASTIC if law is not Law.COROTATED])
def test_large_strains_are_borne_as_in_float64(law, width, wild):
    upright = np.resize(wild[: COUNT // 2], wild.shape)
    F = np.eye(3) + upright.astype(np.float64)
    assert np.linalg.norm(upright, axis=(1, 2)).max() > 2.0
    assert astray(law, F, upright, responses(law, upright, width))[1].max() < TOLERANCE


@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("law", PLASTIC)
def test_matter_with_a_past_flows_as_in_float64(law, width, H):
    rng = np.random.default_rng(3)
    past = (rng.uniform(size=(COUNT, 2)) * [0.2, 0.02]).astype(np.float32)
    cohesion, F = 500.0, np.eye(3) + H.astype(np.float64)
    mu, lam = moduli()
    apex = apex_strain(ANGLE, cohesion, mu[0], lam[0])
    found, exact = responses(law, H, width, past, apex), flowed(law, F, past, cohesion)
    assert 0.1 < (exact.plastic_strain > 0.0).mean() < 1.0
    size = np.linalg.norm(H.astype(np.float64), axis=(1, 2)) + past[:, 1]
    strain = found[:, int(RESPONSE_STRAIN) : int(RESPONSE_STRAIN) + 9].reshape(-1, 3, 3)
    assert np.abs(strain - (exact.F - np.eye(3))).max() < TOLERANCE
    tau = hencky.tau(exact.F, mu, lam)[:, *UPPER]
    assert (np.linalg.norm(found[:, :6] - tau, axis=1) / (YOUNG_PA * size)).max() < TOLERANCE
    assert np.abs(found[:, int(RESPONSE_PLASTIC_STRAIN)] - exact.plastic_strain).max() < TOLERANCE
    assert (np.abs(found[:, int(RESPONSE_PLASTIC_WORK)] - exact.loss) / (YOUNG_PA * size**2)).max() < 2 * TOLERANCE
    if law == Law.FLUID:
        plain, newton = responses(law, H, width, past, apex, 1.0), flowed(law, F, past, cohesion, 1)
        strain = plain[:, int(RESPONSE_STRAIN) : int(RESPONSE_STRAIN) + 9].reshape(-1, 3, 3)
        assert np.abs(strain - (newton.F - np.eye(3))).max() < TOLERANCE
        assert np.abs(newton.F - exact.F).max() > 1e-2
    if law == Law.DRUCKER_PRAGER:
        assert (exact.volume > past[:, 1]).any() and (exact.volume < past[:, 1]).any()
        assert np.abs(found[:, int(RESPONSE_OPENED)] - exact.volume).max() < TOLERANCE


@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("law", ELASTIC)
def test_no_wave_along_a_principal_axis_is_faster_than_its_bound(law, width, wild):
    diagonal = np.zeros_like(wild)
    for d in range(3):
        diagonal[:, d, d] = np.maximum(wild[:, d, d], -0.8)
    bound = responses(law, diagonal, width)[:, int(RESPONSE_WAVE)]
    F, numbers, h = np.eye(3) + diagonal.astype(np.float64), np.full(COUNT, law.value), 1e-6
    for d in range(3):
        stretched = F.copy()
        stretched[:, d, d] *= 1.0 + h
        rise = laws.tau(numbers, stretched, *moduli()) - laws.tau(numbers, F, *moduli())
        assert (rise[:, d, d] / h < bound * (1.0 + 1e-4) + 1.0).all()
    exact = laws.wave_modulus(numbers, F, *moduli())
    assert (bound >= exact * (1.0 - 1e-5)).all()
    mu, lam = (value[0] for value in moduli())
    rest = responses(law, np.zeros_like(wild), width)[:, int(RESPONSE_WAVE)]
    assert rest == pytest.approx(lam + 2.0 * mu, rel=1e-6)


@pytest.mark.parametrize("width", [1, 8])
@pytest.mark.parametrize("law", BULKY)
def test_the_mean_pressure_is_that_of_numpy(law, width, H):
    log_volume_ratio = (0.1 * np.random.default_rng(4).normal(size=COUNT)).astype(np.float32)
    F, bulk = np.eye(3) + H.astype(np.float64), YOUNG_PA
    out = on_processor(np.zeros(2 * COUNT, np.float32))
    if width == 1:
        given = [on_processor(H, wp.mat33), on_processor(log_volume_ratio), out]
        wp.launch(mean_at_one_lane, COUNT, [law.value, bulk, *given], device="cpu")
        found = out.numpy().reshape(COUNT, 2)
    else:
        given = [on_processor(in_lanes(H)), on_processor(log_volume_ratio), out]
        wp.launch(mean_at_eight_lanes, COUNT // 8, [law.value, bulk, *given], device="cpu")
        found = out.numpy().reshape(-1, 2, 8).transpose(0, 2, 1).reshape(COUNT, 2)
    numbers, full, r = (np.full(COUNT, law.value), np.full(COUNT, bulk), log_volume_ratio.astype(np.float64))
    J = determinant(F)

    def pressure(more):
        return laws.mean_pressure(numbers, J * np.exp(r + more), full)

    def energy(more):
        return laws.psi_mean(numbers, J * np.exp(r + more), full)

    exact = pressure(0.0)
    size = YOUNG_PA * (np.linalg.norm(H.astype(np.float64), axis=(1, 2)) + np.abs(log_volume_ratio))
    assert (np.abs(found[:, 0] - exact) / size).max() < TOLERANCE
    # Its slope in ln J is what it adds to ρ c², or less where matter is squeezed.
    assert ((pressure(1e-6) - exact) / 1e-6 < found[:, 1] * (1.0 + 1e-5) + 1.0).all()
    modulus = laws.mean_modulus(numbers, J * np.exp(r), full)
    assert found[:, 1] == pytest.approx(modulus, rel=1e-5)
    # And it is the slope of what is stored.
    assert (energy(1e-6) - energy(-1e-6)) / 2e-6 == pytest.approx(exact, rel=1e-5, abs=1e-4)
    stored = on_processor(np.zeros(COUNT), wp.float64)
    doubles = [on_processor(a.astype(np.float64).ravel(), wp.float64) for a in (H, log_volume_ratio)]
    wp.launch(mean_energies, COUNT, [law.value, bulk, *doubles, stored], device="cpu")
    assert stored.numpy() == pytest.approx(energy(0.0), rel=1e-9)


@pytest.mark.parametrize("width", [1, 8])
def test_elastic_laws_leave_the_strain_alone_and_do_no_plastic_work(width, H):
    for law in ELASTIC:
        found = responses(law, H, width)
        np.testing.assert_array_equal(found[:, int(RESPONSE_STRAIN) : int(RESPONSE_STRAIN) + 9], H.reshape(-1, 9))
        assert not found[:, [int(RESPONSE_PLASTIC_STRAIN), int(RESPONSE_OPENED), int(RESPONSE_PLASTIC_WORK)]].any()


@pytest.mark.parametrize("width", [1, 8])
def test_plastic_work_is_never_negative_and_flow_happens(width, H):
    found = responses(Law.VON_MISES, H, width)
    assert (found[:, int(RESPONSE_PLASTIC_WORK)] >= 0.0).all()
    assert 0.2 < (found[:, int(RESPONSE_PLASTIC_STRAIN)] > 0.0).mean() < 1.0


@pytest.mark.parametrize("law", list(Law))
def test_the_stored_energy_is_that_of_numpy(law, H):
    mu, lam = (float(value) for value in lame_parameters(YOUNG_PA, POISSON))
    out = on_processor(np.zeros(COUNT), wp.float64)
    strain = on_processor(H.astype(np.float64).ravel(), wp.float64)
    wp.launch(energies, COUNT, [law.value, mu, lam, strain, out], device="cpu")
    F = np.eye(3) + H.astype(np.float64)
    full = np.full(COUNT, law.value)
    exact = laws.psi(full, F, np.full(COUNT, mu), np.full(COUNT, lam))
    scale = YOUNG_PA * np.sum(H.astype(np.float64) ** 2, axis=(1, 2))
    assert (np.abs(out.numpy() - exact) / scale).max() < 1e-7


def test_laws_have_the_same_numbers_in_both_languages():
    numbers = re.search(r"enum Law {(.*)}", formulas.cpp_preamble())[1]
    listed = dict(re.findall(r"(\w+) = (\d+)", numbers))
    assert {name: int(number) for name, number in listed.items()} == {law.name: law.value for law in Law}


def test_no_law_is_chosen_by_a_bare_number():
    folder = formulas.FORMULAS_FOLDER.parent
    texts = [*folder.rglob("*.cpp"), *folder.rglob("*.h")]
    assert len(texts) > 20
    for path in texts:
        assert not re.search(r"\blaw\s*(==|>=|>|<|<=)\s*\d", path.read_text()), path
