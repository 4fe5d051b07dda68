"""Open ware from pictures weighs what its sheet does, however much of its hollow is filled in."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Law, Material, PartDescription, Structure
from corporeal.discretization.mesh_measures import measure_object
from corporeal.discretization.part_model import PieceSpecification, infer_structure

STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, yield_stress=2.5e8)
WALL = 1e-3
WARE = PartDescription("ware", "steel", "sheet", wall_unseen=True)


def arc(radius, begin, end, height):
    turn = np.radians(np.linspace(begin, end, 16))
    return [(radius * np.cos(t), height + radius * np.sin(t)) for t in turn]


OUTSIDES = {
    "bowl": [(0, 0), (0.03, 0), (0.055, 0.01), (0.072, 0.03), (0.08, 0.055)],
    "plate": [(0, 0), (0.06, 0), (0.075, 0.004), (0.095, 0.018)],
    "cup": [(0, 0), (0.038, 0), (0.04, 0.004), (0.04, 0.095)],
    "glass": [(0, 0), (0.03, 0), (0.036, 0.14)],
    "pan": [(0, 0), (0.085, 0), (0.1, 0.045)],
    "pot": [(0, 0), (0.07, 0), *arc(0.1, -45, 41, 0.085)],
}
"""Radius and height of the outside [m], from the middle of the bottom to the rim."""
HOLLOWS = ("open", "thick", "half", "closed", "heaped")


def drawn(outside, hollow):
    """Draw ware as pictures may show it: with its hollow open or filled in."""
    (r, z), below = outside[-1], np.array(outside)
    step = {"open": 3e-3, "thick": 0.3 * min(r, z)}.get(hollow, z / 2)
    inside = [(max(x - step, 0.0), y + step) for x, y in below if y + step < z and x > step]
    match hollow:
        case "closed":
            rest = [(0, z)]
        case "heaped":
            rest = [(r * (1 - s), z + 0.3 * r * (1 - (1 - s) ** 2)) for s in np.linspace(0.1, 1, 9)]
        case "half":
            filled = 0.93 * np.interp(z / 2, below[:, 1], below[:, 0])
            rest = [(0.95 * r, z), (filled, z / 2), (0, z / 2)]
        case _:
            rest = [(r - step, z), *inside[::-1], (0, inside[0][1])]
    return trimesh.creation.revolve(np.array([*outside, *rest]), sections=64)


def area_of(outside):
    """Area that the outside sweeps [m²], by Pappus."""
    p = np.array(outside)
    return float(2 * np.pi * (p[1:, 0] + p[:-1, 0]) / 2 @ np.linalg.norm(np.diff(p, axis=0), axis=1))


def area_found(mesh, words=WARE):
    anatomy = measure_object(
        np.asarray(mesh.vertices), np.asarray(mesh.faces), np.zeros(len(mesh.faces), np.int64),
        np.random.default_rng(1),
    )  # fmt: skip
    made = infer_structure(anatomy.members[0], PieceSpecification(Structure("shell", WALL), STEEL, words))
    return made.mass / (STEEL.density * WALL)


def rough(mesh, by):
    """Move a finely divided surface in and out along its normals [m]."""
    width = float(np.ptp(mesh.vertices[:, 0]))
    v, f = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, 0.04 * width)[:2]
    fine = trimesh.Trimesh(v, f)
    rng = np.random.default_rng(0)
    waves, phase = rng.normal(size=(200, 3)) / (0.03 * width), rng.uniform(0, 2 * np.pi, 200)
    moved = by * np.sqrt(2 / 200) * np.cos(fine.vertices @ waves.T + phase).sum(axis=1)
    return trimesh.Trimesh(fine.vertices + moved[:, None] * fine.vertex_normals, f, process=False)


@pytest.mark.slow
@pytest.mark.parametrize("ware", OUTSIDES)
def test_ware_from_pictures_weighs_what_its_sheet_does_whatever_fills_its_hollow(ware):
    found = {how: area_found(drawn(OUTSIDES[ware], how)) for how in HOLLOWS}
    off = {how: abs(a / area_of(OUTSIDES[ware]) - 1) for how, a in found.items()}
    # A roof hides where a pot that closes in has its mouth.
    assert off.pop("heaped") < 0.15
    assert max(off.values()) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("ware", ["bowl", "cup", "plate"])
def test_roughness_adds_no_matter(ware):
    outside = OUTSIDES[ware]
    plain = drawn(outside, "closed")
    ruffled = rough(plain, 0.02 * outside[-1][0])
    assert ruffled.area > 1.05 * plain.area
    assert area_found(ruffled) == pytest.approx(area_of(outside), rel=0.1)


@pytest.mark.parametrize("ware", ["bowl", "cup", "pan"])
def test_ware_that_leans_weighs_the_same(ware):
    lean = trimesh.transformations.rotation_matrix(np.radians(20), [1, 0, 0])
    for how in ("open", "closed"):
        mesh = drawn(OUTSIDES[ware], how)
        mesh.apply_transform(lean)
        assert area_found(mesh) == pytest.approx(area_of(OUTSIDES[ware]), rel=0.1)


def test_a_cover_that_stands_on_the_floor_is_its_dome_without_its_foot():
    dome = trimesh.creation.revolve(np.array([(0, 0), *arc(0.1, 0, 90, 0.0)]), sections=64)
    assert area_found(dome) == pytest.approx(2 * np.pi * 0.1**2, rel=0.05)


def test_a_handle_above_the_rim_is_no_mouth():
    """Else the lid of what is filled in would count, as all that lies beside the handle's end."""
    pan = drawn(OUTSIDES["pan"], "closed")
    handle = trimesh.creation.box((0.02, 0.02, 0.06))
    handle.apply_translation((0.08, 0, 0.06))
    both = trimesh.util.concatenate([pan, handle])
    alone = area_found(pan)
    assert area_found(both) == pytest.approx(alone + 4 * 0.02 * 0.045, rel=0.05)


def test_nothing_else_is_read_as_ware():
    """Whatever a mesh that somebody made draws, a closed wall, and a cover about something else."""
    mesh = drawn(OUTSIDES["pan"], "closed")
    sheet = area_of(OUTSIDES["pan"])
    for words in (replace(WARE, wall_unseen=False), replace(WARE, structure="hollow"), replace(WARE, inner_share=0.5)):
        assert area_found(mesh, words) > 1.2 * sheet
