"""The data that pass between the stages, in the order they appear. Read this file first.

Every array states its shape and its unit. All quantities are SI. Frames are right-handed with +Z
up and the floor at z = 0; quaternions are (w, x, y, z); cameras follow OpenCV. A name ``x_of_y``
is an index array: for each y, which x. Letters in shapes: V vertices, T triangles, P particles,
N points, K parts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int, UInt8

Vector = tuple[float, float, float]
SUBSTANCE, MATTER = "substance", "stated_matter"
"""Keys of a surface's extras: the name of what a file says that it is made of, and all that the
file says of it (``values``, ``words``)."""

# ---------------------------------------------------------------- what comes in


@dataclass(frozen=True)
class Finish:
    """How a surface looks: a physically based material, as glTF defines it."""

    name: str
    colour: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Base colour factor, linear RGBA."""
    texture: UInt8[np.ndarray, "H W C"] | None = None
    """Base colour picture, sRGB (C = 3) or sRGB with alpha (C = 4)."""
    metallic: float = 0.0
    roughness: float = 1.0
    transmission: float = 0.0
    glow: float = 0.0
    """Emitted light as a multiple of the base colour."""
    alpha_mode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alpha_cutoff: float = 0.5
    translucency: float = 0.0
    """Share of the diffuse light that comes through from behind: leaves, lampshades."""


@dataclass(frozen=True)
class Surface:
    """One triangle mesh with one finish, posed in the world."""

    name: str
    """The mesh's or node's name in the file, for people and for the recogniser."""
    object: int
    """Index into ``Scene.objects``."""
    finish: int
    """Index into ``Scene.finishes``."""
    vertices: Float[np.ndarray, "V 3"]
    """World position [m]."""
    triangles: Int[np.ndarray, "T 3"]
    """Vertex numbers, anticlockwise seen from outside."""
    normals: Float[np.ndarray, "V 3"] | None = None
    """Unit shading normals."""
    uv: Float[np.ndarray, "V 2"] | None = None
    """Texture coordinates as in glTF: v runs down."""
    colours: Float[np.ndarray, "V C"] | None = None
    """Linear RGB or RGBA that multiplies the finish, in [0, 1]."""
    extras: dict = field(default_factory=dict)
    """What the file says of this node beside its shape (``substance``, ``shell_thickness_m``)."""


@dataclass(frozen=True)
class Push:
    """A uniform acceleration of one whole object within a time window."""

    acceleration: Vector
    """[m/s²]"""
    start: float = 0.0
    """[s]"""
    end: float = float("inf")
    """[s]"""


@dataclass(frozen=True)
class Keyframes:
    """Prescribed motion of a rigid object: how far it has moved and turned at given times.

    N rows, the first of them where the object starts. Between rows all is smooth (monotone cubic
    interpolation); before the first and after the last the object rests.
    """

    time: tuple[float, ...]
    """Rising [s]."""
    shift: tuple[Vector, ...]
    """From the start, of what was then the middle of the underside of its bounding box [m]; the
    first is zero."""
    turn: tuple[Vector, ...]
    """Rotation vector from the row before, about that point [rad]; the first is zero."""


@dataclass(frozen=True)
class Wind:
    """Air that blows on one whole object within a time window; at rest it only slows down."""

    velocity: Vector
    """Of the air [m/s]."""
    gust: float = 0.0
    """By how much of itself the velocity swells and falls, 0 to 1 [-]."""
    start: float = 0.0
    """[s]"""
    end: float = float("inf")
    """[s]"""


@dataclass(frozen=True)
class Wall:
    """A plane that nothing passes, beside the floor; as rough as the floor."""

    normal: Vector
    """Unit, out of the wall into the room."""
    point: Vector
    """Any point of it [m]."""


Objects = Literal["auto", "one", "nodes"]
"""What counts as one object within a file."""


@dataclass(frozen=True)
class SceneObject:
    """One separable object, and how it starts."""

    name: str
    class_name: str
    """What it is, in words ("soda can"); the name without its number when the file says no more."""
    real_extent: float
    """Largest extent of the real object [m]."""
    scale: float = 1.0
    """Scene size over real size."""
    velocity: Vector = (0.0, 0.0, 0.0)
    """[m/s]"""
    push: Push | None = None
    wind: Wind | None = None
    path: Keyframes | None = None
    """Prescribed motion, as one rigid body, whatever it meets."""
    source: str = ""
    """The file it came from."""
    credit: str = ""
    """Licence and attribution, where the file states them."""
    sized_by: str = ""
    """The source of the real object's size, in a clause; "": the file."""
    mass: float | None = None
    """As the file states it, of the object in the scene [kg]; None: its materials say."""

    @property
    def stem(self) -> str:
        """Name of the file that it came from, without folders and suffix."""
        return self.source.replace("\\", "/").rsplit("/", 1)[-1].rsplit(".", 1)[0]


