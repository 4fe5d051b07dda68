"""Rows of vectors and matrices, stored channel by channel: neighbouring threads read neighbours.

A row of three or nine numbers that lie one after the other costs a warp of 32 threads three or nine times the
transactions of one whose first numbers of all rows lie together, then all second ones.
"""

from corporeal.mpm.cuda.layout import vec6, vec14, wp

wp.set_module_options({"enable_backward": False, "max_unroll": 0})


@wp.func
def cell_at(a: wp.array2d(dtype=wp.int32), i: int):
    """Row of whole numbers."""
    return wp.vec3i(a[0, i], a[1, i], a[2, i])


@wp.func
def put_cell(a: wp.array2d(dtype=wp.int32), i: int, v: wp.vec3i):
    """Write a row of whole numbers."""
    a[0, i] = v[0]
    a[1, i] = v[1]
    a[2, i] = v[2]
    return 0


@wp.func
def vector_at(a: wp.array2d(dtype=wp.float32), i: int):
    """Row of a vector."""
    return wp.vec3(a[0, i], a[1, i], a[2, i])


@wp.func
def put_vector(a: wp.array2d(dtype=wp.float32), i: int, v: wp.vec3):
    """Write a row of a vector."""
    a[0, i] = v[0]
    a[1, i] = v[1]
    a[2, i] = v[2]
    return 0


@wp.func
def matrix_at(a: wp.array2d(dtype=wp.float32), i: int):
    """Row of a matrix."""
    return wp.mat33(a[0, i], a[1, i], a[2, i], a[3, i], a[4, i], a[5, i], a[6, i], a[7, i], a[8, i])


@wp.func
def put_matrix(a: wp.array2d(dtype=wp.float32), i: int, m: wp.mat33):
    """Write a row of a matrix."""
    a[0, i] = m[0, 0]
    a[1, i] = m[0, 1]
    a[2, i] = m[0, 2]
    a[3, i] = m[1, 0]
    a[4, i] = m[1, 1]
    a[5, i] = m[1, 2]
    a[6, i] = m[2, 0]
    a[7, i] = m[2, 1]
    a[8, i] = m[2, 2]
    return 0


@wp.func
def symmetric_at(a: wp.array2d(dtype=wp.float32), i: int):
    """Row of a symmetric matrix: 00 01 02 11 12 22."""
    return wp.mat33(a[0, i], a[1, i], a[2, i], a[1, i], a[3, i], a[4, i], a[2, i], a[4, i], a[5, i])


@wp.func
def put_symmetric(a: wp.array2d(dtype=wp.float32), i: int, v: vec6):
    """Write a row of six."""
    a[0, i] = v[0]
    a[1, i] = v[1]
    a[2, i] = v[2]
    a[3, i] = v[3]
    a[4, i] = v[4]
    a[5, i] = v[5]
    return 0


@wp.func
def fourteen_at(a: wp.array2d(dtype=wp.float32), i: int):
    """Row of fourteen."""
    v = vec14()
    for k in range(wp.static(vec14._length_)):
        v[k] = a[k, i]
    return v


@wp.func
def put_fourteen(a: wp.array2d(dtype=wp.float32), i: int, v: vec14):
    """Write a row of fourteen."""
    for k in range(wp.static(vec14._length_)):
        a[k, i] = v[k]
    return 0
