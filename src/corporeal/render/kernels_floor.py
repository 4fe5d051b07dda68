"""Shading of the floor: tiles in hard and soft shadow.

Tiles of 8 × 8 pixels are separated. Near objects and in their shadow pixels ask for light themselves; farther away
objects only hide a little of the sky, which is asked at the corners of tiles and changes evenly between. Loops compiled
by numba, over a band of pixels.
"""

import numba
import numpy as np

from corporeal.render.kernels_hits import FLOOR_ROUGHNESS, INNER, JIT, LOOP
from corporeal.render.kernels_light import floor_fade, shade_with_view_terms, view_terms
from corporeal.render.kernels_video import HORIZON_SINE, bounding_box_of, filmic, meets_box, pixel_direction

TILE_PX = 8
"""Sides of a tile [px]."""
TILE_UNTOUCHED, TILE_SOFT, TILE_CAST = 0, 1, 2
"""As in the empty studio; darkened softly; to be cast pixel by pixel."""
NEAR_OBJECT_TILES = 2
"""Tiles about one that shows an object that are near it."""


@numba.njit(**LOOP)
def mark_object_tiles(prim, shape, out):
    """Mark the tiles in which objects are seen."""
    h, w = shape
    for i in range(h):
        for j in range(w):
            if prim[i * w + j] >= 0:
                out[i // TILE_PX, j // TILE_PX] = True


@numba.njit(**JIT)
def dilate_tiles(mask, reach):
    """Mark all tiles within ``reach`` of those that are marked."""
    h, w = mask.shape
    out = np.zeros((h, w), np.bool_)
    for i in range(h):
        for j in range(w):
            if mask[i, j]:
                out[max(i - reach, 0) : i + reach + 1, max(j - reach, 0) : j + reach + 1] = True
    return out


@numba.njit(**JIT)
def mark_shadowed_tiles(d, eye, lamps, ways, boxes, blur, shape, near, far):
    """Mark the tiles of floor that the sun's and the sky's light may not reach.

    Args:
        d: Directions of the pixels (P, 3).
        eye: Where they come from [m].
        lamps: The studio.
        ways: All that pixels on the floor look along: to the sky and, last, to the sun (S, 3).
        boxes: About what objects (B, 2, 3) [m].
        blur: How far the sun's softness spreads a shadow on the floor [m].
        shape: Rows and columns of pixels.
        near: Marks of tiles (rows, columns): the sun, or some of a tile is above the horizon.
        far: The sky.
    """
    room = np.empty(3, np.float32), boxes.copy(), boxes.copy()
    hulls = boxes[:1].copy(), bounding_box_of(boxes)
    _mark_shadowed_tiles(d, eye, lamps, ways, boxes, blur, shape, near, far, room, hulls)


@numba.njit(**LOOP)
def _mark_shadowed_tiles(d, eye, lamps, ways, boxes, blur, shape, near, far, room, hulls):
    h, w = shape
    p, wide, dark = room
    around, hull = hulls
    p[2] = lamps.floor[3]
    for top in range(0, h, TILE_PX):
        for left in range(0, w, TILE_PX):
            bottom, right = min(top + TILE_PX, h) - 1, min(left + TILE_PX, w) - 1
            radius, seen = _patch(d, eye, lamps.floor[3], w, (top, bottom, left, right), p)
            away = np.hypot(p[0] - lamps.centre[0], p[1] - lamps.centre[1]) - 2 * radius
            if not seen or floor_fade(away, lamps) == 0:
                continue
            for b in range(len(boxes)):
                for a in range(2):
                    wide[b, 0, a], wide[b, 1, a] = boxes[b, 0, a] - radius, boxes[b, 1, a] + radius
                    dark[b, 0, a] = wide[b, 0, a] - blur
                    dark[b, 1, a] = wide[b, 1, a] + blur
            for b in range(len(hull)):
                for a in range(3):
                    reach = radius if a < 2 else np.float32(0)
                    around[b, 0, a], around[b, 1, a] = hull[b, 0, a] - reach, hull[b, 1, a] + reach
            i, j = top // TILE_PX, left // TILE_PX
            near[i, j] = near[i, j] or meets_box(p, ways[len(ways) - 1], dark)
            for k in range(len(ways) - 1):
                if near[i, j] or (meets_box(p, ways[k], around) and meets_box(p, ways[k], wide)):
                    far[i, j] = True
                    break
            # Corners above the horizon have no floor to ask.
            if far[i, j] and d[top * w + left, 2] > -HORIZON_SINE:
                near[i, j] = True


@numba.njit(**JIT)
def _patch(d, eye, floor, w, tile, centre):
    """Middle and radius [m] of the floor that a tile of pixels sees, and whether it sees any."""
    top, bottom, left, right = tile
    if d[bottom * w + left, 2] > -HORIZON_SINE and d[bottom * w + right, 2] > -HORIZON_SINE:
        return np.float32(0), False
    widest = np.float32(0)
    for a in range(2):
        low, high = np.float32(np.inf), np.float32(-np.inf)
        for i in (top, bottom):
            for j in (left, right):
                e = d[i * w + j]
                t = (floor - eye[2]) / min(e[2], -HORIZON_SINE)
                low = min(low, np.float32(eye[a] + t * e[a]))
                high = max(high, np.float32(eye[a] + t * e[a]))
        centre[a] = (low + high) / 2
        widest = max(widest, high - low)
    return widest / 2, True


@numba.njit(**INNER)
def _corner(tiles, i, j):
    """Whether a corner is one of a far tile."""
    wanted = False
    for a in range(max(i - 1, 0), min(i + 1, len(tiles))):
        for b in range(max(j - 1, 0), min(j + 1, tiles.shape[1])):
            wanted = wanted or tiles[a, b] == TILE_SOFT
    return wanted


@numba.njit(**LOOP)
def count_soft_corners(tiles):
    """Count the corners of far tiles."""
    count = 0
    for i in range(tiles.shape[0] + 1):
        for j in range(tiles.shape[1] + 1):
            count += _corner(tiles, i, j)
    return count


@numba.njit(**JIT)
def queue_corner_rays(tiles, eye, frame, tangent, size, first, lamps, ways, boxes, o, w, asker):
    """Write down rays from the corners of far tiles that could meet something.

    Args:
        tiles: Kinds (rows, columns).
        eye: Where the camera is [m].
        frame: Its axes.
        tangent: Of half its field of view.
        size: Of the picture: width, height.
        first: The picture's row that tiles begin with.
        lamps: The studio.
        ways: All that corners look along, to the sky and, last, to the sun (S, 3).
        boxes: About what objects (B, 2, 3) [m].
        o: Origins of rays, as many as there is room for.
        w: Their directions.
        asker: Of each, the number of its corner × (S - 1) + that of its direction.

    Returns:
        How many rays are to be cast.
    """
    room = np.empty(3), np.empty(3, np.float32), bounding_box_of(boxes)
    return _queue_corner_rays(tiles, eye, frame, tangent, size, first, lamps, ways, boxes, room, o, w, asker)


@numba.njit(**LOOP)
def _queue_corner_rays(tiles, eye, frame, tangent, size, first, lamps, ways, boxes, room, o, w, asker):
    h, width = tiles.shape
    n, many = 0, len(ways) - 1
    e, p, hull = room
    for i in range(h + 1):
        for j in range(width + 1):
            if not _corner(tiles, i, j):
                continue
            pixel_direction(eye, frame, tangent, size, first + i * TILE_PX, j * TILE_PX, e)
            t = (lamps.floor[3] - eye[2]) / min(e[2], -HORIZON_SINE)
            p[0], p[1] = eye[0] + t * e[0], eye[1] + t * e[1]
            p[2] = lamps.floor[3] + 2e-4 * lamps.size
            for k in range(many):
                if meets_box(p, ways[k], hull) and meets_box(p, ways[k], boxes):
                    for a in range(3):
                        o[n, a], w[n, a] = p[a], ways[k, a]
                    asker[n] = (i * (width + 1) + j) * many + k
                    n += 1
    return n


@numba.njit(**LOOP)
def subtract_hidden_sky(asker, free, ways, columns, light):
    """Take the sky of rays that were cast from corners and met something.

    Args:
        asker: From ``queue_corner_rays``.
        free: Which rays got away.
        ways: All that corners look along, as there.
        columns: Of corners.
        light: At the corners (rows, columns, 2): sky, its height.
    """
    many = len(ways) - 1
    for n in range(len(free)):
        if not free[n]:
            corner, k = asker[n] // many, asker[n] % many
            i, j = corner // columns, corner % columns
            light[i, j, 0] -= np.float32(1 / many)
            light[i, j, 1] -= ways[k, 2] / many


@numba.njit(**JIT)
def floor_view_terms(d, index, eye, lamps, out):
    """Write how pixels see the floor: what no object changes, worked out once for each camera.

    Args:
        d: Directions of the pixels (P, 3).
        index: Those that see floor (N,).
        eye: Where they come from [m].
        lamps: The studio.
        out: Highlight, grazing share, and how much of the floor is seen before the backdrop (P, 3).
    """
    up, scratch = np.zeros(3, np.float32), np.empty(3, np.float32)
    up[2] = 1
    _floor_view_terms(d, index, eye, lamps, up, scratch, out)


@numba.njit(**LOOP)
def _floor_view_terms(d, index, eye, lamps, up, scratch, out):
    for g in index:
        e = d[g]
        t = (lamps.floor[3] - eye[2]) / min(e[2], -HORIZON_SINE)
        x, y = eye[0] + t * e[0] - lamps.centre[0], eye[1] + t * e[1] - lamps.centre[1]
        out[g, 0], out[g, 1] = view_terms(up, e, FLOOR_ROUGHNESS, lamps.sun, scratch)
        out[g, 2] = floor_fade(np.hypot(x, y), lamps)


@numba.njit(**JIT)
def shade_soft_tiles(tiles, shape, lamps, sky, glances, mirrored, wall, out):
    """Write the filmic light of the pixels of far tiles.

    Args:
        tiles: Kinds (rows, columns).
        shape: Rows and columns of pixels.
        lamps: The studio.
        sky: At the corners of tiles, from ``queue_corner_rays``.
        glances: How the band's pixels see the floor (P, 3).
        mirrored: What each pixel of the band mirrors in the empty studio (P, 3).
        wall: Light of the backdrop (P, 3).
        out: Of the band (P, 3).
    """
    traits = np.zeros(6, np.float32)
    traits[1], traits[4] = FLOOR_ROUGHNESS, 1
    light = np.zeros(7, np.float32)
    light[3] = 1
    room = np.empty(3, np.float32), np.empty(3, np.float32)
    _shade_soft_tiles(tiles, shape, lamps, sky, glances, mirrored, wall, (traits, light), room, out)


@numba.njit(**LOOP)
def _shade_soft_tiles(tiles, shape, lamps, sky, glances, mirrored, wall, floor, room, out):
    h, w = shape
    traits, light = floor
    near, above = room
    for i in range(h):
        a, fy = i // TILE_PX, np.float32(i % TILE_PX / TILE_PX)
        for j in range(w):
            b = j // TILE_PX
            if tiles[a, b] != TILE_SOFT:
                continue
            g, fx = i * w + j, np.float32(j % TILE_PX / TILE_PX)
            for c in range(2):
                upper = (1 - fx) * sky[a, b, c] + fx * sky[a, b + 1, c]
                lower = (1 - fx) * sky[a + 1, b, c] + fx * sky[a + 1, b + 1, c]
                light[c] = (1 - fy) * upper + fy * lower
            for c in range(3):
                light[4 + c] = mirrored[g, c]
            spot, graze, fade = glances[g, 0], glances[g, 1], glances[g, 2]
            shade_with_view_terms(lamps.sun[2], spot, graze, lamps.floor, traits, light, lamps, above, near)
            for c in range(3):
                out[g, c] = filmic(near[c] * fade + wall[g, c] * (1 - fade))


MIN_DEPTH_RATIO = 1e-3
"""Of its distance: how far a corner must be before the eye to be placed in the picture."""


@numba.njit(**JIT)
def mark_outlined_tiles(vertices, triangles, eye, frame, tangent, size, out):
    """Mark the tiles that a triangle's outline in the picture reaches, or is a pixel away from.

    Args:
        vertices: Of all triangles (V, 3) [m].
        triangles: Their numbers (T, 3).
        eye: Where from [m].
        frame: Right, up and back of the camera, as rows.
        tangent: Of half the vertical field of view.
        size: Width and height of the picture [px].
        out: Marks (rows, columns) of tiles; all of them where a triangle begins behind the eye.
    """
    row, column = np.empty(len(vertices)), np.empty(len(vertices))
    ahead = np.empty(len(vertices), np.bool_)
    _project_vertices(vertices, eye, frame, tangent, size, row, column, ahead)
    _mark_triangle_tiles(triangles, row, column, ahead, size, out)


@numba.njit(**LOOP)
def _project_vertices(vertices, eye, frame, tangent, size, row, column, ahead):
    """Find where each vertex is seen [px], and whether it is before the eye."""
    width, height = size
    for k in range(len(vertices)):
        right = up = depth = square = 0.0
        for a in range(3):
            way = vertices[k, a] - eye[a]
            right += frame[0, a] * way
            up += frame[1, a] * way
            depth -= frame[2, a] * way
            square += way * way
        ahead[k] = depth > MIN_DEPTH_RATIO * np.sqrt(square)
        if ahead[k]:
            row[k] = (1 - up / depth / tangent) * height / 2
            column[k] = (1 + right / depth / tangent * height / width) * width / 2


@numba.njit(**LOOP)
def _mark_triangle_tiles(triangles, row, column, ahead, size, out):
    width, height = size
    for k in range(len(triangles)):
        a, b, c = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        if not (ahead[a] and ahead[b] and ahead[c]):
            for i in range(len(out)):
                for j in range(out.shape[1]):
                    out[i, j] = True
            return
        top = min(min(row[a], row[b]), row[c]) - 1
        bottom = max(max(row[a], row[b]), row[c]) + 1
        left = min(min(column[a], column[b]), column[c]) - 1
        right = max(max(column[a], column[b]), column[c]) + 1
        if bottom < 0 or right < 0 or top >= height or left >= width:
            continue
        for i in range(int(max(top, 0)) // TILE_PX, int(min(bottom, height - 1)) // TILE_PX + 1):
            for j in range(int(max(left, 0)) // TILE_PX, int(min(right, width - 1)) // TILE_PX + 1):
                out[i, j] = True