@dataclass(frozen=True)
class Scene:
    """Several objects in space, the forces on them, and how long to watch."""

    name: str
    source: str
    objects: tuple[SceneObject, ...]
    surfaces: tuple[Surface, ...]
    finishes: tuple[Finish, ...]
    metres_per_unit: float = 1.0
    """What one unit of the file was taken to be [m]."""
    gravity: Vector = (0.0, 0.0, -9.81)
    """[m/s²]"""
    walls: tuple[Wall, ...] = ()
    """Beside the floor, which is always there."""
    duration: float = 2.0
    """[s]"""
    fps: int = 60
    settled: bool = False
    """Whether everything that lies or stands has come to rest before it begins: then what is soft
    finds its balance before time 0, and pushes, winds and velocities begin there."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the input, in sentences."""
    hints: tuple[str, ...] = ()
    """What was decided though it could be meant otherwise, and the option that says so."""

    @property
    def object_of_triangle(self) -> Int[np.ndarray, " T"]:
        """For each triangle of all surfaces in order, its object."""
        return np.repeat(
            np.array([s.object for s in self.surfaces], dtype=np.int64),
            [len(s.triangles) for s in self.surfaces],
        )


@dataclass(frozen=True)
class Camera:
    """A pinhole camera and where it stands: x to the right, y down, z ahead (OpenCV).

    A world point X is seen at (u, v, 1) ~ K (camera_from_world X). Pixel (row, column) covers
    u from column to column + 1 and v from row to row + 1; its middle is half a pixel further.
    """

    K: Float[np.ndarray, "3 3"]
    """Picture from camera coordinates [px]."""
    world_from_camera: Float[np.ndarray, "4 4"]
    """Rotation and place [m]."""
    width: int
    """[px]"""
    height: int
    """[px]"""


@dataclass(frozen=True)
class Views:
    """Pictures of one scene from several sides, all of one size; V views, H rows, W columns."""

    rgb: UInt8[np.ndarray, "V H W 3"]
    """sRGB."""
    cameras: tuple[Camera, ...]
    """One per view."""
    depth: Float[np.ndarray, "V H W"] | None = None
    """Of what the middle of each pixel shows, along the camera's z [m]; inf where there is nothing.
    The floor is something."""
    normals: Float[np.ndarray, "V H W 3"] | None = None
    """Of the facets: unit, in the world, towards the camera; 0 where there is nothing."""
    object_of_pixel: Int[np.ndarray, "V H W"] | None = None
    """Index into ``Scene.objects``; -1: the floor, or nothing."""
    part_of_pixel: Int[np.ndarray, "V H W"] | None = None
    """Which part; of pictures made from surfaces, an index into ``Scene.surfaces``. -1: none."""


@dataclass(frozen=True)
class Gaussians:
    """A scene as a cloud of N soft ellipsoids (3D Gaussian splatting, Kerbl et al. 2023).

    One is exp(-x^T Σ^-1 x / 2) about its mean, Σ = R diag(scale²) R^T. Seen along the unit vector
    d (from the camera to the mean) its colour is 0.5 + Σ_k sh_k Y_k(d) in sRGB, Y as in
    ``geometry.harmonics``.
    """

    mean: Float[np.ndarray, "N 3"]
    """[m], or the file's unit where its size is not stated."""
    rotation: Float[np.ndarray, "N 4"]
    """World from the ellipsoid's axes: unit quaternions (w, x, y, z)."""
    scale: Float[np.ndarray, "N 3"]
    """Standard deviations along the ellipsoid's axes [m]."""
    opacity: Float[np.ndarray, " N"]
    """At the mean, in [0, 1]."""
    sh: Float[np.ndarray, "N K 3"]
    """Colour: K = (degree + 1)² coefficients of real spherical harmonics for R, G and B."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the input, in sentences."""

    @property
    def count(self) -> int:
        """Number of Gaussians N."""
        return len(self.mean)


@dataclass(frozen=True)
class Cloud:
    """Points of a scene with what they look like to a model; N points."""

    position: Float[np.ndarray, "N 3"]
    """World position [m]."""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    semantic: Float[np.ndarray, "N S"]
    """What it is: unit vectors, comparable with words where they come from CLIP."""
    structural: Float[np.ndarray, "N D"]
    """Which part of an object it is: unit vectors."""
    seen: Int[np.ndarray, " N"]
    """In how many views; 0: its features are its neighbours'."""
    gaussian_of_point: Int[np.ndarray, " N"] | None = None
    """Where points are Gaussians' means, or were sampled from Gaussians."""

    @property
    def count(self) -> int:
        """Number of points N."""
        return len(self.position)


