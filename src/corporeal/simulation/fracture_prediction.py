"""Prediction of brittle fracture at the first impact of each other body.

The simulation keeps such parts whole, unless ``breaking`` is set. Here the energy of the impact is compared with what
half of such parts bear (``fracture``). Impacts after the first of a pair are not looked at: a vase that falls over
where it stood, and what bounces, are judged by their first touch.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, QhullError

from corporeal.core.audit_data import FLOOR_NAME, PredictedBreakage
from corporeal.core.types import FractureEvent, Frame, MaterialField, Particles, Scene, Trajectory
from corporeal.geometry.mesh import join_meshes
from corporeal.materials import find_material
from corporeal.mpm.physics.springs import rotation_vector
from corporeal.simulation.impact_fracture import BrittleForm, BrittlePart, ElasticSolid, breakage_word

FLOOR_MATERIAL = "concrete"
"""Name of the floor and the walls."""
SHEET_ASPECT_RATIO = 8.0
"""A solid whose second side is so many times its first is a sheet [-]."""
ROUND_ASPECT_RATIO = 1.5
"""A closed wall is round where its longest side is less than this times its shortest [-]."""
MIN_HULL_FILL_FRACTION = 0.5
"""Share of its convex hull that a closed outer surface encloses at least; with less, its mesh shows both faces of a
wall."""
WELD_EXTENT_RATIO = 1e-6
"""Vertices nearer than this share of an object's extent are one."""
FREE_FLIGHT_FRAMES = 1.5
"""Frames for which what touched nothing is in free flight."""


@dataclass(frozen=True)
class _ImpactMotion:
    """Motion and inertia of an object just before an impact."""

    velocity: Float[np.ndarray, "3"]
    """Where it is struck [m/s]."""
    inverse_mass: float
    """1/M of its centre [1/kg]; 0: it cannot be moved."""
    inverse_inertia: Float[np.ndarray, "3 3"]
    arm: Float[np.ndarray, "3"]
    """Of the struck point from its centre [m]."""

    def softness(self, normal: Float[np.ndarray, "3"]) -> float:
        """1/m_eff along the normal [1/kg]."""
        lever = np.cross(self.arm, normal)
        return self.inverse_mass + float(lever @ self.inverse_inertia @ lever)


@dataclass(frozen=True)
class BrittleImpact:
    """The first impact of another body, or of a plane, on a brittle part."""

    object: int
    part: int
    other: int | None
    """The other object; None: a plane."""
    point: Float[np.ndarray, "3"]
    """Where it struck [m]."""
    away: Float[np.ndarray, "3"]
    """Unit: how it pushes the part."""
    found: PredictedBreakage


FIXED_MOTION = _ImpactMotion(np.zeros(3), 0.0, np.zeros((3, 3)), np.zeros(3))


def predict_breakage(
    scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory
) -> tuple[PredictedBreakage, ...]:
    """Predict breakage of every brittle rigid part by its hardest first impact; of fractured ones, by that."""
    found = {one.part: fracture_event_of(one, scene, field) for one in trajectory.breaks}
    pieces = piece_objects(trajectory.breaks, len(scene.objects))
    for impact in first_impacts(scene, particles, field, trajectory):
        known = found.get(impact.part)
        if impact.object not in pieces and (known is None or impact.found.ratio > known.ratio):
            found[impact.part] = impact.found
    return tuple(found[k] for k in sorted(found))


def fracture_event_of(one: FractureEvent, scene: Scene, field: MaterialField) -> PredictedBreakage:
    """Describe a fracture."""
    return PredictedBreakage(
        object=scene.objects[one.object].name,
        part=field.words[one.part].name,
        by=one.by,
        time=one.time,
        speed=one.speed,
        energy=one.impact_energy,
        ratio=one.ratio,
        word=breakage_word(one.ratio),
        pieces=len(one.surfaces),
    )


def piece_objects(breaks: Sequence[FractureEvent], objects: int) -> set[int]:
    """Return the objects that are fragments, which don't break again."""
    more = sum(len(one.surfaces) - 1 for one in breaks)
    return {one.object for one in breaks} | set(range(objects - more, objects))


def first_impacts(
    scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory
) -> tuple[BrittleImpact, ...]:
    """Find every first impact on a brittle rigid part."""
    if not _brittle(particles, field).any():
        return ()
    return tuple(_FirstImpacts(scene, particles, field, trajectory).all())


def _brittle(particles: Particles, field: MaterialField) -> np.ndarray:
    """Which parts are rigid and of brittle material."""
    return np.array(
        [
            t.kind == "rigid" and m.strength_local is not None
            for t, m in zip(particles.treatments, field.materials, strict=True)
        ]
    )


