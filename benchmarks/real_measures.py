"""What is measured of a set of real photographs: poses, up, size and silhouettes."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from PIL import Image

from corporeal.core.deserialize import from_plain
from corporeal.core.types import Camera
from corporeal.geometry.mesh import Mesh
from corporeal.io.photos.colmap import ColmapModel, read_colmap
from corporeal.io.photos.posed_photos import MASK_FOLDERS, find_companion_image
from corporeal.multiview.silhouette_overlap import compare_silhouettes
from corporeal.multiview.similarity_transform import decompose_similarity, similarity_matrix
from corporeal.pipeline.stages.reconstruct import ReconstructedScene

KNOWN, FACTS = Path(__file__).parent / "real_sets.toml", "known.toml"
GOOD_ANGLE, GOOD_PLACE = 1.5, 0.03
"""A pose is right within so many degrees, and this share of the cameras' mean distance."""
ROUNDS = 5
"""Of fitting to what agrees."""
FAR = 3.0
"""Medians from which on a camera is not fitted to."""
SIMILARITIES = 500
"""Tried through three places, of which the one that most agree with is where fitting begins."""
TRIALS, NEAR = 2000, 0.01
"""Planes tried through three sparse points; distance that is on one, over the cameras' radius."""
AGREED = re.compile(r"agree with (\d+) photographs .* to ([\d.]+) dB(?:, ([\d.]+) dB on objects)?")
MASK_SIDE = 512
"""Longer side at which masks are read [px]."""


@dataclass(frozen=True)
class Known:
    """What is known of a set."""

    unit: float | None = None
    floor: bool = False
    sides: tuple[float, ...] = ()
    all_sides: tuple[float, ...] = ()
    """The same, by a second yardstick that leaves nothing of the object out."""
    height: float | None = None
    volume: tuple[float, ...] = ()
    up: tuple[float, ...] = ()
    """Direction in the frame of the given poses, where it is known."""
    note: str = ""
    """What a reader of the figures should know, in sentences."""


def known(folder: Path) -> Known:
    """Return what a set's ``known.toml``, or ``real_sets.toml``, says of it; else nothing is."""
    own = folder / FACTS
    said = tomllib.loads((own if own.exists() else KNOWN).read_text(encoding="utf-8"))
    return from_plain(Known, said if own.exists() else said.get(folder.name, {}))


def up_off(result: "Came", folder: Path, given: ColmapModel) -> dict[str, Any]:
    """Return the angle between up and what is known of it [deg], if anything is."""
    facts = known(folder)
    if not facts.up and not facts.floor:
        return {}
    true = np.array(facts.up) if facts.up else floor_normal(given, np.random.default_rng(0))
    return {"up_off_deg": float(np.degrees(np.arccos(np.clip(true @ result.up, -1, 1))))}


# ---------------------------------------------------------------- poses


@dataclass(frozen=True)
class PoseErrors:
    """Found poses against given ones."""

    registered: int
    right: int
    """Of those that were given too."""
    given: int
    angle: float
    """Median [deg]."""
    place: float
    """Median, over the cameras' mean distance from their middle [-]."""
    given_from_found: Float[np.ndarray, "4 4"]


def pose_errors(found: ColmapModel, given: ColmapModel) -> PoseErrors:
    """Compare poses after the similarity that takes most places onto each other (Umeyama 1991)."""
    ours, theirs = ({Path(i.name).stem: i for i in m.images} for m in (found, given))
    names = sorted(ours.keys() & theirs.keys())
    a, b = (np.stack([p[n].world_from_camera for n in names]) for p in (ours, theirs))
    reach = np.linalg.norm(b[:, :3, 3] - b[:, :3, 3].mean(axis=0), axis=1).mean()
    kept = _agreeing(a[:, :3, 3], b[:, :3, 3], GOOD_PLACE * reach)
    way, off = np.eye(4), np.zeros(len(names))
    for _ in range(ROUNDS):
        way = _onto(a[kept, :3, 3], b[kept, :3, 3])
        off = np.linalg.norm((a @ [0, 0, 0, 1]) @ way.T - b @ [0, 0, 0, 1], axis=1) / reach
        kept = off <= max(FAR * float(np.median(off)), 1e-6)
    between = decompose_similarity(way).rotation @ a[:, :3, :3] @ np.swapaxes(b[:, :3, :3], 1, 2)
    cosine = (np.trace(between, axis1=1, axis2=2) - 1) / 2
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    right = int(((angle < GOOD_ANGLE) & (off < GOOD_PLACE)).sum())
    middle = float(np.median(angle)), float(np.median(off))
    return PoseErrors(len(ours), right, len(theirs), *middle, way)


def _agreeing(a: Float[np.ndarray, "N 3"], b: Float[np.ndarray, "N 3"], near: float) -> Bool[np.ndarray, " N"]:
    """Return which places agree with most others, of similarities through three places each."""
    rng, best = np.random.default_rng(0), np.ones(len(a), bool)
    most = 0
    for _ in range(SIMILARITIES if len(a) > 3 else 0):
        few = rng.choice(len(a), 3, replace=False)
        way = _onto(a[few], b[few])
        on = np.linalg.norm(a @ way[:3, :3].T + way[:3, 3] - b, axis=1) < near
        if on.sum() > max(most, 3):
            best, most = on, int(on.sum())
    return best