@dataclass(frozen=True)
class Reconstruction:
    """A scene found in pictures or in a trained splat: in metres, +Z up, the floor at z = 0."""

    gaussians: Gaussians
    object_of_gaussian: Int[np.ndarray, " N"]
    """Index into ``names``; -1: the floor, the background, or haze."""
    cloud: Cloud
    """On the objects: means of Gaussians, or points of a radiance field."""
    object_of_point: Int[np.ndarray, " M"]
    """Of the cloud's points."""
    names: tuple[str, ...]
    """Of the objects."""
    boxes: Float[np.ndarray, "K 2 3"]
    """Of the objects' surfaces: low and high corners [m]."""
    metres_per_unit: float
    """What one unit of the file was taken to be [m]."""
    world_from_file: Float[np.ndarray, "4 4"]
    """Takes places in the file's frame and unit to the scene's [m]."""
    statements: tuple[str, ...] = ()
    """How it was made and how sure that is, in sentences, for the report."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the input, in sentences."""


# ---------------------------------------------------------------- what it is, in words


@dataclass(frozen=True)
class Placement:
    """Where inside a measured range somebody put a value. It cannot leave the range."""

    fraction: float
    """0: the low end, 1: the high end; on a logarithmic scale where the range is wide."""
    chosen_by: Literal["model", "recording", "fallback", "evidence"]
    reason: str
    """Why there, in one sentence."""


Built = Literal["solid", "shell", "sheet", "hollow", "filled", "packed"]
"""How a part is made: solid throughout; a wall, open or closed (``shell``, where nobody says which;
``sheet`` open: cup, plate, lid, cover; ``hollow`` closed about air); a wall with contents behind it
(``filled``); or parts and air (``packed``)."""
WALLED: tuple[str, ...] = ("shell", "sheet", "hollow", "filled")
"""What has a wall."""


@dataclass(frozen=True)
class Hypothesis:
    """One way a part may be: of what, how built, with what in it, and where in its ranges."""

    material: str | None
    """A name from the library; None: unknown."""
    structure: Built | None
    probability: float
    """In [0, 1]; those of a part add up to 1 at most."""
    contents: str | None = None
    fill: float | None = None
    """Share of the room behind the wall that the contents take up, in [0, 1]."""
    solidity: float | None = None
    """Of what is packed: share of its outer shape that is matter, in [0, 1]."""
    reading: str = ""
    """What the whole object is then ("imitation"): ways of one reading are drawn together."""
    reason: str = ""
    placements: dict[str, Placement] = field(default_factory=dict)


@dataclass(frozen=True)
class PrintedFact:
    """Something that is printed on an object and says how much of it there is."""

    kind: str
    """"net weight", "total weight", "volume", "size", "count" or "other"."""
    value: float | None
    """[kg], [m³] or [m]; None: not a number that weighs."""
    words: str
    """As read."""


@dataclass(frozen=True)
class Evidence:
    """An estimate of an object's mass made without the library: it reweights, and sets no value."""

    low: float
    """90 % of what it may weigh lies between ``low`` and ``high`` [kg]."""
    likely: float
    """[kg]"""
    high: float
    """[kg]"""
    reason: str
    printed: tuple[PrintedFact, ...] = ()
    answered_by: Literal["model", "recording"] = "model"


Speaker = Literal["annotation", "recording", "model", "metadata", "unknown"]


@dataclass(frozen=True)
class Swelling:
    """How much of what a scan draws of a part the real part takes up: scans thicken what is thin.

    Shares of volume [-]: 1 where the model is as thick as the real thing.
    """

    low: float
    """90 % of what it may be lies between ``low`` and ``high``."""
    likely: float
    high: float
    reason: str
    answered_by: Literal["model", "recording"] = "model"


