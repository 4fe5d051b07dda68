"""Plumb lines through triangles. Loops compiled by numba.

Whether a triangle's shadow on the floor covers a place is decided edge by edge, each looked at from its vertex of lower
number: triangles that share it get the same answer, however numbers round. What is added up over a closed mesh is then
exactly 0.
"""

import numba
import numpy as np


@numba.njit(cache=True)
def triangle_covers(vertices, triangle, x, y):
    """Return 1 where the shadow goes round (x, y) to the left, -1 to the right, else 0."""
    around = 0
    for e in range(3):
        p, q, sign = triangle[e], triangle[(e + 1) % 3], 1
        if p > q:
            p, q, sign = q, p, -1
        below = vertices[p, 1] <= y
        if below == (vertices[q, 1] <= y):
            continue
        side = (vertices[p, 0] - x) * (vertices[q, 1] - y) - ((vertices[q, 0] - x) * (vertices[p, 1] - y))
        # Crossed upwards to the right of the place, or downwards.
        if below and side > 0:
            around += sign
        elif not below and side <= 0:
            around -= sign
    return around


@numba.njit(cache=True)
def triangle_height(vertices, triangle, x, y):
    """Height of a triangle above a place, within its own; of one that is upright, its middle's."""
    a, b, c = triangle
    ux, uy = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
    vx, vy = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1]
    za, zb, zc = vertices[a, 2], vertices[b, 2], vertices[c, 2]
    low, high = min(za, zb, zc), max(za, zb, zc)
    area = ux * vy - uy * vx
    if area == 0.0:
        return 0.5 * (low + high)
    dx, dy = x - vertices[a, 0], y - vertices[a, 1]
    s, t = (dx * vy - dy * vx) / area, (ux * dy - uy * dx) / area
    return min(max(za + s * (zb - za) + t * (zc - za), low), high)


@numba.njit(cache=True)
def collect_crossings(vertices, triangles, columns, at, met):
    """Count crossings (``met`` is empty), or write heights and steps at places kept for them."""
    nx, ny = columns.shape[:2]
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x = vertices[a, 0], vertices[b, 0], vertices[c, 0]
        y = vertices[a, 1], vertices[b, 1], vertices[c, 1]
        for i in range(max(int(np.floor(min(x))), 0), min(int(np.floor(max(x))) + 1, nx)):
            for j in range(max(int(np.floor(min(y))), 0), min(int(np.floor(max(y))) + 1, ny)):
                px, py = columns[i, j]
                around = triangle_covers(vertices, triangles[t], px, py)
                if around == 0:
                    continue
                if len(met):
                    met[at[i, j], 0] = triangle_height(vertices, triangles[t], px, py)
                    met[at[i, j], 1] = -around
                at[i, j] += 1


@numba.njit(cache=True)
def sort_crossings(first, met):
    """Order the crossings of every column: they are few."""
    for column in range(len(first) - 1):
        for k in range(first[column] + 1, first[column + 1]):
            h, s, m = met[k, 0], met[k, 1], k
            while m > first[column] and met[m - 1, 0] > h:
                met[m, 0], met[m, 1] = met[m - 1, 0], met[m - 1, 1]
                m -= 1
            met[m, 0], met[m, 1] = h, s


@numba.njit(cache=True)
def collect_points_in_columns(met, heights, at, layer):
    """Count the points (``layer`` is empty), or write them at the places kept for them."""
    first, height, step = met
    for column in range(len(heights)):
        k, last, around = first[column], first[column + 1], 0
        if k == last:
            continue
        for n in range(heights.shape[1]):
            while k < last and height[k] < heights[column, n]:
                around += step[k]
                k += 1
            if around != 0:
                if len(layer):
                    layer[at[column]] = n
                at[column] += 1


@numba.njit(cache=True)
def add_windings_below(points, vertices, triangles, table, found):
    """Add the faces that a line down from each point meets."""
    low, width, counts, first, face, box = table
    for n in range(len(points)):
        x, y, z = points[n]
        i, j = int((x - low[0]) // width), int((y - low[1]) // width)
        if i < 0 or j < 0 or i >= counts[0] or j >= counts[1]:
            continue
        cell = i * counts[1] + j
        for k in range(first[cell], first[cell + 1]):
            # What lies above is not met, nor is what follows; what lies aside has no say.
            if z <= box[k, 4]:
                break
            if x < box[k, 0] or x > box[k, 1] or y < box[k, 2] or y > box[k, 3]:
                continue
            triangle = triangles[face[k]]
            around = triangle_covers(vertices, triangle, x, y)
            if around != 0 and triangle_height(vertices, triangle, x, y) < z:
                found[n] -= around


@numba.njit(cache=True)
def add_windings_below_sorted(points, vertices, triangles, found):
    """Do as ``add_windings_below`` without a table: points are in order of x, faces are asked one by one."""
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x = vertices[a, 0], vertices[b, 0], vertices[c, 0]
        n = np.searchsorted(points[:, 0], min(x))
        if n == len(points) or points[n, 0] > max(x):
            continue
        y = vertices[a, 1], vertices[b, 1], vertices[c, 1]
        lowest = min(vertices[a, 2], vertices[b, 2], vertices[c, 2])
        while n < len(points) and points[n, 0] <= max(x):
            px, py, pz = points[n]
            if min(y) <= py <= max(y) and lowest < pz:
                around = triangle_covers(vertices, triangles[t], px, py)
                if around != 0 and triangle_height(vertices, triangles[t], px, py) < pz:
                    found[n] -= around
            n += 1


@numba.njit(cache=True)
def add_open_edge_angles(points, vertices, rim, excess, found):
    """Add the solid angle of the curtain below each open edge (van Oosterom and Strackee 1983)."""
    for n in range(len(points)):
        px, py, pz = points[n]
        total = 0.0
        for k in range(len(rim)):
            p, q = rim[k]
            ax, ay, az = vertices[p, 0] - px, vertices[p, 1] - py, vertices[p, 2] - pz
            bx, by, bz = vertices[q, 0] - px, vertices[q, 1] - py, vertices[q, 2] - pz
            la = np.sqrt(ax * ax + ay * ay + az * az)
            lb = np.sqrt(bx * bx + by * by + bz * bz)
            side = ax * by - bx * ay
            rest = la * lb + ax * bx + ay * by + az * bz + la * bz + lb * az
            angle = np.arctan2(side, rest)
            if side == 0.0:
                angle = -abs(angle)
            total += excess[k] * angle
        found[n] += total / (2 * np.pi)


@numba.njit(cache=True, nogil=True)
def count_faces_in_cells(low, high, columns, out):
    """Count the faces whose boxes (N, 2), from cell ``low`` to cell ``high``, touch each cell."""
    for n in range(len(low)):
        for i in range(low[n, 0], high[n, 0] + 1):
            for j in range(low[n, 1], high[n, 1] + 1):
                out[i * columns + j] += 1


@numba.njit(cache=True, nogil=True)
def write_faces_in_cells(low, high, columns, order, place, out):
    """Write those faces into each cell in an order; ``place``: where the next of a cell goes."""
    for n in order:
        for i in range(low[n, 0], high[n, 0] + 1):
            for j in range(low[n, 1], high[n, 1] + 1):
                cell = i * columns + j
                out[place[cell]] = n
                place[cell] += 1
