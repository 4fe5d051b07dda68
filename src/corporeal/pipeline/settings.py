"""Settings of a run: one configuration per stage, and the validation of each."""

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from corporeal.core import registry
from corporeal.core.errors import UserError, check_range
from corporeal.core.setting_types import ReadsPath
from corporeal.core.types import Vector
from corporeal.description.describe_config import DescribeConfig
from corporeal.io.length_units import LengthUnit
from corporeal.mpm.engines import DEFAULT_ENGINE, engine_class, require_of_class
from corporeal.mpm.problem import BodySplittingEngine, InteractiveEngine
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.render.video_choices import CameraShot, ColourQuantity

SHIPPED_LIBRARIES = ("default", "reference")
FIELD_FILES = ("vomp", "pixie", "table")
"""Kinds of fields that are read from files."""
MIN_SPEED_RATIO, MAX_SPEED_RATIO = 0.01, 100.0
MAX_SLOW_MOTION_RATIO = 100.0


@dataclass(frozen=True)
class AssembleConfig:
    """How files become a scene."""

    objects: Literal["auto", "one", "nodes"] = "auto"
    """How a model file is split into objects. auto: one object per node that states a class; without any, per connected
    group of touching pieces, where two pieces named as objects stay apart. one: the whole file is one object.
    nodes: each branch below the root is one object.
    """
    stack: bool = False
    """Put the files above each other, the first at the bottom, instead of side by side."""
    drop: float = 0.0
    """Initial clearance of each object above its support, as a multiple of its own size."""
    lift: tuple[str, ...] = ()
    """Raise one object by a height, such as "duck=0.5" [m]."""
    velocity: tuple[str, ...] = ()
    """An object's initial velocity, such as "duck=1,0,-2" [m/s]."""
    extent: tuple[str, ...] = ()
    """Longest side of the real object's bounding box, such as "duck=0.1" [m]."""
    unit: LengthUnit = "auto"
    """Length of one unit of a mesh file; auto: as the file states, else the unit that gives a plausible size."""
    working_extent: float | None = None
    """Scale the whole scene so that its largest extent is this [m]."""
    duration: float | None = None
    """Simulated time [s]; by default from the scene file, else three times the longest fall plus 1 s (at most 3 s), and
    until the last force ends."""
    fps: int | None = None
    """Frames per second of the video; by default from the scene file, else 30."""