@dataclass(frozen=True)
class PartWords:
    """The description of one part: what it is made of and how, and by what source."""

    name: str
    material: str | None
    """A name from the library; None: unknown, which is a normal answer."""
    structure: Built | None = None
    """How the part is made; None: unknown, the shape decides."""
    thickness: float | None = None
    """Thickness of the wall of what is a shell or filled, where it is known [m]."""
    answered_by: Speaker = "unknown"
    margin: float = 0.0
    """How sure: 0 (a guess) to 1 (stated outright)."""
    reason: str = ""
    """Why this answer, in one sentence."""
    values: dict[str, float] = field(default_factory=dict)
    """Numbers that a person stated: field of ``Material`` → value, SI."""
    stated: "dict[str, Ground]" = field(default_factory=dict)
    """Numbers that the scene's file states, with who says so; a person's go before them."""
    contents: str | None = None
    """A name from the library: what is behind the wall of what is filled."""
    fill: float | None = None
    """Share of the room behind the wall that the contents take up, in [0, 1]."""
    solidity: float | None = None
    """Of what is packed: share of its outer shape that is matter, in [0, 1]."""
    hypotheses: tuple[Hypothesis, ...] = ()
    """All ways it may be, the one above among them, likeliest first; empty: only the one above."""
    placements: dict[str, Placement] = field(default_factory=dict)
    """Field of ``Material`` → where in its range a model put it; fields not named are typical."""
    inflation: float | None = None
    """Gauge pressure of the air sealed behind the wall [Pa]; 0: no more than around it; None: it is
    not sealed."""
    rebound: float | None = None
    """Restitution on a hard floor that rules ask of balls of its name [-]; None: none is known."""
    volume_share: float = 1.0
    """Of a piece: its outer shape's share of the volume inside the part's surface, in [0, 1]."""
    surface_share: float = 1.0
    """Of a piece: the area of its own outer face over that of the part's surface, in [0, 1]."""
    inside: str = ""
    """Of a piece: the piece that encloses it; "": it lies at the part's surface."""
    inner_share: float = 0.0
    """Of a piece: the share of the same volume that lies within pieces inside it, in [0, 1]."""
    missing: bool = False
    """Whether the mesh does not show this piece, as a scanner does not see glass."""
    pieces: "tuple[PartWords, ...]" = ()
    """What the part consists of where its mesh does not tell them apart: the shaft and the handle
    of a scanned screwdriver. The words above are then those of the piece that matters most."""
    built_by: Speaker = "unknown"
    """The source of how it is built; ``answered_by``: of what it is made of."""
    swelling: Swelling | None = None
    """How much of what the mesh draws of it is real; None: nobody said, the mesh counts."""
    wall_unseen: bool = False
    """Whether its surface need not show the inner face of its wall, as pictures do not where that
    is plain: how thick the surface draws it tells nothing."""

    @property
    def alternatives(self) -> tuple[tuple[str, float], ...]:
        """Other materials it may be, with the probabilities of all ways that have them."""
        found: dict[str, float] = {}
        for way in self.hypotheses:
            if way.material not in (None, self.material):
                found[str(way.material)] = found.get(str(way.material), 0.0) + way.probability
        return tuple(found.items())


def in_way(words: PartWords, way: Hypothesis) -> PartWords:
    """Let a part be in one of its ways: of that, built so, with that in it."""
    return replace(
        words,
        material=way.material,
        structure=way.structure,
        contents=way.contents,
        fill=way.fill,
        solidity=way.solidity,
        placements=way.placements,
        reason=way.reason,
    )


@dataclass(frozen=True)
class Account:
    """What one of several answers to the same questions says of one object."""

    parts: tuple[PartWords, ...]
    evidence: Evidence | None = None


@dataclass(frozen=True)
class ObjectWords:
    """One object's parts, in words."""

    name: str
    class_name: str
    parts: tuple[PartWords, ...]
    usual_extent: float | None = None
    """How large such an object usually is, as a model says [m]."""
    evidence: Evidence | None = None
    """An estimate of its mass made without the library; None: nobody was asked."""
    answers: tuple[Account, ...] = ()
    """Each of several answers, as a whole; what stands above pools them. Empty: one was given."""


@dataclass(frozen=True)
class Usage:
    """What the questions to models took; nothing where nothing was asked."""

    models: tuple[str, ...] = ()
    """Who answered, as a person types it, or whoever gave the recorded answers."""
    questions: int = 0
    calls: int = 0
    """Requests that were sent; 0 where all answers came from the disk."""
    input_tokens: int = 0
    output_tokens: int = 0
    seconds: float = 0.0
    """Of waiting [s]."""
    dollars: float | None = 0.0
    """At list prices [US$]; None where one model's price is not known."""
    prices_of: str = ""
    """Date of the list prices."""


NOTHING_ASKED = Usage()


@dataclass(frozen=True)
class Inventory:
    """What is in the scene, in words only. Objects are in the scene's order."""

    objects: tuple[ObjectWords, ...]
    transcript: tuple[dict, ...] = ()
    """Every question put to a model with its answer, as data."""
    usage: Usage = NOTHING_ASKED
    """What the questions took."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the answers, in sentences."""


@dataclass(frozen=True)
class Part:
    """One entry of the catalogue of parts."""

    name: str
    object: int
    found_by: str
    """What the part was separated by: "node", "material", "whole object" …"""


