"""Settings of the stage reconstruct, with validation."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from corporeal.core.errors import UserError, check_range
from corporeal.core.setting_types import NoOption, ReadsPath
from corporeal.geometry.gaussian_transforms import MAX_COORDINATE_UNITS, UpAxisChoice
from corporeal.multiview.metric_scale import MeasuredDistance, MetricScale, stated_metric_scale
from corporeal.reconstruction.features import ENCODER_REGISTRY as ENCODERS
from corporeal.reconstruction.features import connect_encoder
from corporeal.reconstruction.features.mask_models import MASK_MODEL_REGISTRY as MASKERS
from corporeal.reconstruction.features.mask_models import connect_mask_model, split_model_spec
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.surface.surface_config import DEFAULT_CLOSED_SURFACE, ClosedSurfaceConfig

SegmentationRule = Literal["auto", "masks", "look", "components"]


MASKS_AUTO, MASKS_NONE = "auto", "none"
EncoderSpec = Annotated[str, ReadsPath(prefixes=tuple(ENCODERS))]


@dataclass(frozen=True)
class ReconstructionResolution:
    """How finely a reconstruction looks and carves."""

    rendered_views: int = 48
    """Pictures of a splat that comes without cameras [1]."""
    rendered_size_px: tuple[int, int] = (384, 384)
    """Width and height of these [px]."""
    hull_grid_cells: int = DEFAULT_HULL.grid_cells
    """Cells of the grid that visual hulls are carved from [1]."""
    object_grid_cells: int = DEFAULT_CLOSED_SURFACE.object_grid_cells
    """Cells of the grid about each object that its surface is carved from, about [1]."""

    @property
    def hull(self) -> HullConfig:
        """How visual hulls are carved."""
        return HullConfig(grid_cells=self.hull_grid_cells)

    @property
    def surface(self) -> ClosedSurfaceConfig:
        """How finely closed surfaces are carved."""
        return ClosedSurfaceConfig(object_grid_cells=self.object_grid_cells, hull=self.hull)


DEFAULT_RESOLUTION = ReconstructionResolution()


@dataclass(frozen=True)
class ReconstructConfig:
    """Reconstruction from photographs, a video or a splat. For a model file only --up has an effect."""

    object_names: tuple[str, ...] = ()
    """Names of the objects in the pictures or the splat, in order of decreasing size, such as "armchair" "soda can"; no
    effect for model files."""
    count: int | None = None
    """Number of objects; by default that of --object-names, else from --vlm, instance masks or an estimate."""
    apart: SegmentationRule = "auto"
    """How the scene is segmented into objects: by instance masks (masks), by appearance features and concavity (look),
    or by connected components (components, a baseline); auto: masks where there are instance masks, else look."""
    masks: Annotated[str, ReadsPath(prefixes=tuple(MASKERS), names=(MASKS_AUTO, MASKS_NONE))] = "auto"
    """Foreground masks: a folder of mask images; or "sam3:FOLDER", "sam2:FOLDER" or "birefnet:FOLDER", where FOLDER
    holds the weights of that model; auto: the masks beside the photographs, else masks grown from the region that all
    cameras look at; none: no masks, and those beside the photographs serve the estimation of poses alone; whatever
    stands on the floor is then an object. An alpha channel always counts."""
    up: UpAxisChoice = "auto"
    """Up axis of the input file (photographs, splat or mesh); auto: as the file states, else estimated from the
    cameras, else as usual for the format."""
    floor_at: float | None = None
    """Height of the floor along the up axis [unit of the file]; by default a plane is fitted; if none is found, the
    floor is placed below the lowest points."""
    metres_per_unit: float | None = None
    """Length of one unit of the file [m]; by default from --known-distance or --extent, else as a file in metres
    states, else from the usual size of such objects."""
    known_distance: MeasuredDistance | None = None
    """Two points in the file's coordinates and their true distance in metres: x1 y1 z1 x2 y2 z2 d."""
    training: Literal["preview", "draft", "normal"] = "normal"
    """Duration of training on two cores: preview: seconds; draft: about one minute; normal: about four minutes."""
    rasteriser: Literal["numba", "gsplat"] = "numba"
    """Rasteriser for training: numba on the CPU, or gsplat on a CUDA GPU."""
    semantic: EncoderSpec = "descriptor"
    """Image features used to match points with names of objects and parts: "clip", "clip:FOLDER" with weights in
    FOLDER, or "descriptor": hand-crafted, no weights, and no matching with names."""
    structural: EncoderSpec = "descriptor"
    """Image features used to segment parts: "dinov2", "dinov2:FOLDER" with weights in FOLDER, or "descriptor"
    (hand-crafted, no weights)."""
    lifting: Literal["uplift", "back-projection", "radiance"] = "uplift"
    """How image features are lifted to points: to Gaussians by their blending weights (uplift) or by back-projection,
    or to points of a radiance field, which is then trained as well."""
    force: bool = False
    """Continue where reconstruction would stop because its result looks unusable (wrong poses, incomplete views,
    objects as large as the room, held-out photographs reproduced badly)."""
    training_seed: int = 0
    """Random seed of reconstruction."""
    resolution: Annotated[ReconstructionResolution, NoOption()] = DEFAULT_RESOLUTION
    """Sizes of pictures and grids."""