class _FirstImpacts:
    """The first impacts of a run."""

    def __init__(self, scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory) -> None:
        self.scene, self.particles, self.field = scene, particles, field
        self.trajectory, self.ledger = trajectory, trajectory.ledger
        self.brittle = _brittle(particles, field)
        hard = find_material(FLOOR_MATERIAL).ranges
        self.floor = ElasticSolid(hard["young_pa"].typical, hard["poisson"].typical)

    def all(self) -> Iterator[BrittleImpact]:
        """Every first impact on a brittle part."""
        first = self.ledger.first_contact[-1]
        objects = len(self.scene.objects)
        for a in range(objects):
            for c in range(len(first)):
                if c != a and np.isfinite(first[a, c]):
                    found = self._judge_first_touch(a, c, float(first[a, c]))
                    if found is not None:
                        yield found

    def _judge_first_touch(self, a: int, c: int, time: float) -> BrittleImpact | None:
        """Judge the first touch of an object with another or a plane; None: it is not brittle."""
        objects = len(self.scene.objects)
        k = max(0, int(np.searchsorted(self.ledger.time, time, side="right")) - 1)
        point = self.ledger.contact_point[-1][a, c]
        frame = self.trajectory.frames[k]
        part = self._struck(frame, a, point)
        if not self.brittle[part]:
            return None
        other, partner = FIXED_MOTION, self.floor
        if c < objects:
            other = self._mover(frame, k, c, time, point)
            material = self.field.materials[self._struck(frame, c, point)]
            partner = ElasticSolid(material.young_pa, material.poisson)
        mine, normal = self._mover(frame, k, a, time, point), self._normal(a, c, k)
        closing = float((mine.velocity - other.velocity) @ normal)
        speed = abs(closing)
        softness = mine.softness(normal) + other.softness(normal)
        energy = 0.5 * speed**2 / softness if softness > 0.0 else 0.0
        struck = self._form(part, self._roundness(c, point, frame))
        ratio = energy / struck.breaking_energy(partner)
        names = [thing.name for thing in self.scene.objects]
        said = PredictedBreakage(
            object=names[a],
            part=self.field.words[part].name,
            by=names[c] if c < objects else FLOOR_NAME,
            time=time,
            speed=speed,
            energy=energy,
            ratio=ratio,
            word=breakage_word(ratio),
        )
        away = -normal if closing > 0.0 else normal
        return BrittleImpact(a, part, c if c < objects else None, point, away, said)

    def _struck(self, frame: Frame, number: int, point: Float[np.ndarray, "3"]) -> int:
        """Part of an object that is nearest to a point."""
        mine = np.flatnonzero(self.particles.object == number)
        away = np.linalg.norm(frame.position[mine] - point, axis=1)
        return int(self.particles.part[mine[np.argmin(away)]])

    def _mover(self, frame: Frame, k: int, number: int, time: float, point: Float[np.ndarray, "3"]) -> _ImpactMotion:
        """How an object moves at a time [s] after frame k, before it is struck at a point [m]."""
        mine = np.flatnonzero(self.particles.object == number)
        mass, place = self.particles.mass[mine], frame.position[mine]
        total, late = float(mass.sum()), time - float(self.ledger.time[k])
        centre = mass @ place / total
        velocity = self.ledger.momentum[k, number] / self.ledger.mass[k, number]
        if self._flies(k, number):
            velocity = velocity + np.array(self.scene.gravity) * late
        arm = point - centre
        velocity = velocity + np.cross(self._spin(k, mine), arm)
        if self.scene.objects[number].path is not None:
            return _ImpactMotion(velocity, 0.0, np.zeros((3, 3)), arm)
        r = place - centre
        spread = (r * mass[:, None]).T @ r
        own = float(np.sum(mass * self.particles.volume[mine] ** (2.0 / 3.0))) / 6.0
        inertia = (np.trace(spread) + own) * np.eye(3) - spread
        return _ImpactMotion(velocity, 1.0 / total, np.linalg.inv(inertia), arm)

    def _flies(self, k: int, number: int) -> bool:
        """Whether an object touched nothing in the last frames before frame k."""
        ledger = self.ledger
        step = float(ledger.time[1] - ledger.time[0]) if len(ledger.time) > 1 else 0.0
        last = ledger.last_contact[k, number]
        return not bool(np.any(last > ledger.time[k] - FREE_FLIGHT_FRAMES * step))

    def _spin(self, k: int, mine: Int[np.ndarray, " N"]) -> Float[np.ndarray, "3"]:
        """Spin of an object between the frame before and frame k [rad/s]; 0 at the start."""
        if k == 0:
            return np.zeros(3)
        before, now = (self.trajectory.frames[i].deformation[mine[0]] for i in (k - 1, k))
        left, _, right = np.linalg.svd(now @ np.linalg.inv(before))
        return rotation_vector(left @ right) / float(self.ledger.time[k] - self.ledger.time[k - 1])

    def _normal(self, a: int, c: int, k: int) -> Float[np.ndarray, "3"]:
        """Direction of an impact: a plane's normal, else that of the momentum it gave."""
        objects = len(self.scene.objects)
        if c >= objects:
            normals = [(0.0, 0.0, 1.0), *(wall.normal for wall in self.scene.walls)]
            return np.array(normals[c - objects])
        ledger, after = self.ledger, min(k + 1, len(self.ledger.time) - 1)
        pull = np.array(self.scene.gravity) * float(ledger.time[after] - ledger.time[k])
        given = ledger.momentum[after, a] - ledger.momentum[k, a] - ledger.mass[k, a] * pull
        size = float(np.linalg.norm(given))
        if size > 0.0:
            return given / size
        away = ledger.centre[k, c] - ledger.centre[k, a]
        return away / np.linalg.norm(away)

    def _roundness(self, c: int, point: Float[np.ndarray, "3"], frame: Frame) -> float:
        """Radius of what strikes [m]: half the shortest side of the part; inf of a plane."""
        if c >= len(self.scene.objects):
            return np.inf
        return self._sides(self._struck(frame, c, point))[0] / 2.0

    def _form(self, k: int, other_radius: float) -> BrittlePart:
        """Geometry class of a part for ``fracture``."""
        material, structure = self.field.materials[k], self.field.structures[k]
        owner = int(self.particles.object[np.flatnonzero(self.particles.part == k)[0]])
        short, middle, long = self._sides(k)
        scale = self.scene.objects[owner].scale
        wall = max(self.particles.walls[k]) if self.particles.walls else 0.0
        if wall == 0.0 and structure.kind != "solid":
            wall = (structure.thickness or 0.0) * scale
        solid = ElasticSolid(material.young_pa, material.poisson)
        assert material.strength_local is not None
        form: BrittleForm = "lump"
        thickness, length, radius = 0.0, short, short / 2.0
        if middle > SHEET_ASPECT_RATIO * short:
            form, thickness, length = "plate", wall or self._sheet(k, owner, short), middle
            # It is flat: what strikes it is round, or else its own edge.
            radius = other_radius if np.isfinite(other_radius) else thickness / 2.0
            other_radius = np.inf
        elif wall > 0.0:
            closed = long < ROUND_ASPECT_RATIO * short and encloses_cavity(self.scene, owner)
            form = "closed" if closed else "tube"
            length = long if long > 1.2 * middle else short
            thickness, radius = wall, middle / 2.0
        strength = material.strength_local
        return BrittlePart(form, solid, strength, radius, thickness, length, other_radius)

    def _sheet(self, k: int, owner: int, short: float) -> float:
        """Mean thickness of a solid sheet [m], 2 V/A with both faces in A.

        A plate with a rim is thinner than its box is high. Where an object has several parts, the area of one is not
        known, and the box's shortest side counts.
        """
        if np.any((self.particles.object == owner) & (self.particles.part != k)):
            return short
        mesh = join_meshes([s for s in self.scene.surfaces if s.object == owner])
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
        volume = float(self.particles.volume[self.particles.part == k].sum())
        return min(short, 2.0 * volume / area)

    def _sides(self, k: int) -> list[float]:
        """Sides of a part's box at the start [m], shortest first: along the axes, or as it lies."""
        mine = self.particles.part == k
        spacing = float(np.mean(self.particles.volume[mine] ** (1.0 / 3.0)))
        place = self.particles.position[mine]
        own = np.linalg.svd(place - place.mean(axis=0), full_matrices=False)[2].T
        boxes = [np.ptp(place @ frame, axis=0) + spacing for frame in (np.eye(3), own)]
        return sorted(min(boxes, key=np.prod).tolist())


def encloses_cavity(scene: Scene, number: int) -> bool:
    """Whether an object's surface encloses a cavity."""
    mesh = join_meshes([s for s in scene.surfaces if s.object == number])
    fine = WELD_EXTENT_RATIO * float(np.ptp(mesh.vertices, axis=0).max())
    _, one = np.unique(np.round(mesh.vertices / fine), axis=0, return_inverse=True)
    faces = one.reshape(-1)[mesh.triangles]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), 1)
    if np.any(np.unique(edges, axis=0, return_counts=True)[1] % 2):
        return False
    corner = mesh.vertices[mesh.triangles] - mesh.vertices.mean(axis=0)
    volume = float(np.sum(corner[:, 0] * np.cross(corner[:, 1], corner[:, 2]))) / 6.0
    try:
        return volume > MIN_HULL_FILL_FRACTION * float(ConvexHull(mesh.vertices).volume)
    except QhullError:
        return False
