"""Settling of bodies in MuJoCo.

The floor meets the exact convex hull of each mesh; bodies meet each other with their convex
pieces, every two bodies with the friction that is certain to hold them. All is computed for a scene
of unit size: lengths are divided by the scene's unit and times by the root of it (Froude's
similarity keeps gravity and friction as they are), because the engine's softness, tolerances and
thresholds are absolute.

Soft contacts and some resistance to rolling bring everything to rest soon, but elsewhere than hard smooth objects rest:
what is round would roll on, and what stands on small faces would tilt. So the resistance is taken away and contacts are
hardened before the end.
"""

# The engine's names come from compiled modules without stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import mujoco
import numpy as np
from jaxtyping import Float

from corporeal.core.errors import UserError
from corporeal.geometry.convex_hull import ConvexPiece
from corporeal.scene.settling_body import BodyPose, MassProperties, SettlingBody, scene_unit_of


@dataclass(frozen=True)
class DropConfig:
    """How long to wait, and what counts as rest, in a scene of unit size."""

    step: float = 2e-3
    """[s]"""
    longest: float = 6.0
    """[s]"""
    calm_after: float = 0.5
    """When velocities begin to be damped [s]."""
    damping: float = 4e-3
    """Share of the velocity taken away at every step from then on."""
    hold: float = 0.25
    """How long objects must stay where they are [s] …"""
    shift: float = 1e-4
    """… but for so much [m]. Contacts on many points chatter: speeds would tell less."""
    chatter: float = 2e-4
    """When time is up so much is let pass [m]: the certificate tells chatter from motion."""
    roll: float = 4.0
    """How long what is round may look for a better place [s]."""
    firm: float = 2.0
    """How long objects may take to find their places on hard ground [s]."""


DEFAULT_DROP_CONFIG = DropConfig()
SPINNING_FRICTION, ROLLING_FRICTION = 0.02, 0.02
"""Coefficients of friction against turning about the normal [unit], and rolling, of a body's extent."""
CONTACT_SOLREF = [0.008, 1.0]
HARD_CONTACT_STEP_S, HARD_CONTACT_TIME_CONSTANT_S = 5e-4, 1e-3
"""Step [s] and time constant [s] of hard contacts: they give way a few thousandths of a millimetre per metre of
scene."""
CONTACT_SOLIMP = [0.95, 0.99, 0.001, 0.5, 2.0]
CONTACT_PARAMETERS = {"solref": CONTACT_SOLREF, "solimp": CONTACT_SOLIMP, "condim": 6}
"""Contact of every geometry."""
FLOOR_AND_HULLS_BIT = 1
"""Bit of contype and conaffinity; pieces meet in explicit pairs only, as the engine would take the larger of two
frictions."""
ADDED_INERTIA_FRACTION = 1e-6
"""Of a body's inertia, added about every axis."""
CONTACT_MEMORY_BYTES = 1 << 30
"""Room for contacts [bytes]; what is not used costs nothing. By itself the engine takes room for about 200, and lets
objects fall through each other at more, or stops."""
CONTACTS_FULL_WARNINGS = (mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL)
"""Warnings of contacts that were left out."""


@dataclass(frozen=True)
class DroppedBodies:
    """Where bodies came to rest, or were when time was up."""

    poses: list[BodyPose]
    seconds: float
    """Simulated, in a scene of unit size [s]."""
    quiet: bool
    """Whether all were at rest."""


def drop_in_mujoco(
    bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], config: DropConfig = DEFAULT_DROP_CONFIG
) -> DroppedBodies:
    """Drop bodies and wait until all are at rest."""
    engine = MujocoScene(bodies, poses, config.step)
    _step_until_rest(engine, config, config.longest, config.calm_after)
    engine.let_roll()
    _step_until_rest(engine, config, config.roll, 0.0)
    engine.harden()
    moved = _step_until_rest(engine, config, config.firm, 0.0)
    return DroppedBodies(engine.poses(), float(engine.data.time), moved < config.chatter)


