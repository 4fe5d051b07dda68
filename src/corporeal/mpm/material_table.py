"""Table of substances, shared by all engines.

What a problem says of each particle (E, ν, σ_y, φ, c …) becomes here, once, the numbers that laws and loops read (μ, λ,
the cone, the FLIP damping rate …). Particles carry the number of a row.
"""

from dataclasses import dataclass, fields
from math import sqrt

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.errors import SimulationError
from corporeal.core.types import Law
from corporeal.mpm import laws
from corporeal.mpm.constants import LOCAL_BULK_RATIO, MIN_LOSS_FACTOR, TINY, VAST
from corporeal.mpm.laws.constitutive_law import YieldParameters, lame_parameters
from corporeal.mpm.laws.drucker_prager import apex_strain, cone_slope
from corporeal.mpm.physics.maxwell_branches import MaxwellBranches, fit_branches, relaxing_bulk
from corporeal.mpm.physics.time_step_limits import flip_damping_rate
from corporeal.mpm.problem import Body, Problem


@dataclass(frozen=True)
class MaterialTable:
    """The table; M rows, sorted by body. Rows of rigid bodies have no law: 0 everywhere."""

    body: Int[np.ndarray, " M"]
    law: Int[np.ndarray, " M"]
    """``types.Law`` values."""
    mu: Float[np.ndarray, " M"]
    """μ [Pa]"""
    lam: Float[np.ndarray, " M"]
    """λ [Pa]"""
    yield_stress: Float[np.ndarray, " M"]
    """σ_y [Pa]"""
    hardening: Float[np.ndarray, " M"]
    """H [Pa]"""
    cone: Float[np.ndarray, " M"]
    """Slope α of the cone [-]; 0 of what is not granular."""
    apex: Float[np.ndarray, " M"]
    """tr ε at its apex [-]."""
    consistency: Float[np.ndarray, " M"]
    """K_c of a liquid [Pa sⁿ]; 0 of all others."""
    flow_index: Float[np.ndarray, " M"]
    """n [-]"""
    slow_shear: Float[np.ndarray, " M"]
    """G of the slower Maxwell branch [Pa]; 0: none, as of the next five."""
    fast_shear: Float[np.ndarray, " M"]
    """G of the faster one [Pa]"""
    slow_bulk: Float[np.ndarray, " M"]
    """K of the slower one [Pa]"""
    fast_bulk: Float[np.ndarray, " M"]
    """K of the faster one [Pa]"""
    slow_time: Float[np.ndarray, " M"]
    """T of the slower one [s]"""
    fast_time: Float[np.ndarray, " M"]
    """T of the faster one [s]"""
    flip_damping_rate: Float[np.ndarray, " M"]
    """Rate at which what the grid cannot see is forgotten [1/s]: one for all that share the particle's field, or
    momentum would not be kept; ``VAST`` where APIC is kept."""
    density: Float[np.ndarray, " M"]
    """ρ [kg/m³]"""
    rigid: Bool[np.ndarray, " M"]
    shell: Bool[np.ndarray, " M"]
    """Of vertices of shells: without stress of their own."""
    uses_mean_dilatation: Bool[np.ndarray, " M"]
    """Whether pressure comes from a mean dilatation: in fields all stiff in bulk."""

    @classmethod
    def of(cls, problem: Problem) -> tuple["MaterialTable", Int[np.ndarray, " P"]]:
        """Derive the table, and the row of every particle.

        Raises:
            SimulationError: A particle follows a law that there is not.
        """
        rows = np.concatenate([_body_rows(problem, b) for b in range(len(problem.bodies))])
        body = rows[:, 0].astype(np.int64)
        field = np.zeros_like(body) if problem.contact == "single" else body
        soft = (rows[:, _RIGID_COLUMN] == 0.0) & (rows[:, _SHELL_COLUMN] == 0.0)
        bulky = soft & laws.is_stiff_in_bulk(rows[:, 1].astype(np.int64), rows[:, 2], rows[:, 3])
        for f in np.unique(field).tolist():
            mine = field == f
            rows[mine, _DAMPING_COLUMN] = rows[mine, _DAMPING_COLUMN].max()
            rows[mine, _MEAN_DILATATION_COLUMN] = bulky[mine].all()
        table, row_of_particle = _unique_rows(rows)
        kinds = {"body": np.int64, "law": np.int64, "rigid": bool, "shell": bool, "uses_mean_dilatation": bool}
        named = zip(_COLUMNS, table.T, strict=True)
        return cls(**{n: c.astype(kinds.get(n, np.float64)) for n, c in named}), row_of_particle

    @property
    def modulus(self) -> Float[np.ndarray, " M"]:
        """P-wave modulus at rest of what is resisted at once [Pa]; 0 where rigid.

        λ + 2μ and K + 4/3 G of the branches.
        """
        branches = self.branches
        return self.lam + 2.0 * self.mu + (branches.bulk + 4 / 3 * branches.shear).sum(axis=1)

    @property
    def branches(self) -> MaxwellBranches:
        """What relaxes of their stress."""
        s = self
        return MaxwellBranches(
            shear=np.stack([s.slow_shear, s.fast_shear], axis=1),
            bulk=np.stack([s.slow_bulk, s.fast_bulk], axis=1),
            time=np.where(s.slow_time > 0, [s.slow_time, s.fast_time], 1.0).T,
        )

    @property
    def stiffening(self) -> Float[np.ndarray, " M"]:
        """How much faster waves run than they would without branches [-]."""
        slow = np.maximum(self.lam + 2.0 * self.mu, TINY)
        return np.where(self.relaxes, np.sqrt(self.modulus / slow), 1.0)

    @property
    def relaxes(self) -> Bool[np.ndarray, " M"]:
        """Which have branches."""
        return self.slow_time > 0.0

    @property
    def mean_bulk(self) -> Float[np.ndarray, " M"]:
        """Part of λ that acts on the mean dilatation [Pa]; 0 where none does."""
        return np.where(self.uses_mean_dilatation, self.lam - LOCAL_BULK_RATIO * self.mu, 0.0)

    @property
    def wave_speed(self) -> Float[np.ndarray, " M"]:
        """Longitudinal wave speed at rest [m/s]; 0 where rigid."""
        return np.sqrt(self.modulus / self.density)

    @property
    def flows(self) -> Bool[np.ndarray, " M"]:
        """Where a return map acts."""
        return np.isin(self.law, laws.PLASTIC_LAWS)

    def numbers(self, row: Int[np.ndarray, " P"], dt: float) -> YieldParameters:
        """Return what return maps read of the material of some particles, by their rows.

        Args:
            row: Of each particle.
            dt: Of this step [s].
        """
        drag = self.consistency[row] * dt ** -self.flow_index[row]
        given = [f.name for f in fields(YieldParameters) if f.name != "drag"]
        return YieldParameters(drag=drag, **{name: getattr(self, name)[row] for name in given})

    def of_bodies(self, bodies: list[int]) -> "MaterialTable":
        """Return the rows of some bodies."""
        mine = np.isin(self.body, bodies)
        return MaterialTable(*(getattr(self, name)[mine] for name in _COLUMNS))


