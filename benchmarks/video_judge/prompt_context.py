"""Facts of a scene in the question to a judge: its objects and their initial state, never what happens."""

import numpy as np

from corporeal.core.types import Keyframes, Push, Scene, Vector, Wind
from corporeal.simulation.simulation_result import PreparedScene

REST_SPEED_M_S = 0.005
"""What is slower starts at rest [m/s]."""


def scene_facts(prepared: PreparedScene) -> str:
    """Write the facts of a scene, a line an object, for all of its videos alike."""
    scene = prepared.scene
    lines = [_object(prepared, k) for k in range(len(scene.objects))]
    pull = float(np.linalg.norm(scene.gravity))
    lines.append(f"Gravity is {pull:.2f} m/s²; the floor is level and hard.")
    if scene.walls:
        lines.append(f"There are {len(scene.walls)} flat walls besides the floor.")
    lines.append(f"The film lasts {scene.duration:.2g} s. Nothing else acts.")
    return "\n".join(f"- {line}" for line in lines)


def _object(prepared: PreparedScene, k: int) -> str:
    scene, particles = prepared.scene, prepared.particles
    thing = scene.objects[k]
    mine = np.concatenate([s.vertices for s in scene.surfaces if s.object == k])
    sides = " x ".join(f"{100 * s:.3g}" for s in np.ptp(mine, axis=0).tolist())
    mass = float(particles.mass[particles.object == k].sum())
    low = 100 * float(mine[:, 2].min())
    place = "on the floor or on what is below it" if low < 1.0 else f"{low:.3g} cm above the floor"
    what = f"{thing.name} ({thing.class_name}), {sides} cm, {_mass(mass)}: {_made_of(prepared, k)}"
    return f"{what}. It starts with its lowest point {place}, {_moving(thing.velocity)}." + _acts(scene, k)


def _made_of(prepared: PreparedScene, k: int) -> str:
    """Name the materials of an object's parts and how they are built, each once."""
    field, said = prepared.field, []
    for number, part in enumerate(prepared.parts.catalogue):
        if part.object != k:
            continue
        material = field.materials[number].name.replace("_", " ")
        structure = field.structures[number]
        words = f"{part.name} of {material}"
        if structure.kind == "shell" and structure.thickness:
            words += f", a wall of {1e3 * structure.thickness:.2g} mm"
        elif structure.kind == "filled" and structure.contents:
            words += f", filled with {structure.contents.name.replace('_', ' ')}"
        else:
            words += ", solid"
        said.append(words)
    return "; ".join(dict.fromkeys(said))


def _mass(mass: float) -> str:
    return f"{1e3 * mass:.3g} g" if mass < 1.0 else f"{mass:.3g} kg"


def _moving(velocity: Vector) -> str:
    speed = float(np.linalg.norm(velocity))
    if speed < REST_SPEED_M_S:
        return "at rest"
    return f"with a velocity of {_vector(velocity)} m/s (z is up)"


def _acts(scene: Scene, k: int) -> str:
    """Describe the push, the wind and the prescribed motion of an object."""
    thing, said = scene.objects[k], []
    if isinstance(thing.push, Push):
        said.append(
            f"it is pushed with {_vector(thing.push.acceleration)} m/s² {_span(thing.push.start, thing.push.end)}"
        )
    if isinstance(thing.wind, Wind):
        said.append(f"wind of {_vector(thing.wind.velocity)} m/s blows {_span(thing.wind.start, thing.wind.end)}")
    if isinstance(thing.path, Keyframes):
        said.append("it is led along a prescribed path")
    return "".join(f" From outside, {words}." for words in said)


def _span(start: float, end: float) -> str:
    return f"from {start:.3g} s" + (f" to {end:.3g} s" if np.isfinite(end) else " on")


def _vector(values: Vector) -> str:
    return "(" + ", ".join(f"{v:.3g}" for v in values) + ")"
