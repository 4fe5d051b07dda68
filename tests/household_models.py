"""Household objects of thin walls and thin parts, built of boxes and cylinders and written as GLB."""

import numpy as np
import trimesh

WOOD, STEEL, RUBBER, CLAY = (0.6, 0.4, 0.2), (0.5, 0.5, 0.55), (0.1, 0.1, 0.1), (0.7, 0.4, 0.3)
LINEN, GREEN = (0.9, 0.9, 0.85), (0.2, 0.5, 0.2)


def box(size, middle):
    """A box of some size about a point [m]; z is up."""
    return trimesh.creation.box(extents=size, transform=trimesh.transformations.translation_matrix(middle))


def rod(start, end, radius, sections=8):
    """A cylinder from one point to another [m]."""
    return trimesh.creation.cylinder(radius, segment=(start, end), sections=sections)


def bookshelf():
    """A shelf 1.6 m wide, 0.5 m deep and 2.4 m high, with a back, all of boards 6 mm thick."""
    sides = [box((0.006, 0.5, 2.4), (x, 0, 1.2)) for x in (-0.797, 0.797)]
    boards = [box((1.588, 0.5, 0.006), (0, 0, z)) for z in np.linspace(0.1, 2.397, 12)]
    back = [box((1.588, 0.006, 2.4), (0, 0.247, 1.2))]
    return {"boards": ("wood", WOOD, sides + boards + back)}


def bin_on_castors():
    """An open bin of 2 mm of steel, 1.2 m × 0.8 m × 0.9 m, on four castors 0.15 m high."""
    thick, low, high = 0.002, 0.15, 1.05
    middle, tall = (low + high) / 2, high - low
    walls = [box((thick, 0.8, tall), (x, 0, middle)) for x in (-0.599, 0.599)]
    walls += [box((1.196, thick, tall), (0, y, middle)) for y in (-0.399, 0.399)]
    floor = [box((1.196, 0.796, thick), (0, 0, low + thick / 2))]
    wheels = [rod((x, y - 0.02, 0.06), (x, y + 0.02, 0.06), 0.06, 16) for x in (-0.5, 0.5) for y in (-0.3, 0.3)]
    forks = [box((0.01, 0.04, 0.1), (x, y, 0.1)) for x in (-0.5, 0.5) for y in (-0.3, 0.3)]
    return {
        "bin": ("steel", STEEL, walls + floor),
        "castors": ("rubber", RUBBER, wheels),
        "forks": ("steel", STEEL, forks),
    }


def bed():
    """A bed 0.9 m × 2 m of wooden boards with a mattress on its slats."""
    frame = [box((0.9, 0.02, 0.3), (0, y, 0.25)) for y in (-1, 1)] + [
        box((0.02, 1.98, 0.15), (x, 0, 0.25)) for x in (-0.44, 0.44)
    ]
    legs = [box((0.05, 0.05, 0.3), (x, y, 0.15)) for x in (-0.4, 0.4) for y in (-0.95, 0.95)]
    slats = [box((0.86, 0.07, 0.012), (0, y, 0.3)) for y in np.linspace(-0.9, 0.9, 13)]
    return {
        "frame": ("wood", WOOD, frame + legs + slats),
        "mattress": ("fabric", LINEN, [box((0.84, 1.94, 0.18), (0, 0, 0.396))]),
    }


def cactus():
    """A potted cactus 0.4 m high with 120 spines of 1 mm."""
    pot = trimesh.creation.annulus(
        0.07, 0.078, 0.14, transform=trimesh.transformations.translation_matrix((0, 0, 0.07))
    )
    base = rod((0, 0, 0), (0, 0, 0.008), 0.072, 32)
    stem = trimesh.creation.capsule(0.26, 0.045, count=[16, 16])
    stem.apply_translation((0, 0, 0.105 - stem.bounds[0, 2]))
    rng = np.random.default_rng(4)
    spines = []
    for angle, height in zip(rng.uniform(0, 2 * np.pi, 120), rng.uniform(0.16, 0.4, 120), strict=True):
        out = np.array([np.cos(angle), np.sin(angle), 0.1])
        spines.append(rod(out * 0.044 + (0, 0, height), out * 0.064 + (0, 0, height), 0.0005, 4))
    soil = rod((0, 0, 0.008), (0, 0, 0.12), 0.0695, 32)
    return {
        "pot": ("terracotta", CLAY, [pot, base]),
        "soil": ("potting soil", CLAY, [soil]),
        "cactus": ("cactus", GREEN, [stem]),
        "spines": ("cactus spines", LINEN, spines),
    }


def pine():
    """A young pine 1.5 m high: a stem, and tiers of needles as thin sheets."""
    stem = [rod((0, 0, 0), (0, 0, 1.4), 0.02, 8), rod((0, 0, 0), (0, 0, 0.03), 0.15, 24)]
    twigs, leaves = [], []
    for height in np.linspace(0.35, 1.3, 9):
        reach = 0.45 * (1.5 - height) / 1.15
        for angle in np.linspace(0, 2 * np.pi, 9)[:-1] + height * 3:
            along, across = np.array([np.cos(angle), np.sin(angle), -0.2]), np.array([-np.sin(angle), np.cos(angle), 0])
            root = np.array([0, 0, height])
            twigs.append(rod(root, root + along * reach, 0.004, 5))
            for far in np.linspace(0.3, 1.0, 5):
                tip = root + along * reach * far
                for side in (-1, 1):
                    corners = np.array([tip, tip + side * 0.08 * across, tip + side * 0.06 * across + along * 0.04])
                    leaves.append(trimesh.Trimesh(corners, [[0, 1, 2]], process=False))
    return {"stem": ("wood", WOOD, stem + twigs), "foliage": ("leaves", GREEN, leaves)}


HOUSEHOLD = {f.__name__: f for f in (bookshelf, bin_on_castors, bed, cactus, pine)}


def write_glb(parts, path):
    """Write an object of named parts, each (material, colour, meshes), as a GLB file with +Y up."""
    scene = trimesh.Scene()
    turned = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))
    for part, (material, colour, meshes) in parts.items():
        mesh = trimesh.util.concatenate(meshes)
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(name=material, baseColorFactor=(*colour, 1.0))
        )
        scene.add_geometry(mesh, node_name=part, geom_name=part, transform=turned)
    path.write_bytes(scene.export(file_type="glb"))