@dataclass(frozen=True)
class Parts:
    """Which point belongs to which object and part. A mesh's points are its triangles, in order."""

    object_of_point: Int[np.ndarray, " N"]
    part_of_point: Int[np.ndarray, " N"]
    """Index into ``catalogue``; -1: none."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]."""
    catalogue: tuple[Part, ...]
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know, in sentences."""


# ---------------------------------------------------------------- what it is made of


class Law(Enum):
    """How a material answers to strain: each stands in the file of its name in ``mpm/laws``."""

    COROTATED = 0
    NEO_HOOKEAN = 1
    HENCKY = 2
    DRUCKER_PRAGER = 3
    """Hencky elasticity with the Drucker–Prager cone: sand, soil, snow."""
    VON_MISES = 4
    """Hencky elasticity with the von Mises cylinder: metals, plasticine."""
    FLUID = 5
    """Pressure of its volume, and a shear stress that its rate makes: liquids and pastes."""


@dataclass(frozen=True)
class Range:
    """An interval of measured values with the usual one, and where it was read."""

    low: float
    typical: float
    high: float
    source: str
    """Citation key, resolved in ``materials/sources.toml``."""

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Ground:
    """Why one value is what it is."""

    value: float
    """SI."""
    range: Range
    """The measured interval the value was chosen from, SI."""
    chosen_by: str
    """"typical", "model", "recording", "annotation", "fallback" …"""
    reason: str
    margin: float = 0.0
    """How sure the material is, and so its range: 0 (a guess) to 1 (stated outright)."""


@dataclass(frozen=True)
class Material:
    """A grounded material: numbers that were looked up, never invented. All SI."""

    name: str
    law: Law
    young: float
    """Young's modulus [Pa]."""
    poisson: float
    """Poisson's ratio [-]."""
    density: float
    """Mass density [kg/m³]."""
    yield_stress: float | None = None
    """Von Mises yield stress [Pa]; None where the law does not yield."""
    strength: float | None = None
    """Of what breaks before it yields: in bending or in tension, of a whole bar [Pa]."""
    friction_angle: float | None = None
    """Internal friction angle of a granular material [rad]."""
    cohesion: float | None = None
    """Of a granular material [Pa]."""
    hardening: float = 0.0
    """Linear isotropic hardening modulus of a metal [Pa]."""
    friction: float = 0.5
    """This surface's own sliding friction, combined where no pair is measured [-]."""
    restitution: float = 0.5
    """Normal restitution where rigid meets rigid [-]."""
    loss: float = 0.0
    """Loss factor at a blow: tan δ of the bulk at an impact's frequencies and strains [-]."""
    shell_thickness: float | None = None
    """How thin such objects are usually made [m]; None: solid as a rule."""
    viscosity: float | None = None
    """η of a liquid whose stress is proportional to its shear rate [Pa s]."""
    consistency: float | None = None
    """K_c of any other liquid or paste [Pa sⁿ]: its stress beyond yielding, at a rate of 1/s."""
    flow_index: float = 1.0
    """n of that: the stress grows with the rate to this power [-]."""
    yield_shear: float = 0.0
    """Shear stress below which a paste does not flow [Pa]."""
    strength_local: float | None = None
    """Tension that a brittle material bears over a square millimetre [Pa]; None: not brittle, or
    nobody measured it."""
    grounds: dict[str, Ground] = field(default_factory=dict)
    """Field name → why, for every measured number above."""

    @property
    def thickness_of_flow(self) -> float:
        """K_c of a liquid, whose viscosity it is where n is 1 [Pa sⁿ]; 0 of what is none."""
        return self.consistency or self.viscosity or 0.0


@dataclass(frozen=True)
class Structure:
    """How one part is built."""

    kind: Literal["solid", "shell", "filled"]
    thickness: float | None = None
    """Of the wall of a shell, or of what is filled [m]."""
    reason: str = ""
    contents: Material | None = None
    """What is behind the wall of what is filled; None: air."""
    fill: float = 0.0
    """Share of the room behind the wall that the contents take up, in [0, 1]."""
    loose: bool = False
    """Whether the contents lie at the bottom, as liquids and grains do; else they are all over."""
    inflated: bool = False
    """Whether wall and contents, sealed air, are one soft solid: of mass over volume all through.
    """
    gauge: float | None = None
    """Pressure of air sealed behind an elastic wall that bears more than the air does, above that
    around it [Pa]; None: there is none, or the air bears more."""
    rebound: float | None = None
    """Restitution that rules ask of an inflated ball of its name [-]; None: none is known."""
    solidity: float = 1.0
    """Share of a solid's shape that is matter, the rest being air between its pieces; 1: all."""
    holds: str = ""
    """What moves by itself behind the wall of a shell, as an object of its own; "": nothing."""
    sealed: bool = False
    """Whether air is sealed behind a wall that resists a dent more than the air does."""