def _onto(a: Float[np.ndarray, "N 3"], b: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "4 4"]:
    x, y = a - a.mean(axis=0), b - b.mean(axis=0)
    u, s, vt = np.linalg.svd(y.T @ x)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn, scale = u @ np.diag(sign) @ vt, (s * sign).sum() / np.square(x).sum()
    return similarity_matrix(turn, scale, b.mean(axis=0) - scale * turn @ a.mean(axis=0))


# ---------------------------------------------------------------- what came out


def floor_normal(given: ColmapModel, rng: np.random.Generator) -> Float[np.ndarray, "3"]:
    """Return the normal of the plane with the most sparse points, towards the cameras."""
    eyes = np.stack([i.world_from_camera[:3, 3] for i in given.images])
    near = NEAR * np.linalg.norm(eyes - eyes.mean(axis=0), axis=1).mean()
    best, most = np.ones(len(given.points), bool), 0
    for _ in range(TRIALS):
        p, q, r = given.points[rng.choice(len(given.points), 3, replace=False)]
        normal = np.cross(q - p, r - p)
        on = np.abs((given.points - p) @ normal) < near * np.linalg.norm(normal)
        if on.sum() > most:
            best, most = on, int(on.sum())
    middle = given.points[best].mean(axis=0)
    normal = np.linalg.svd(given.points[best] - middle, full_matrices=False)[2][2]
    return normal * np.sign((eyes - middle).mean(axis=0) @ normal)


@dataclass(frozen=True)
class Came:
    """A reconstruction in the unit and frame of the given poses."""

    meshes: tuple[Mesh, ...]
    """The largest first."""
    up: Float[np.ndarray, "3"]
    upright: tuple[Mesh, ...]
    """The same with +z up."""


def came(made: ReconstructedScene, given_from_file: Float[np.ndarray, "4 4"]) -> Came:
    """Take surfaces back to the frame in which poses were given."""
    back = given_from_file @ np.linalg.inv(made.found.world_from_file)
    surfaces = made.scene.surfaces
    scale = decompose_similarity(back).scale
    return Came(
        tuple(Mesh(s.vertices @ back[:3, :3].T + back[:3, 3], s.triangles) for s in surfaces),
        decompose_similarity(back).rotation[:, 2],
        tuple(Mesh(scale * s.vertices, s.triangles) for s in surfaces),
    )


def sizes(result: Came, facts: Known) -> dict[str, Any]:
    """Return sides of all things together, height and volume of the largest one, and how far off.

    Lengths in m, volumes in m³, what they are off as a share.
    """
    if facts.unit is None:
        return {}
    mesh, unit = result.upright[0], facts.unit
    places = np.concatenate([m.vertices for m in result.meshes])
    sides = (unit * np.ptp(places, axis=0)).tolist()
    height = unit * float(np.ptp(mesh.vertices[:, 2]))
    volume = unit**3 * float(trimesh.Trimesh(mesh.vertices, mesh.triangles).volume)
    row: dict[str, Any] = {"sides_m": sides, "height_m": height, "volume_m3": volume}
    for key, stated in (("size_off", facts.sides), ("size_off_all", facts.all_sides)):
        if stated:
            row[key] = max((s / k - 1 for s, k in zip(sides, stated, strict=True)), key=abs)
    if facts.height is not None:
        row["size_off"] = height / facts.height - 1
    return row


def whole(result: Came) -> dict[str, Any]:
    """Say whether each surface is watertight and one piece."""
    made = [trimesh.Trimesh(m.vertices, m.triangles, process=False) for m in result.meshes]
    return {
        "objects": len(made),
        "watertight": all(m.is_watertight for m in made),
        "pieces": [int(m.body_count) for m in made],
    }


def silhouettes(result: Came, folder: Path, given: ColmapModel) -> dict[str, Any]:
    """Compare silhouettes of all surfaces, in all given views, with masks of the set."""
    cameras, masks = [], []
    for image in given.images:
        file = find_companion_image(folder / "images" / image.name, folder, MASK_FOLDERS)
        if file is None:
            continue
        with Image.open(file) as mask:
            mask.thumbnail((MASK_SIDE, MASK_SIDE))
            masks.append(np.asarray(mask.convert("L")))
        lens = given.lens(image)
        cameras.append(Camera(lens.K, image.world_from_camera, lens.width, lens.height))
    if not masks:
        return {}
    overlap = compare_silhouettes(result.meshes, cameras, masks, np.random.default_rng(0)).overlap
    return {"iou": float(np.nanmean(overlap)), "iou_worst": float(np.nanmin(overlap))}


def held_out(made: ReconstructedScene) -> dict[str, Any]:
    """Return how well photographs that were not learned from are met [dB]."""
    found = [m for s in made.found.statements if (m := AGREED.search(s))]
    if not found:
        return {}
    count, all_of_it, thing = found[0].groups()
    return {"held_out": int(count), "psnr": float(all_of_it), "psnr_thing": float(thing) if thing else None}


def model_of(folder: Path) -> ColmapModel:
    """Read the poses that a set came with, or that were found."""
    return read_colmap(folder / "sparse" / "0")