DEFAULT_RECONSTRUCT = ReconstructConfig()


def validate_reconstruct(
    config: ReconstructConfig, extents: Sequence[str] = (), asked: bool = False, source: str = ""
) -> None:
    """Raise UserError where a setting cannot be right, whatever the pictures.

    Args:
        config: What was asked for.
        extents: Real largest extents, such as "duck=0.1" [m].
        asked: Whether a person or a model will be asked for the objects.
        source: What the pictures are called.
    """
    # A person who asks for help needs neither what trains nor what answers.
    from corporeal.reconstruction.gaussians import training_schedule
    from corporeal.vlm.photographed_objects import check_stated_extents, object_of_usual_size

    check_range("--count", config.count, 1, 1000)
    check_range("--training-seed", config.training_seed, 0, 2**63)
    check_range("--floor-at", config.floor_at, -MAX_COORDINATE_UNITS, MAX_COORDINATE_UNITS)
    if config.count and config.object_names and config.count != len(config.object_names):
        raise UserError(
            f"--count is {config.count}, but --object-names names {len(config.object_names)} objects. Omit "
            "--count, or name all of them."
        )
    if config.object_names or not asked:
        check_stated_extents(extents, [object_of_usual_size(name) for name in config.object_names], source)
    for spec in (config.semantic, config.structural):
        connect_encoder(spec)  # who is to look must be there before anything is learned
    training_schedule.validate_rasteriser(config.rasteriser)
    _check_masks(config)
    metric_scale(config)


def _check_masks(config: ReconstructConfig) -> None:
    if config.apart == "masks" and config.masks == MASKS_NONE:
        raise UserError("--apart masks needs masks, and --masks none ignores them. Omit one of the two.")
    if config.masks in (MASKS_AUTO, MASKS_NONE):
        return
    if split_model_spec(config.masks) is None:
        if not Path(config.masks).expanduser().is_dir():
            raise UserError(
                f"There is no folder {config.masks} for --masks. Name a folder of masks, or "
                f"{', '.join(f'{kind}:FOLDER' for kind in MASKERS)}."
            )
    elif connect_mask_model(config.masks).needs_words and not config.object_names:
        raise UserError("These masks are found by words: name the objects with --object-names.")


def metric_scale(config: ReconstructConfig) -> MetricScale | None:
    """Return the scale that the settings state; None: they state none."""
    from corporeal.vlm.photographed_objects import COMMAND_LINE_SOURCE

    return stated_metric_scale(config.metres_per_unit, config.known_distance, COMMAND_LINE_SOURCE)