def _step_until_rest(engine: "MujocoScene", config: DropConfig, longest: float, calm_after: float) -> float:
    """Step until nothing moves for a while, or time is up; return how far objects went last."""
    step = float(engine.model.opt.timestep)
    window, calm = round(config.hold / step), round(calm_after / step)
    before, moved = engine.data.qpos.copy(), np.inf
    for number in range(1, round(longest / step) + 1):
        engine.step()
        if number > calm:
            engine.data.qvel *= 1 - config.damping * step / config.step
        if number % window == 0:
            moved = engine.moved(before)
            if moved < config.shift:
                break
            before = engine.data.qpos.copy()
    return moved


class MujocoScene:
    """One scene in MuJoCo, in lengths of the scene's unit."""

    def __init__(
        self,
        bodies: Sequence[SettlingBody],
        poses: Sequence[BodyPose],
        step: float,
        contact_memory_bytes: int = CONTACT_MEMORY_BYTES,
    ) -> None:
        self.unit, self.count = scene_unit_of(bodies), len(bodies)
        farthest = [np.linalg.norm(b.hull.vertices, axis=1).max() for b in bodies]
        self._radius = np.array(farthest) / self.unit
        spec = _scene_spec(bodies, poses, self.unit, step)
        spec.memory = contact_memory_bytes
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def step(self) -> None:
        """Go one step ahead.

        Raises:
            UserError: More contacts than there is room for.
        """
        try:
            mujoco.mj_step(self.model, self.data)
            full = any(self.data.warning[kind].number for kind in CONTACTS_FULL_WARNINGS)
        except mujoco.FatalError:
            full = True
        if full:
            raise UserError(
                f"Objects touch in more places ({self.data.ncon}) than MuJoCo has room for. Take "
                "fewer or simpler objects, or another arrangement."
            )

    def let_roll(self) -> None:
        """Resist nothing but sliding from now on."""
        self.model.geom_condim[:] = self.model.pair_dim[:] = 3

    def harden(self) -> None:
        """Make contacts hard from now on."""
        self.model.opt.timestep = HARD_CONTACT_STEP_S
        self.model.geom_solref[:, 0] = self.model.pair_solref[:, 0] = HARD_CONTACT_TIME_CONSTANT_S

    def roughen(self, friction: Sequence[float]) -> None:
        """Give every body, and where it meets others, its own friction; the rougher one counts."""
        own = np.array([0.0, *friction])[self.model.geom_bodyid]
        self.model.geom_friction[:, 0] = own
        rougher = np.maximum(own[self.model.pair_geom1], own[self.model.pair_geom2])
        self.model.pair_friction[:, :2] = rougher[:, None]

    def send(self, number: int, velocity: Float[np.ndarray, "2"]) -> None:
        """Let a body go along the floor with a velocity [m/s]."""
        self.data.qvel.reshape(self.count, 6)[number, :2] = velocity / self.unit**0.5

    def speed(self) -> float:
        """Largest speed of any body's origin [unit/s]."""
        return float(np.linalg.norm(self.data.qvel.reshape(self.count, 6)[:, :3], axis=1).max())

    def near(self, distance: float) -> set[tuple[int, int]]:
        """Pairs of bodies that are no farther apart than that [unit]."""
        model = self.model
        reaches = model.geom_margin, model.geom_gap, model.pair_margin, model.pair_gap
        for reach in reaches:
            reach[:] = distance
        mujoco.mj_forward(model, self.data)
        found = self.touching()
        for reach in reaches:
            reach[:] = 0.0
        return found

    def touching(self) -> set[tuple[int, int]]:
        """Pairs of bodies that touch now, the smaller number first."""
        owners = self.model.geom_bodyid[self.data.contact.geom.reshape(-1, 2)] - 1
        return {(int(min(p)), int(max(p))) for p in owners if min(p) >= 0}

    def moved(self, before: Float[np.ndarray, " Q"]) -> float:
        """How far at most any point of any body went since an earlier ``qpos`` [unit]."""
        was, now = before.reshape(self.count, 7), self.data.qpos.reshape(self.count, 7)
        shift = np.linalg.norm(now[:, :3] - was[:, :3], axis=1)
        half = np.minimum(1.0, 0.5 * np.linalg.norm(now[:, 3:] - was[:, 3:], axis=1))
        return float((shift + 4 * np.arcsin(half) * self._radius).max())

    def poses(self) -> list[BodyPose]:
        """Where bodies are [m]."""
        found = []
        for row in self.data.qpos.reshape(self.count, 7):
            x, y, z, qw, qx, qy, qz = (float(value) for value in row)
            position = (x * self.unit, y * self.unit, z * self.unit)
            norm = float(np.linalg.norm(row[3:]))
            found.append(BodyPose(position, (qw / norm, qx / norm, qy / norm, qz / norm)))
        return found


