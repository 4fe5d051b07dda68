"""Features of a scene that no format supports, in sentences."""

from collections.abc import Iterator

import numpy as np

from corporeal.core.types import Particles, Scene
from corporeal.export.scene_motion import SceneMotion


def unsupported_features(scene: Scene, particles: Particles, motion: SceneMotion) -> tuple[str, ...]:
    """Name pushes, winds, paths and objects of several bodies, which every format leaves out."""
    return tuple(_feature_sentences(scene, particles, motion))


def _feature_sentences(scene: Scene, particles: Particles, motion: SceneMotion) -> Iterator[str]:
    for thing in scene.objects:
        if thing.push is not None:
            yield f"{thing.name} is pushed in corporeal; no format supports that."
        if thing.path is not None:
            yield f"{thing.name} follows a path in corporeal; no format supports that."
        if thing.wind is not None:
            yield f"Wind blows on {thing.name} in corporeal; no format supports that."
    yield from _poured_sentence(scene, particles)
    stiff = np.array([t.kind == "rigid" for t in particles.treatments])[particles.part]
    for k, thing in enumerate(scene.objects):
        mine = particles.object == k
        if stiff[mine].any() and not motion.is_rigid(k):
            yield (
                f"{thing.name} has rigid parts bonded or jointed to others; it is exported as one "
                "deformable body with the modulus of each part."
            )
    for root in particles.roots:
        name = scene.objects[root.object].name
        yield f"The wood of {name} is held by a rotational spring in its soil, which is left out."


def _poured_sentence(scene: Scene, particles: Particles) -> Iterator[str]:
    for one in particles.contents:
        yield (
            f"{one.thing.name} lies loose in {scene.objects[one.vessel].name} and flows; it is "
            "exported as a soft solid, with its initial mesh in animations."
        )