@dataclass(frozen=True)
class Piece:
    """One of several objects that share a part's mesh."""

    words: PartWords
    material: Material
    structure: Structure


@dataclass(frozen=True)
class WeighedHypothesis:
    """One way the parts of an object may be, with what it then weighs."""

    words: str
    """Materials and builds of all parts that are in doubt."""
    probability: float
    """After the evidence, in [0, 1]."""
    prior: float
    """Before it, in [0, 1]."""
    mass: float
    """Median of its draws [kg]."""


@dataclass(frozen=True)
class AnsweredMass:
    """What one of several answers says that an object weighs."""

    mass: float
    """Median over its own ways and ranges, without outside evidence [kg]."""
    judged: float | None
    """What it was judged to weigh outright [kg]; None: nobody was asked, or no usable answer."""
    low: float = 0.0
    """5 % [kg]; 0, as ``high``: older runs did not keep it."""
    high: float = 0.0
    """95 % [kg]."""
    words: str = ""
    """Its likeliest way, as in ``WeighedHypothesis``; "": older runs did not keep it."""
    probability: float = 0.0
    """How likely it takes that way to be, in [0, 1]."""


@dataclass(frozen=True)
class MassMixture:
    """What one object may weigh, over all ways it may be, and over all ranges."""

    object: str
    mass: float
    """Median [kg]: it minimises the expected error of the logarithm."""
    low: float
    """5 % [kg]."""
    high: float
    """95 % [kg]."""
    mass_without: float
    """Median without outside evidence [kg]."""
    low_without: float
    """[kg]"""
    high_without: float
    """[kg]"""
    hypotheses: tuple[WeighedHypothesis, ...] = ()
    """Likeliest first."""
    evidence: Evidence | None = None
    warning: str = ""
    """Where outside evidence contradicts all that was drawn: what would reconcile them."""
    answers: tuple[AnsweredMass, ...] = ()
    """Of each of several answers; empty: one was given."""


@dataclass(frozen=True)
class MaterialField:
    """What every part is made of; K parts in the catalogue's order."""

    materials: tuple[Material, ...]
    """One per part."""
    structures: tuple[Structure, ...]
    """One per part."""
    words: tuple[PartWords, ...]
    """The answer each material was chosen from, one per part."""
    friction: Float[np.ndarray, "K1 K1"]
    """Sliding friction between parts [-], K1 = K + 1; the last row and column are the floor and the
    walls."""
    restitution: Float[np.ndarray, "K1 K1"]
    """Newton's coefficient between rigid parts [-]; last row and column as above."""
    pieces: tuple[tuple[Piece, ...], ...] = ()
    """Per part, of what it consists where its mesh does not tell; empty: nowhere more than one."""
    mixtures: tuple[MassMixture, ...] = ()
    """Per object that a model described, what it may weigh; empty: no model was asked."""
    notes: tuple[str, ...] = ()
    """What a reader of the report should know of numbers from elsewhere, in sentences."""
    floor: Material | None = None
    """What the floor and the walls are made of; None: it was not kept, by older runs."""


# ---------------------------------------------------------------- what is simulated


@dataclass(frozen=True)
class Treatment:
    """How one part enters the simulation: real numbers, simulated numbers, and why they differ."""

    kind: Literal["rigid", "deformable", "shell", "foliage"]
    young_real: float
    """[Pa]"""
    young: float
    """Simulated Young's modulus [Pa]."""
    poisson: float
    density: float
    """Simulated density [kg/m³]."""
    yield_stress: float | None
    """Simulated yield stress [Pa]."""
    thickness: float | None
    """Simulated wall thickness of a shell [m]."""
    strain: float
    """Estimated largest strain that decided it [-]."""
    impact_speed: float
    """Estimated [m/s]."""
    wave_speed: float
    """Simulated longitudinal wave speed [m/s]; 0 when rigid."""
    step: float
    """Largest stable time step of this part [s]; inf when rigid."""
    why: str
    loss: float = 0.0
    """Simulated loss factor [-]: its material's, less what the grid takes of a blow by itself."""
    vibration: float = 0.0
    """About which angular frequency it loses so much [rad/s]; 0: its object's slowest vibration."""


@dataclass(frozen=True)
class Root:
    """How a plant stands in its soil: a sprung joint between its wood and the rest."""

    object: int
    part: int
    """The wood: index into the catalogue of parts."""
    point: Vector
    """About which it rocks [m]."""
    stiffness: float
    """[N m/rad]"""
    damping: float
    """[N m s/rad]"""


