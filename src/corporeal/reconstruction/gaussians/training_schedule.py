"""The schedule of a training: pictures in two sizes, presets, settings."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, UInt8

from corporeal.core.errors import UserError
from corporeal.core.registry import load_backend
from corporeal.core.types import Views
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians import training_checkpoint
from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints, free_depths
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.kernels_project import PinholeCamera
from corporeal.reconstruction.gaussians.plane_sweep import DEFAULT_SWEEP, PlaneSweepConfig
from corporeal.reconstruction.gaussians.rasteriser_numba import pinhole_of_camera
from corporeal.reconstruction.gaussians.view_depths import ViewDepths
from corporeal.reconstruction.gaussians.visual_hull import CarvedVolume

Masks = Bool[np.ndarray, "V H W"]

COARSE_STEPS_FRACTION, COARSE_STEPS_FRACTION_UNMASKED = 0.4, 0.55
"""Share of the steps that look at pictures of half the size, with masks and without."""
COARSE_STEP_COST = 0.4
"""Time that such a step takes, in steps."""
MIN_HALVED_WIDTH_PX = 64
"""Narrower pictures are not halved [px]."""


@dataclass(frozen=True)
class TrainingPreset:
    """How much work."""

    gaussians: int
    degree: int
    """Of the harmonics."""
    steps: int
    longest: int
    """Larger pictures are shrunk by a whole number until no side is longer [px]."""


TRAINING_PRESETS = {
    "preview": TrainingPreset(4000, 1, 300, 128),
    "draft": TrainingPreset(20_000, 1, 1000, 256),
    "normal": TrainingPreset(30_000, 2, 2500, 512),
}


@dataclass(frozen=True)
class DensificationConfig:
    """When a training moves dead Gaussians to live ones."""

    interval_steps: int = 50
    """Steps between rounds [1]."""
    begin_step: int = 100
    """The first round comes after so many steps [1]."""
    end_fraction: float = 0.8
    """The last round comes before this fraction of all steps [1]."""


DEFAULT_DENSIFICATION = DensificationConfig()


@dataclass(frozen=True)
class TrainConfig:
    """How to learn Gaussians from pictures."""

    preset: Literal["preview", "draft", "normal"] = "normal"
    """preview: rough shapes in some seconds; draft: within a minute on two cores; normal: within four."""
    gaussians: int | None = None
    """How many at most; None: as the preset says."""
    steps: int | None = None
    """None: as the preset says."""
    longest: int | None = None
    """Larger pictures are shrunk until no side is longer [px]; None: as the preset says."""
    begin: Literal["auto", "hull", "inside"] = "auto"
    """With masks: on their visual hull, or some Gaussians inside it, too. A seat between its arms lies below the hull,
    and what begins on that would have to sink there; in an open bowl what begins inside stays there, if that is plain.
    auto: what a small training finds the better; the hull where views are too few to tell."""
    held_out: int = 8
    """Every so-many-th view is not learned from but compared with; 0: none is."""
    seed: int = 0
    """Random seed of the training."""
    threads: int | None = None
    """None: one per processor. Changes no result."""
    rasteriser: Literal["numba", "gsplat"] = "numba"
    """Where pictures are drawn while learning: on the processor, or on a card with CUDA."""
    hull: HullConfig = DEFAULT_HULL
    """How the visual hull is carved, where there are masks."""
    sweep: PlaneSweepConfig = DEFAULT_SWEEP
    """How densely pictures are swept, where there are none."""
    densification: DensificationConfig = DEFAULT_DENSIFICATION
    """When dead Gaussians are moved."""
    checkpoint_interval_s: float = 15.0
    """Time between checkpoints [s]. Changes no result."""


DEFAULT_TRAINING = TrainConfig()
RASTERISER_REGISTRY = {
    "numba": "corporeal.reconstruction.gaussians.rasteriser_numba",
    "gsplat": "corporeal.reconstruction.gaussians.rasteriser_gsplat",
}
"""Modules with the verbs draw and back."""


def validate_rasteriser(rasteriser: str) -> None:
    """Raise UserError where there is no such rasteriser here."""
    if rasteriser == "gsplat":
        load_backend(
            "rasteriser", rasteriser, {"gsplat": "corporeal.reconstruction.gaussians.rasteriser_gsplat:require_cuda"}
        )()


class TrainingSchedule:
    """What each step of a training looks at, and how: pictures in two sizes."""

    def __init__(
        self, views: Views, masks: Masks | None, points: StartPoints | LinesOfSight | None, config: TrainConfig
    ) -> None:
        check_training_views(views, masks)
        preset = TRAINING_PRESETS[config.preset]
        self.preset = replace(
            preset,
            gaussians=config.gaussians or preset.gaussians,
            steps=config.steps or preset.steps,
            longest=config.longest or preset.longest,
        )
        self.config = config
        self.seed, self.rasteriser = config.seed, config.rasteriser
        self.draw, self.back = (
            load_backend("rasteriser", self.rasteriser, {k: f"{m}:{do}" for k, m in RASTERISER_REGISTRY.items()})
            for do in ("draw", "back")
        )
        self.views, self.masks, self.points = views, masks, points
        count = len(views.cameras)
        every = config.held_out
        self.held_out = tuple(range(every // 2, count, every)) if every and count > every else ()
        self.learned = [k for k in range(count) if k not in self.held_out]
        self.radius = find_viewed_region(views.cameras).radius
        self.clear = free_depths(views.cameras)
        factor = -(-max(views.rgb.shape[1:3]) // self.preset.longest)
        halves = min(views.rgb.shape[1:3]) // factor >= MIN_HALVED_WIDTH_PX
        self.surfaces: ViewDepths | None = None
        self.outlines: CarvedVolume | None = None
        self.coarse = (COARSE_STEPS_FRACTION_UNMASKED if masks is None else COARSE_STEPS_FRACTION) * self.preset.steps
        self.sizes = [_PictureSize(self, factor)] + ([_PictureSize(self, 2 * factor)] if halves else [])

    @property
    def name(self) -> str:
        """What a checkpoint of this training is called."""
        cameras = [(c.K.tolist(), c.world_from_camera.tolist()) for c in self.views.cameras]
        p = self.points
        begin = () if p is None else vars(p).values()
        how = self.seed, self.held_out, self.rasteriser, self.config.begin
        passes = self.config.hull, self.config.sweep, self.config.densification
        rest = cameras, self.preset, *how, *passes
        return training_checkpoint.fingerprint(self.views.rgb, self.masks, *begin, *rest)

    def size(self, step: int) -> "_PictureSize":
        """Return the pictures that a step looks at."""
        return self.sizes[-1] if step < self.coarse else self.sizes[0]

    def cost(self, step: int) -> float:
        """Return the time that the steps before this one take, in steps."""
        coarse = self.coarse if len(self.sizes) > 1 else 0.0
        return min(step, coarse) * COARSE_STEP_COST + max(0.0, step - coarse)


class _PictureSize:
    """The pictures, shrunk by a whole number."""

    def __init__(self, schedule: TrainingSchedule, factor: int) -> None:
        views, masks = schedule.views, schedule.masks
        self.rgb = {k: shrink_picture(views.rgb[k], factor) for k in schedule.learned}
        full = {} if masks is None else {k: masks[k] * np.uint8(255) for k in schedule.learned}
        self.masks = {k: shrink_picture(mask[..., None], factor)[..., 0] for k, mask in full.items()}
        self.cameras: dict[int, PinholeCamera] = {}
        for k, picture in self.rgb.items():
            eye = pinhole_of_camera(views.cameras[k], 1 / factor, schedule.clear[k])
            self.cameras[k] = eye._replace(height=picture.shape[0], width=picture.shape[1])


def shrink_picture(picture: UInt8[np.ndarray, "H W C"], factor: int) -> UInt8[np.ndarray, "h w C"]:
    """Return a picture of means over squares of pixels; what is left over at the rim is cut off."""
    if factor == 1:
        return picture
    h, w, c = picture.shape[0] // factor, picture.shape[1] // factor, picture.shape[2]
    cut = picture[: h * factor, : w * factor].reshape(h, factor, w, factor, c)
    return np.round(cut.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)


def check_training_views(views: Views, masks: Masks | None) -> None:
    """Raise UserError where views cannot be learned from."""
    if len(views.cameras) < 2:
        raise UserError("One picture shows no depth. Give at least two, from several sides.")
    if masks is not None and masks.shape != views.rgb.shape[:3]:
        raise UserError(f"Masks are {masks.shape}, but pictures {views.rgb.shape[:3]}.")
