"""A scene as OpenUSD in text: ``sim.usda`` to simulate, ``film.usda`` to show.

``geometry.usda`` has the shapes, ``physics.usda`` what simulates, ``motion.usda`` the samples.
Never samples and physics in one stage: a simulated body with samples contradicts itself, and
readers of physics take defaults.
"""

from pathlib import Path

from corporeal.core.version import __version__
from corporeal.export.few_corners import ON_CARD, colliders, with_few_corners
from corporeal.export.solids import PhysicalScene
from corporeal.export.target import Asked, Written
from corporeal.export.usd_geometry import WORLD, geometry
from corporeal.export.usd_motion import motion_prims
from corporeal.export.usd_physics import fitted, physics
from corporeal.io.usd_text import Layer, Prim

GEOMETRY, PHYSICS, MOTION = "geometry.usda", "physics.usda", "motion.usda"
SIM, FILM = "sim.usda", "film.usda"


def write_usd(asked: Asked, folder: Path) -> Written:
    """Write the layers and the stages that are made of them."""
    config = asked.config
    scene, thickened = with_few_corners(asked.scene, config.hull_vertices)
    _write(folder / GEOMETRY, scene, geometry(scene, folder, config.soft))
    _write(folder / PHYSICS, scene, physics(scene, config.friction_for, config.soft))
    _compose(folder / SIM, scene, (PHYSICS, GEOMETRY), 0)
    if asked.motion.moves:
        last = len(asked.motion.time) - 1
        _write(folder / MOTION, scene, motion_prims(scene, asked.motion), last)
        _compose(folder / FILM, scene, (MOTION, GEOMETRY), last)
    misfit = fitted(scene, config.friction_for).misfit
    measured = {"friction_misfit": misfit, "hull_corners": float(_corners(scene))}
    if thickened:
        measured["hull_thickened_m"] = thickened
    return Written(tuple(_unsaid(asked, _corners(scene))), measured)


def _corners(scene: PhysicalScene) -> int:
    """Return how many corners the collider of most corners has."""
    return max((len(c.shape.vertices) for s in scene.solids for c in colliders(s)), default=0)


def _unsaid(asked: Asked, corners: int) -> list[str]:
    sentences = [
        "Friction of pairs is fitted by one coefficient a part; all pairs are in the customData "
        "of /World."
    ]
    soft = [s.title for s in asked.scene.solids if not s.rigid]
    if soft and asked.config.soft == "none":
        sentences.append(f"{', '.join(soft)} can deform and is not simulated.")
    elif soft:
        sentences.append(
            f"{', '.join(soft)} can deform: Newton reads it; PhysX on the processor and MuJoCo do "
            "not, and what lies on it falls through."
        )
    if corners > ON_CARD:
        sentences.append(
            f"A convex collider has {corners} corners; PhysX on a card takes {ON_CARD}: "
            f"--hull-vertices {ON_CARD}."
        )
    return sentences


def _write(path: Path, scene: PhysicalScene, world: Prim, last: int = 0) -> None:
    _save(path, Layer(WORLD, float(scene.fps), last, comment=_words(scene), prims=[world]))


def _compose(path: Path, scene: PhysicalScene, layers: tuple[str, ...], last: int) -> None:
    below = tuple(f"./{name}" for name in layers)
    _save(path, Layer(WORLD, float(scene.fps), last, below, comment=_words(scene)))


def _save(path: Path, layer: Layer) -> None:
    with path.open("w", encoding="utf-8", newline="\n") as file:
        layer.write(file)


def _words(scene: PhysicalScene) -> str:
    credits = f" Contains: {'; '.join(scene.credits)}." if scene.credits else ""
    return f"Written by corporeal {__version__}.{credits}"
