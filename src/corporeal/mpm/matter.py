"""All particles of a problem in one list: what never changes of them, and what does."""

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm import elasticity, plasticity, rigid
from corporeal.mpm.problem import Problem
from corporeal.mpm.stability import forgetting_rate
from corporeal.types import Law

PLASTIC_LAWS = (Law.DRUCKER_PRAGER.value, Law.VON_MISES.value)
"""What flows: its shape is not only its elastic deformation."""


@dataclass(frozen=True)
class Matter:
    """What never changes; all bodies' particles in one list."""

    body: Int[np.ndarray, " P"]
    mass: Float[np.ndarray, " P"]
    volume: Float[np.ndarray, " P"]
    law: Int[np.ndarray, " P"]
    mu: Float[np.ndarray, " P"]
    lam: Float[np.ndarray, " P"]
    yield_stress: Float[np.ndarray, " P"]
    hardening: Float[np.ndarray, " P"]
    friction_angle: Float[np.ndarray, " P"]
    cohesion: Float[np.ndarray, " P"]
    viscosity: Float[np.ndarray, " P"]
    rigid: Bool[np.ndarray, " P"]
    wave_speed: Float[np.ndarray, " P"]
    """Longitudinal wave speed at rest [m/s]; 0 where rigid."""
    forgetting: Float[np.ndarray, " P"]
    """Rate at which what the grid cannot see is forgotten [1/s]: one for all that share the
    particle's field, or momentum would not be kept; inf where APIC is kept."""
    swells: Bool[np.ndarray, " P"]
    """Whether pressure comes from the mean swelling around: in fields all stiff in bulk."""
    total: Float[np.ndarray, " B"]
    """Mass of each body [kg]."""
    centre: Float[np.ndarray, "B 3"]
    """Where each body's centre of mass starts [m]."""
    inertia: Float[np.ndarray, "B 3 3"]
    """Of each body at the start, about its centre [kg m²]; used where rigid."""
    arm: Float[np.ndarray, "P 3"]
    """Position at the start, from the body's centre [m]."""
    surface: tuple[Float[np.ndarray, "S 3"], ...]
    """Surface points of each body at the start, from its centre [m]."""

    @classmethod
    def of(cls, problem: Problem) -> "Matter":
        """Gather what the bodies say of their particles."""
        bodies = problem.bodies

        def gathered(name: str) -> np.ndarray:
            return np.concatenate([np.asarray(getattr(b, name), np.float64) for b in bodies])

        volume, density, law = gathered("volume"), gathered("density"), gathered("law")
        mu, lam = elasticity.lame(gathered("young"), gathered("poisson"))
        body = np.repeat(np.arange(len(bodies)), [len(b.position) for b in bodies])
        stiff = np.array([b.rigid for b in bodies])[body]
        wave = np.where(stiff, 0.0, np.sqrt((lam + 2.0 * mu) / density))
        affine = stiff | (problem.transfer == "apic") | (mu == 0.0)
        sand, pull = law == Law.DRUCKER_PRAGER.value, float(np.linalg.norm(problem.gravity))
        forgets = np.where(affine, np.inf, forgetting_rate(wave, sand, pull, problem.cell))
        field = np.zeros_like(body) if problem.contact == "single" else body
        fastest = np.array([forgets[field == f].max() for f in range(field.max() + 1)])
        bulky = elasticity.is_stiff_in_bulk(law, np.asarray(mu), np.asarray(lam)) & ~stiff
        bulky = np.array([bulky[field == f].all() for f in range(field.max() + 1)])
        masses = [rigid.mass_of(b.position, b.volume * b.density, b.volume) for b in bodies]
        centre = np.stack([m.centre for m in masses])
        return cls(
            body=body,
            mass=volume * density,
            volume=volume,
            law=law.astype(np.int64),
            mu=np.asarray(mu),
            lam=np.asarray(lam),
            yield_stress=gathered("yield_stress"),
            hardening=gathered("hardening"),
            friction_angle=gathered("friction_angle"),
            cohesion=gathered("cohesion"),
            viscosity=gathered("viscosity"),
            rigid=stiff,
            wave_speed=wave,
            forgetting=fastest[field],
            swells=bulky[field],
            total=np.array([m.total for m in masses]),
            centre=centre,
            inertia=np.stack([m.inertia for m in masses]),
            arm=np.concatenate(
                [b.position - m.centre for b, m in zip(bodies, masses, strict=True)]
            ),
            surface=tuple(b.surface - m.centre for b, m in zip(bodies, masses, strict=True)),
        )

    @cached_property
    def half_spacing(self) -> Float[np.ndarray, " P"]:
        """r0: half the distance between particles at rest [m]."""
        return 0.5 * np.cbrt(self.volume)

    def fit(
        self, body: int, position: Float[np.ndarray, "P 3"], velocity: Float[np.ndarray, "P 3"]
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Rigid motion of one body closest to its particles': velocity, angular momentum."""
        mine = self.body == body
        whole = rigid.mass_of(position[mine], self.mass[mine], self.volume[mine])
        return rigid.fit_motion(whole, position[mine], self.mass[mine], velocity[mine])


@dataclass(frozen=True)
class State:
    """What changes. Arrays are replaced, never written to, so an old state stays good."""

    time: Float[np.ndarray, ""]
    position: Float[np.ndarray, "P 3"]
    velocity: Float[np.ndarray, "P 3"]
    affine: Float[np.ndarray, "P 3 3"]
    """C: velocity gradient a particle carries [1/s]."""
    F: Float[np.ndarray, "P 3 3"]
    """Elastic deformation gradient."""
    motion: Float[np.ndarray, "P 3 3"]
    plastic: Float[np.ndarray, " P"]
    volume: Float[np.ndarray, " P"]
    """v_c of granular matter."""
    relief: Float[np.ndarray, " P"]
    """Mean J around a particle less its own; see ``Matter.swells``."""
    centre: Float[np.ndarray, "B 3"]
    """The rest is used for rigid bodies: centre of mass [m] …"""
    speed: Float[np.ndarray, "B 3"]
    """… its velocity [m/s] …"""
    spin_momentum: Float[np.ndarray, "B 3"]
    """… angular momentum about it [kg m²/s] …"""
    rotation: Float[np.ndarray, "B 3 3"]
    """… and how far the body has turned."""

    @classmethod
    def start(cls, problem: Problem, matter: Matter) -> "State":
        """Bodies as the problem has them: undeformed, with their particles' velocities."""
        position = np.concatenate([np.asarray(b.position, np.float64) for b in problem.bodies])
        velocity = np.concatenate([np.asarray(b.velocity, np.float64) for b in problem.bodies])
        count, bodies = len(position), len(problem.bodies)
        identity = np.broadcast_to(np.eye(3), (count, 3, 3))
        fits = [matter.fit(b, position, velocity) for b in range(bodies)]
        state = cls(
            time=np.zeros(()),
            position=position,
            velocity=velocity,
            affine=np.zeros((count, 3, 3)),
            F=identity,
            motion=identity,
            plastic=np.zeros(count),
            volume=np.zeros(count),
            relief=np.zeros(count),
            centre=matter.centre,
            speed=np.stack([linear for linear, _ in fits]),
            spin_momentum=np.stack([angular for _, angular in fits]),
            rotation=np.tile(np.eye(3), (bodies, 1, 1)),
        )
        return state.follow_rigid(matter)

    def spin(self, matter: Matter) -> Float[np.ndarray, "B 3"]:
        """ω of every body [rad/s]; meaningful where rigid."""
        return np.einsum("bij,bj->bi", self.inverse_inertia(matter), self.spin_momentum)

    def inverse_inertia(self, matter: Matter) -> Float[np.ndarray, "B 3 3"]:
        """I⁻¹ of every body in the world frame [1/(kg m²)]; meaningful where rigid."""
        return np.stack(
            [
                rigid.world_inverse_inertia(R, inertia)
                for R, inertia in zip(self.rotation, matter.inertia, strict=True)
            ]
        )

    def follow_rigid(self, matter: Matter) -> "State":
        """Put the particles of rigid bodies where the bodies are: x = X + R r₀, v = V + ω × r."""
        if not matter.rigid.any():
            return self
        body, stiff = matter.body, matter.rigid[:, None]
        spin = self.spin(matter)[body]
        arm = np.einsum("pij,pj->pi", self.rotation[body], matter.arm)
        affine = np.stack([rigid.cross_matrix(w) for w in self.spin(matter)])[body]
        still = np.eye(3)
        return replace(
            self,
            position=np.where(stiff, self.centre[body] + arm, self.position),
            velocity=np.where(stiff, self.speed[body] + np.cross(spin, arm), self.velocity),
            affine=np.where(stiff[:, None], affine, self.affine),
            F=np.where(stiff[:, None], still, self.F),
            motion=np.where(stiff[:, None], still, self.motion),
        )

    def halted(self, matter: Matter, bodies: Collection[int]) -> "State":
        """Return the same place with some bodies' motion taken out."""
        mine, body = self._of(matter, bodies)
        return replace(
            self,
            velocity=np.where(mine[:, None], 0.0, self.velocity),
            affine=np.where(mine[:, None, None], 0.0, self.affine),
            speed=np.where(body[:, None], 0.0, self.speed),
            spin_momentum=np.where(body[:, None], 0.0, self.spin_momentum),
        )

    def placed_as(self, there: "State", matter: Matter, bodies: Collection[int]) -> "State":
        """Return the same motion with some bodies where, and as strained as, they are there."""
        mine, body = self._of(matter, bodies)
        taken = {name: mine for name in ("position", "F", "motion", "plastic", "volume", "relief")}
        taken |= {name: body for name in ("centre", "rotation")}
        found = {}
        for name, chosen in taken.items():
            here = getattr(self, name)
            which = chosen.reshape(-1, *(1,) * (here.ndim - 1))
            found[name] = np.where(which, getattr(there, name), here)
        return replace(self, **found).follow_rigid(matter)

    def _of(self, matter: Matter, bodies: Collection[int]) -> tuple[np.ndarray, np.ndarray]:
        """Which particles and which bodies are meant."""
        body = np.isin(np.arange(len(self.centre)), list(bodies))
        return body[matter.body], body

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Copy everything into a dict."""
        return {f.name: np.array(getattr(self, f.name)) for f in fields(self)}


def elastic_stress(matter: Matter, state: State) -> Float[np.ndarray, "P 3 3"]:
    """Elastic Kirchhoff stress τ [Pa]; none in rigid bodies."""
    m, s = matter, state
    out = np.zeros_like(s.F)
    soft = ~m.rigid
    out[soft] = elasticity.tau(m.law[soft], s.F[soft], m.mu[soft], m.lam[soft])
    k = m.swells
    out[k] += elasticity.tau_relief(m.law[k], s.F[k], m.lam[k], s.relief[k])
    return out


def strain_energy(
    matter: Matter, F: Float[np.ndarray, "P 3 3"], stress: Float[np.ndarray, "P 3 3"]
) -> Float[np.ndarray, " P"]:
    """Elastic energy of each particle [J] at F and the elastic Kirchhoff stress that acts [Pa]."""
    m, out = matter, np.zeros(len(F))
    k, own = m.swells, ~m.rigid & ~m.swells
    out[own] = elasticity.psi(m.law[own], F[own], m.mu[own], m.lam[own])
    out[k] = elasticity.psi_pressed(m.law[k], F[k], m.mu[k], stress[k])
    return m.volume * out


def flowed(matter: Matter, state: State) -> tuple[State, float]:
    """Bring granular and plastic matter back to what it can bear; give the energy lost [J]."""
    F, plastic, volume, loss = state.F.copy(), state.plastic.copy(), state.volume.copy(), 0.0
    mu, lam = matter.mu, matter.lam
    for law in (Law.DRUCKER_PRAGER, Law.VON_MISES):
        k = np.flatnonzero((matter.law == law.value) & ~matter.rigid)
        if law is Law.DRUCKER_PRAGER:
            soil = matter.friction_angle[k], matter.cohesion[k]
            flow = plasticity.flow_drucker_prager(F[k], (mu[k], lam[k]), soil, volume[k])
            volume[k] = flow.volume
        else:
            metal = matter.yield_stress[k], matter.hardening[k]
            flow = plasticity.flow_von_mises(F[k], (mu[k], lam[k]), metal, plastic[k])
        F[k] = flow.F
        plastic[k] += flow.plastic_strain
        loss += float(np.sum(matter.volume[k] * flow.loss))
    return replace(state, F=F, plastic=plastic, volume=volume), loss