def validate_assemble(config: AssembleConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.discretization.object_scaling import parse_extent
    from corporeal.scene.initial_state import parse_initial_velocity, parse_lift  # NumPy: help needs none

    check_range("The drop", config.drop, 0.0, 100.0)
    check_range("The working extent", config.working_extent, 1e-3, 1e3)
    check_range("The duration", config.duration, 0.01, 60.0)
    check_range("The fps", config.fps, 1, 1000)
    for text in config.extent:
        parse_extent(text, "it")
    for text in config.lift:
        parse_lift(text)
    for text in config.velocity:
        parse_initial_velocity(text)


@dataclass(frozen=True)
class SegmentConfig:
    """Part segmentation of objects reconstructed from pictures. Parts of a model file are its nodes and materials."""

    position_weight: float = 0.3
    """Weight of position relative to appearance features; 0: position is not used."""


def validate_segment(config: SegmentConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    check_range("--position-weight", config.position_weight, 0.0, 100.0)


@dataclass(frozen=True)
class GroundConfig:
    """Sources of material values."""

    library: Annotated[str, ReadsPath(names=SHIPPED_LIBRARIES)] = "default"
    """Material library: "default", "reference" (22 materials as first published, a baseline), or a TOML file."""
    floor: str = "concrete"
    """Material of the floor and the walls, for friction and restitution."""
    neutral: str = "plastics-PP"
    """Material assumed for parts of unknown material; plastics-PP is polypropylene."""
    field: Annotated[str, ReadsPath(prefixes=FIELD_FILES)] = ""
    """Material parameters from another method: vomp:PATH, pixie:PATH or table:PATH.csv (one file for the scene, or a
    folder with one file per object); one[:E=2e6,nu=.4,rho=200] for the same values everywhere; omniphysgs for the
    constants in its code (E 2 MPa, ν 0.4, ρ 1000 kg/m³).
    """


def validate_ground(config: GroundConfig) -> None:
    """Raise UserError where a material or a file is unknown or unsuitable."""
    from corporeal.fields.field_specification import parse_field_specification  # help reads no library
    from corporeal.materials.range_placement import library_entry

    library_entry(config.floor, config.library)
    if library_entry(config.neutral, config.library).group == "liquid":
        raise UserError(f"--neutral {config.neutral} is a liquid and cannot be the material of a part.")
    parse_field_specification(config.field)


@dataclass(frozen=True)
class FillConfig:
    """How objects are filled with material points."""

    detail: Literal["draft", "normal", "fine"] = "draft"
    """Resolution of the simulation grid and limit on the number of time steps."""
    stiffness: Literal["true", "capped"] = "true"
    """true: measured Young's moduli, as far as the limit on time steps allows; capped: moduli capped so that a fixed
    time step is stable, a baseline for comparison."""
    walls: Literal["thickened", "shells"] = "thickened"
    """thickened: a deformable wall thinner than two cells is simulated two cells thick and softer, so that it keeps its
    mass and its bending or indentation stiffness, but not its stiffness in the plane; shells (experimental): as a
    triangle shell with its true thickness."""
    seed: int = 0
    """Random seed of measuring and filling objects."""


def validate_fill(config: FillConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    check_range("--seed", config.seed, 0, 2**63)


@dataclass(frozen=True)
class SimulateConfig:
    """Solver settings."""

    engine: Literal["cpu", "cuda", "reference"] = DEFAULT_ENGINE
    """cpu: compiled, multi-threaded; cuda: the same method on an NVIDIA GPU; reference: NumPy in double precision,
    slow, for verification.
    """
    contact: Literal["multi", "single"] = "multi"
    """multi: one velocity field per object, with friction between them; single: one shared
    field, a control in which touching objects stick together.
    """
    breaking: bool = False
    """Simulate fracture of brittle objects where the impact energy exceeds ten times E₅₀, the energy that breaks half
    of such objects; otherwise a warning names the objects that would break.
    """


def validate_simulate(config: SimulateConfig) -> None:
    """Raise UserError where the engine cannot run."""
    if config.breaking:
        for capability in (InteractiveEngine, BodySplittingEngine):
            require_of_class(engine_class(config.engine), capability)
        if config.contact != "multi":
            raise UserError("--breaking works with contact multi alone. Leave out --contact.")
    if config.engine == "cuda":
        registry.load_backend("engine", "cuda", {"cuda": "corporeal.mpm.cuda.engine:require_device"})("cuda")


@dataclass(frozen=True)
class VideoConfig:
    """Camera, size and quality of the video."""

    width: int = 1280
    """Width of the video [px]."""
    height: int = 720
    """Height of the video [px]."""
    quality: Literal["draft", "normal", "fine"] = "draft"
    """Rays per pixel; draft reuses the background where no object affects it, and supersamples edges."""
    speed: float = 1.0
    """Playback speed; 1: real time, 0.25: quarter speed."""
    view: Vector | None = None
    """Direction from the scene to the camera; by default one in which objects hide little of each other."""
    stills: bool = False
    """Also keep every frame as PNG."""
    look: Literal["surfaces", "gaussians"] | None = None
    """What is rendered; by default Gaussians where the scene was reconstructed, else surfaces."""
    colour_by: Literal["itself", "speed"] | ColourQuantity = "itself"
    """Quantity shown by colour, with a colour bar; itself: the objects' own colours."""
    shot: CameraShot = "wide"
    """wide: everything within 2.5 sizes of the scene; close: the first contact or the largest motion; follow: the
    camera tracks what moves.
    """
    slow: float = 1.0
    """Slow-motion factor around the first contact: 1 is none, 4 is four times slower."""
    caption: bool = True
    """Overlay the simulated time."""


def validate_video(config: VideoConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.render.video_file import check_size  # imports the encoder, which the help does not need

    check_size(config.width, config.height)
    check_range("--speed", config.speed, MIN_SPEED_RATIO, MAX_SPEED_RATIO)
    check_range("--slow", config.slow, 1.0, MAX_SLOW_MOTION_RATIO)
    if config.view is not None and not 0 < math.hypot(*config.view) < math.inf:
        given = " ".join(f"{x:g}" for x in config.view)
        raise UserError(f"--view is {given}, which is not a direction. For example: --view 1 -1 0.5.")


@dataclass(frozen=True)
class Settings:
    """One configuration per stage."""

    reconstruct: ReconstructConfig = field(default_factory=ReconstructConfig)
    assemble: AssembleConfig = field(default_factory=AssembleConfig)
    describe: DescribeConfig = field(default_factory=DescribeConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    fill: FillConfig = field(default_factory=FillConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    video: VideoConfig = field(default_factory=VideoConfig)