@dataclass(frozen=True)
class Contents:
    """What lies loose in a vessel that it does not fill: an object of its own, and its one part."""

    vessel: int
    """Which object holds it."""
    wall: int
    """Which part's wall is around it."""
    holder: SceneObject
    """The vessel without it."""
    thing: SceneObject
    surface: Surface
    """Where it meets the wall and the air, at the start; its finish is counted after all others."""
    finish: Finish
    material: Material
    words: PartWords
    friction: Float[np.ndarray, " K1"]
    """On each part of the vessels' scene, those before it among the contents, and the floor [-]."""


ROUNDING = 12
"""Numbers that say how a surface curves at a point: its outward unit normal (3); the direction of
an arc, tangential and of unit length (3); the radius of the ball that moves along that arc [m], and
the arc's own radius less the ball's [m], both 0 where it is flat; how far from the point the
surface is so [m]; 1 where its neighbours take over there on all sides, 0 where something round
ends; and the curvatures along the arc's direction and across it [1/m], less than 0 where the
surface is hollow. A ball has no arc, a cylinder no ball. All zeros: nothing is known."""


@dataclass(frozen=True)
class Particles:
    """Material points ready to simulate."""

    position: Float[np.ndarray, "P 3"]
    """World position [m]."""
    velocity: Float[np.ndarray, "P 3"]
    """World velocity [m/s]."""
    volume: Float[np.ndarray, " P"]
    """Rest volume [m³]."""
    density: Float[np.ndarray, " P"]
    """Simulated density [kg/m³]: a thickened shell's is smaller than its material's."""
    object: Int[np.ndarray, " P"]
    """Which object owns the point; each object has its own velocity field."""
    part: Int[np.ndarray, " P"]
    """Index into the catalogue of parts, and so into materials and treatments."""
    cell: float
    """Grid spacing dx that the particles were spaced for [m]."""
    treatments: tuple[Treatment, ...]
    """One per part."""
    surface: Float[np.ndarray, "S 3"]
    """Points on the surfaces of rigid objects, for their contacts [m]."""
    object_of_surface: Int[np.ndarray, " S"]
    mass_real: tuple[float, ...]
    """Estimated mass of every part [kg]: what the particles' masses must add up to."""
    rounding: Float[np.ndarray, "S2 Columns"] = field(
        default_factory=lambda: np.zeros((0, ROUNDING))
    )
    """How each of those points curves, see ``ROUNDING``; none: as corners."""
    face: Float[np.ndarray, "A 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Outward area vectors of the surface that objects in the wind show to the air [m²]."""
    particle_of_face: Int[np.ndarray, " A"] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    """Which particle bears each of those faces."""
    rate: Float[np.ndarray, " R"] = field(default_factory=lambda: np.zeros(0))
    """Natural angular frequency of every particle of foliage on its stalk, 0 for all others
    [rad/s]; empty where there is no foliage."""
    roots: tuple[Root, ...] = ()
    """Of plants that stand in soil."""
    contents: tuple[Contents, ...] = ()
    """What moves in vessels: objects and parts after all that the scene has."""
    wetted: Float[np.ndarray, "W 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Where liquids touch rigid objects, inside of what is hollow too [m]."""
    wetted_normal: Float[np.ndarray, "W 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Unit, out of the matter there."""
    object_of_wetted: Int[np.ndarray, " W"] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    fills: tuple[str, ...] = ()
    """How each part was filled, in words, for the report."""
    walls: tuple[tuple[float, float], ...] = ()
    """Thickness of each part's wall and of its open sheets, as weighed [m]; 0: it has none."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about resolution and treatments, in sentences."""

    @property
    def count(self) -> int:
        """Number of particles P."""
        return len(self.position)

    @property
    def mass(self) -> Float[np.ndarray, " P"]:
        """Particle mass [kg]."""
        return self.volume * self.density


@dataclass(frozen=True)
class Frame:
    """The scene at one instant."""

    time: float
    """[s]"""
    position: Float[np.ndarray, "P 3"]
    """[m]"""
    deformation: Float[np.ndarray, "P 3 3"]
    """Deformation gradient F [-]; a rigid object's is its rotation."""
    stress: Float[np.ndarray, " P"] | None = None
    """Von Mises stress [Pa]; None where a run did not keep it."""


@dataclass(frozen=True)
class Ledger:
    """Sums over bodies and pairs, at one instant or over time.

    B objects, W planes. F is absent for one instant, the number of frames for a trajectory. Work
    and impulses are accumulated since time 0.
    """

    time: Float[np.ndarray, "*F"]
    """[s]"""
    mass: Float[np.ndarray, "*F B"]
    """[kg]"""
    centre: Float[np.ndarray, "*F B 3"]
    """Centre of mass [m]."""
    momentum: Float[np.ndarray, "*F B 3"]
    """[kg m/s]"""
    angular_momentum: Float[np.ndarray, "*F B 3"]
    """About the origin, affine part included [kg m²/s]."""
    kinetic: Float[np.ndarray, "*F B"]
    """½ Σ m (|v|² + dx²/4 ‖C‖²) [J]."""
    elastic: Float[np.ndarray, "*F B"]
    """[J]"""
    potential: Float[np.ndarray, "*F B"]
    """-m g · x [J]."""
    speed: Float[np.ndarray, "*F"]
    """Largest particle speed [m/s]."""
    external_impulse: Float[np.ndarray, "*F B 3"]
    """Of gravity, pushes and wind [N s]."""
    plane_impulse: Float[np.ndarray, "*F W B 3"]
    """Of each plane on each object [N s]."""
    pair_impulse: Float[np.ndarray, "*F B B"]
    """Sum of normal impulse magnitudes between two objects [N s]; symmetric."""
    push_work: Float[np.ndarray, "*F"]
    """Of pushes and wind [J]."""
    friction_loss: Float[np.ndarray, "*F"]
    """[J]"""
    impact_loss: Float[np.ndarray, "*F"]
    """Taken by normal contact: by restitution of what is rigid, and of what is soft by the nodes of
    the grid [J]."""
    plastic_loss: Float[np.ndarray, "*F"]
    """[J]"""
    viscous_loss: Float[np.ndarray, "*F"]
    """[J]"""
    first_contact: Float[np.ndarray, "*F B+W B+W"]
    """Time of the first impulse of each pair [s]; nan: none yet."""
    last_contact: Float[np.ndarray, "*F B+W B+W"]
    """Time of the latest impulse of each pair [s]; nan: none yet."""
    contact_point: Float[np.ndarray, "*F B+W B+W 3"]
    """Where each pair first touched [m]; nan: it did not."""
    lost: Int[np.ndarray, "*F"]
    """Number of particles that are not finite or left the domain."""
    flow: Float[np.ndarray, "*F B"]
    """Σ m |v| [kg m/s]."""
    rms_speed: Float[np.ndarray, "*F B"]
    """Root mean square of particle speeds, weighted by mass [m/s]."""
    plane_depth: Float[np.ndarray, "*F W B"]
    """How deep each object reaches into each plane [m]."""
    gap: Float[np.ndarray, "*F B B"]
    """Distance between two objects [m]."""
    overlap: Float[np.ndarray, "*F B B"]
    """How deep two objects reach into each other [m]."""
    steps: Int[np.ndarray, "*F"]
    """Time steps since time 0."""
    dt_min: Float[np.ndarray, "*F"]
    """Smallest of them [s]."""
    dt_max: Float[np.ndarray, "*F"]
    """Largest of them [s]."""
    nan: Int[np.ndarray, "*F"]
    """Number of particles that are not finite."""


@dataclass(frozen=True)
class Break:
    """A brittle rigid object that broke: N pieces, made as it was struck."""

    object: int
    """Which; its first piece keeps its number, the others come after all objects there are."""
    part: int
    """Its one part; likewise."""
    time: float
    """[s]"""
    energy: float
    """Taken from the motion [J]: what it bears until it breaks."""
    ratio: float
    """Energy of the blow over that [-]."""
    by: str
    """The other body, or the floor."""
    speed: float
    """Along the blow [m/s]."""
    blow: float
    """Energy of the blow [J]."""
    piece: Int[np.ndarray, " P"]
    """Which piece each of its particles belongs to."""
    surfaces: tuple[Surface, ...]
    """One per piece, where it was at the start."""


@dataclass(frozen=True)
class Trajectory:
    """The scene over time. Frames stay on disk and are read one by one."""

    folder: Path
    """Holds ``frames/00000.npz`` … and ``ledger.npz``."""
    time: Float[np.ndarray, " F"]
    """[s]"""
    ledger: Ledger
    """Per frame: energies [J], momentum per object [kg m/s], impulses [N s], penetration [m]."""
    frames: Sequence[Frame]
    """Reads frame i from disk when asked for."""
    breaks: tuple[Break, ...] = ()
    """What broke, in order; its pieces are objects in every frame."""


@dataclass(frozen=True)
class Film:
    """A finished film."""

    path: Path
    fps: int
    width: int
    height: int
    times: tuple[float, ...] = ()
    """What time every picture shows [s]; empty: picture k shows k / fps."""