def _scene_spec(bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], unit: float, step: float) -> mujoco.MjSpec:
    spec = _floor_spec(step)
    # Contacts are as soft for any mass; only masses near the engine's smallest number matter.
    lightest = min(b.mass for b in bodies)
    for k, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        node = spec.worldbody.add_body(name=f"{k}", pos=np.array(pose.position) / unit, quat=pose.quaternion)
        if body.inertial:
            _give_inertia(node, body.inertial, unit, lightest)
        node.add_freejoint()
        density = 0.0 if body.inertial else body.density * unit**3 / lightest
        _add_shape(spec, node, body, k, unit, density)
    for a, b in combinations(range(len(bodies)), 2):
        _add_contact_pairs(spec, bodies, (a, b), unit)
    return spec


def _floor_spec(step: float) -> mujoco.MjSpec:
    """Return a scene with a floor and nothing else, to be solved by steps of ``step`` [s]."""
    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.iterations = 100
    spec.option.noslip_iterations = 4
    spec.option.tolerance = 1e-10
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[5, 5, 0.1],
        friction=[0.0, 0.0, 0.0],  # the larger of two counts: the hull's
        contype=FLOOR_AND_HULLS_BIT,
        conaffinity=0,
        **CONTACT_PARAMETERS,
    )
    return spec


def _add_shape(
    spec: mujoco.MjSpec, node: "mujoco.MjsBody", body: SettlingBody, number: int, unit: float, density: float
) -> None:
    """Give body ``number`` its hull, which meets the floor, and its pieces, which meet others'."""
    friction = [body.grip_on(None), SPINNING_FRICTION, ROLLING_FRICTION * body.extent / unit]
    _add_piece_mesh(spec, f"{number} hull", body.hull, unit)
    node.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=f"{number} hull",
        mass=0,
        friction=friction,
        contype=0,
        conaffinity=FLOOR_AND_HULLS_BIT,
        **CONTACT_PARAMETERS,
    )
    for k, piece in enumerate(body.pieces):
        name = _piece_name(number, k)
        _add_piece_mesh(spec, name, piece, unit)
        node.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            density=density,
            friction=friction,
            contype=0,
            conaffinity=0,
            **CONTACT_PARAMETERS,
        )


def _piece_name(body: int, number: int) -> str:
    return f"{body} piece {number}"


def _add_contact_pairs(
    spec: mujoco.MjSpec, bodies: Sequence[SettlingBody], numbers: tuple[int, int], unit: float
) -> None:
    """Let every piece of one body meet every piece of another."""
    one, other = (bodies[k] for k in numbers)
    sliding, roll = one.grip_on(other), ROLLING_FRICTION * max(one.extent, other.extent) / unit
    first, second = ([_piece_name(k, number) for number in range(len(bodies[k].pieces))] for k in numbers)
    for a in first:
        for b in second:
            spec.add_pair(
                geomname1=a,
                geomname2=b,
                condim=6,
                friction=[sliding, sliding, SPINNING_FRICTION, roll, roll],
                solref=CONTACT_SOLREF,
                solimp=CONTACT_SOLIMP,
            )


def _give_inertia(node: "mujoco.MjsBody", inertial: MassProperties, unit: float, lightest: float) -> None:
    """Return how a body's mass lies, in units of length and of the lightest mass."""
    tensor = inertial.inertia / (lightest * unit**2)
    # The engine refuses what is thinner than any body can be.
    tensor = tensor + ADDED_INERTIA_FRACTION * np.trace(tensor) * np.eye(3)
    node.explicitinertial = True
    node.mass = inertial.mass / lightest
    node.ipos = inertial.centre / unit
    node.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]


def _add_piece_mesh(spec: mujoco.MjSpec, name: str, piece: ConvexPiece, unit: float) -> None:
    spec.add_mesh(
        name=name,
        uservert=(piece.vertices / unit).astype(np.float32).ravel(),
        userface=piece.triangles.astype(np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
    )