_COLUMNS = tuple(f.name for f in fields(MaterialTable))
_DAMPING_COLUMN, _RIGID_COLUMN, _SHELL_COLUMN, _MEAN_DILATATION_COLUMN = map(
    _COLUMNS.index, ("flip_damping_rate", "rigid", "shell", "uses_mean_dilatation")
)


def _body_rows(problem: Problem, number: int) -> Float[np.ndarray, "P C"]:
    """Derive a row for each particle of a body; what its field decides is filled in later."""
    body = problem.bodies[number]
    _refuse_unknown(body)
    count, none = len(body.position), np.zeros(len(body.position))
    if body.rigid:
        row = {"flip_damping_rate": none + VAST, "rigid": none + 1.0}
    else:
        mu, lam = (np.asarray(value) for value in lame_parameters(body.young_pa, body.poisson))
        sand = np.isin(body.law, laws.GRANULAR_LAWS)
        wave, pull = np.sqrt((lam + 2.0 * mu) / body.density), np.linalg.norm(problem.gravity)
        pours = np.isin(body.law, laws.LIQUID_LAWS)
        affine = (problem.transfer == "apic") | (mu == 0.0) | pours
        rate = flip_damping_rate(wave, sand, float(pull), problem.cell)
        apex = apex_strain(body.friction_angle, body.cohesion, mu, lam)
        row = {
            "law": body.law,
            "mu": mu,
            "lam": lam,
            "yield_stress": body.yield_stress,
            "hardening": body.hardening,
            "cone": np.where(sand, cone_slope(body.friction_angle), 0.0),
            "apex": np.where(sand, apex, 0.0),
            "consistency": none if body.consistency is None else body.consistency,
            "flow_index": none + 1.0 if body.flow_index is None else body.flow_index,
            "flip_damping_rate": np.where(affine, VAST, rate),
            **_branch_columns(body, mu, lam),
        }
        if body.shell is not None:
            row = _with_shell(row, body, problem)
    row |= {"body": np.full(count, number), "density": body.density}
    return np.column_stack([row.get(name, none) for name in _COLUMNS]).astype(np.float64)


