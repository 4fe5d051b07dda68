"""Inputs: scenes, pictures and Gaussians."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float, Int, UInt8

Vector = tuple[float, float, float]
GRAVITY_M_S2 = 9.81
"""Default gravity [m/s²]."""
GRAVITY_VECTOR: Vector = (0.0, 0.0, -GRAVITY_M_S2)
"""The same as a vector [m/s²]."""
SUBSTANCE_KEY, STATED_MATTER_KEY = "substance", "stated_matter"
"""Keys of a surface's extras: the name of what a file says that it is made of, and all that the file says of it
(``values``, ``words``)."""


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
    emission: float = 0.0
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

    N rows, the first of them where the object starts. Between rows all is smooth (monotone cubic interpolation); before
    the first and after the last the object rests.
    """

    time: tuple[float, ...]
    """Rising [s]."""
    shift: tuple[Vector, ...]
    """From the start, of what was then the middle of the underside of its bounding box [m]; the first is zero."""
    turn: tuple[Vector, ...]
    """Rotation vector from the row before, about that point [rad]; the first is zero."""


@dataclass(frozen=True)
class Wind:
    """Wind on one whole object within a time window; at rest it only slows down."""

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


ObjectGrouping = Literal["auto", "one", "nodes"]
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
    gravity: Vector = GRAVITY_VECTOR
    """[m/s²]"""
    walls: tuple[Wall, ...] = ()
    """Beside the floor, which is always there."""
    duration: float = 2.0
    """[s]"""
    fps: int = 60
    settled: bool = False
    """Whether everything that lies or stands has come to rest before it begins: then what is soft finds its balance
    before time 0, and pushes, winds and velocities begin there."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the input, in sentences."""
    hints: tuple[str, ...] = ()
    """What was decided though it could be meant otherwise, and the option that says so."""

    @property
    def object_of_triangle(self) -> Int[np.ndarray, " T"]:
        """For each triangle of all surfaces in order, its object."""
        return np.repeat(
            np.array([s.object for s in self.surfaces], dtype=np.int64), [len(s.triangles) for s in self.surfaces]
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
    """Of what the middle of each pixel shows, along the camera's z [m]; inf where there is nothing. The floor is
    something."""
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
class FeatureCloud:
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
    cloud: FeatureCloud
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
    doubts: tuple[str, ...] = ()
    """Those of the warnings that say where shapes are unreliable."""
