"""Objects for live simulations: models of the showcase, and objects of runs."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.pipeline.mass_posterior import ground_with_mass_posterior
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.segment import segment
from corporeal.scene.vessel_contents import SceneWithMaterials
from corporeal.showcase.prop_models import POOL_PROP_BUILDERS
from corporeal.showcase.showcase_scenes import prop_scene
from corporeal.viewer.run_store import RunStore

SHOWCASE_PREFIX = "corporeal"
"""Prefix of the names of models; that of an object is the name of its run."""
DEFAULT_SETTINGS = Settings()


@dataclass(frozen=True)
class AssetKey:
    """What an object is called: ``corporeal/mug``, or ``RUN/OBJECT``."""

    place: str
    name: str

    @classmethod
    def of(cls, text: str) -> "AssetKey":
        """Read it.

        Raises:
            UserError: It names nothing.
        """
        place, slash, name = text.partition("/")
        if not (place and slash and name):
            raise UserError("Name the object to drop: corporeal/MODEL or RUN/OBJECT.")
        return cls(place, name)


class LiveAssets:
    """Finds what is dropped by its name, made of what it was taken for."""

    def __init__(self, shelf: RunStore) -> None:
        self.shelf = shelf

    def listed(self) -> dict[str, list[dict[str, Any]]]:
        """Return names of models and of the objects of all runs that are filled."""
        runs = [{"run": name, "objects": self._objects(name)} for name in self._filled()]
        ours = [f"{SHOWCASE_PREFIX}/{name}" for name in sorted(POOL_PROP_BUILDERS)]
        return {"models": [{"thing": name} for name in ours], "runs": runs}

    def find(self, text: str) -> SceneWithMaterials:
        """Return a scene of one object alone, at rest, and what it is made of.

        Raises:
            UserError: There is none of this name.
        """
        key = AssetKey.of(text)
        if key.place == SHOWCASE_PREFIX and key.name in POOL_PROP_BUILDERS:
            return _model(key.name)
        if key.place in self._filled():
            whole = self.shelf.open(key.place).made.assembled
            names = [o.name for o in whole.scene.objects]
            if key.name in names:
                return isolate_object(whole, names.index(key.name))
        raise UserError(f"There is no {text!r} to drop: it is neither a model of corporeal nor an object of a run.")

    def _filled(self) -> list[str]:
        return [row["name"] for row in self.shelf.listed() if row["shown"]]

    def _objects(self, run: str) -> list[str]:
        try:
            scene = self.shelf.open(run).made.assembled.scene
        except (UserError, LookupError, OSError):  # it is being made, or went
            return []
        return [o.name for o in scene.objects]


def _model(name: str) -> SceneWithMaterials:
    scene = prop_scene(name)
    inventory = describe(scene, DEFAULT_SETTINGS.describe, DEFAULT_SETTINGS.ground.library)
    parts = segment(scene, inventory, DEFAULT_SETTINGS.segment)
    return SceneWithMaterials(
        scene, parts, ground_with_mass_posterior(scene, parts, inventory, DEFAULT_SETTINGS.ground)
    )


def isolate_object(whole: SceneWithMaterials, k: int) -> SceneWithMaterials:
    """Return a scene of one of its objects, which nothing moves but gravity and what it meets."""
    scene, parts = whole.scene, whole.parts
    own = [s for s in scene.surfaces if s.object == k]
    used = sorted({s.finish for s in own})
    thing = replace(scene.objects[k], velocity=(0.0, 0.0, 0.0), push=None, wind=None, path=None)
    kept = np.flatnonzero(np.array([part.object == k for part in parts.catalogue]))
    return SceneWithMaterials(
        replace(
            scene,
            objects=(thing,),
            surfaces=tuple(replace(s, object=0, finish=used.index(s.finish)) for s in own),
            finishes=tuple(scene.finishes[f] for f in used),
            walls=(),
        ),
        _parts(scene, parts, k, kept),
        _field(whole.field, kept),
    )


def _parts(scene: Scene, parts: Parts, k: int, kept: np.ndarray) -> Parts:
    sizes = [len(s.triangles) for s in scene.surfaces]
    mine = np.repeat([s.object == k for s in scene.surfaces], sizes)
    part = parts.part_of_point[mine]
    return Parts(
        object_of_point=np.zeros(int(mine.sum()), dtype=np.int64),
        part_of_point=np.where(part >= 0, np.searchsorted(kept, part), -1),
        confidence=parts.confidence[mine],
        catalogue=tuple(replace(parts.catalogue[p], object=0) for p in kept.tolist()),
    )


def _field(field: MaterialField, kept: np.ndarray) -> MaterialField:
    rows = np.append(kept, len(field.materials))
    chosen = kept.tolist()
    return MaterialField(
        materials=tuple(field.materials[p] for p in chosen),
        structures=tuple(field.structures[p] for p in chosen),
        words=tuple(field.words[p] for p in chosen),
        friction=field.friction[np.ix_(rows, rows)],
        restitution=field.restitution[np.ix_(rows, rows)],
        pieces=tuple(field.pieces[p] for p in chosen) if field.pieces else (),
        floor=field.floor,
    )