def _with_shell(row: dict[str, np.ndarray], body: Body, problem: Problem) -> dict[str, np.ndarray]:
    """Take all stress out of the vertices of a body's shell; they forget at the rate of its own waves."""
    shell = body.shell
    assert shell is not None
    vertex = np.zeros(len(body.position), bool)
    vertex[shell.triangle] = True
    stiffness = shell.membrane_young_pa / (1.0 - shell.poisson**2)
    wave = np.sqrt(stiffness / body.density[shell.triangle[:, 0]])
    grains = np.zeros(1, bool)
    rate = flip_damping_rate(wave.max(keepdims=True), grains, float(np.linalg.norm(problem.gravity)), problem.cell)[0]
    bare = {name: np.where(vertex, 0.0, values) for name, values in row.items()}
    damping = VAST if problem.transfer == "apic" else rate
    bare["flip_damping_rate"] = np.where(vertex, damping, row["flip_damping_rate"])
    return bare | {"shell": vertex.astype(float)}


def _branch_columns(
    body: Body, mu: Float[np.ndarray, " P"], lam: Float[np.ndarray, " P"]
) -> dict[str, Float[np.ndarray, " P"]]:
    """Columns of the Maxwell branches of a body's particles."""
    lossy = (body.loss >= MIN_LOSS_FACTOR) & (mu > 0.0)
    relaxes = relaxing_bulk(mu, lam)
    columns = {}
    for k, name in enumerate(("slow", "fast")):
        strength, time = np.zeros(len(mu)), np.zeros(len(mu))
        for loss in np.unique(body.loss[lossy]).tolist():
            mine, share = lossy & (body.loss == loss), fit_branches(loss)
            strength[mine] = share.strength[k]
            time[mine] = share.time[k] / (body.vibration[mine] * sqrt(share.stiffening))
        columns[f"{name}_shear"], columns[f"{name}_bulk"] = strength * mu, strength * relaxes
        columns[f"{name}_time"] = time
    return columns


def _refuse_unknown(body: Body) -> None:
    unknown = sorted(set(np.unique(body.law).tolist()) - {law.value for law in Law})
    if unknown:
        menu = ", ".join(f"{law.value} ({law.name.lower()})" for law in Law)
        raise SimulationError(f"{body.name!r} has the unknown law {unknown[0]}. Give one of: {menu}.")


def _unique_rows(rows: Float[np.ndarray, "P C"]) -> tuple[Float[np.ndarray, "M C"], Int[np.ndarray, " P"]]:
    """Different rows, and which of them each row is; neighbours are mostly equal."""
    new = np.r_[True, (rows[1:] != rows[:-1]).any(axis=1)]
    unique, index = np.unique(rows[new], axis=0, return_inverse=True)
    return unique, index.reshape(-1)[np.cumsum(new) - 1]
