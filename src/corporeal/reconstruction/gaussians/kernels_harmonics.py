"""Real spherical harmonics with their derivatives, one direction at a time. Compiled by numba.

The same functions as in ``geometry.harmonics``, which a test holds equal.
"""

import numba

JIT_OPTIONS = {
    "nogil": True,
    "cache": True,
    "error_model": "numpy",  # a division that may raise keeps its loop from being vectorised
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


@numba.njit(**JIT_OPTIONS)
def harmonics(x, y, z, coefficients, out):
    """Y_k at a unit direction, for K = 1, 4, 9 or 16 coefficients."""
    out[0] = 0.28209479177387814
    if coefficients > 1:
        c = 0.4886025119029199
        out[1], out[2], out[3] = -c * y, c * z, -c * x
    if coefficients > 4:
        a, b, c = 1.0925484305920792, 0.31539156525252005, 0.5462742152960396
        out[4], out[5], out[6] = a * x * y, -a * y * z, b * (2 * z * z - x * x - y * y)
        out[7], out[8] = -a * x * z, c * (x * x - y * y)
    if coefficients > 9:
        a, b, c = 0.5900435899266435, 2.890611442640554, 0.4570457994644658
        d, e = 0.3731763325901154, 1.445305721320277
        xx, yy, zz = x * x, y * y, z * z
        out[9], out[10] = -a * y * (3 * xx - yy), b * x * y * z
        out[11] = -c * y * (4 * zz - xx - yy)
        out[12] = d * z * (2 * zz - 3 * xx - 3 * yy)
        out[13], out[14] = -c * x * (4 * zz - xx - yy), e * z * (xx - yy)
        out[15] = -a * x * (xx - 3 * yy)


@numba.njit(**JIT_OPTIONS)
def harmonics_gradient(x, y, z, coefficients, out):
    """Derivatives of the polynomials Y_k along x, y and z, (K, 3)."""
    out[:coefficients] = 0.0
    if coefficients > 1:
        c = 0.4886025119029199
        out[1, 1], out[2, 2], out[3, 0] = -c, c, -c
    if coefficients > 4:
        a, b, c = 1.0925484305920792, 0.31539156525252005, 0.5462742152960396
        out[4, 0], out[4, 1] = a * y, a * x
        out[5, 1], out[5, 2] = -a * z, -a * y
        out[6, 0], out[6, 1], out[6, 2] = -2 * b * x, -2 * b * y, 4 * b * z
        out[7, 0], out[7, 2] = -a * z, -a * x
        out[8, 0], out[8, 1] = 2 * c * x, -2 * c * y
    if coefficients > 9:
        a, b, c = 0.5900435899266435, 2.890611442640554, 0.4570457994644658
        d, e = 0.3731763325901154, 1.445305721320277
        xx, yy, zz = x * x, y * y, z * z
        out[9, 0], out[9, 1] = -6 * a * x * y, -3 * a * (xx - yy)
        out[10, 0], out[10, 1], out[10, 2] = b * y * z, b * x * z, b * x * y
        out[11, 0], out[11, 1] = 2 * c * x * y, -c * (4 * zz - xx - 3 * yy)
        out[11, 2] = -8 * c * y * z
        out[12, 0], out[12, 1] = -6 * d * x * z, -6 * d * y * z
        out[12, 2] = d * (6 * zz - 3 * xx - 3 * yy)
        out[13, 0], out[13, 1] = -c * (4 * zz - 3 * xx - yy), 2 * c * x * y
        out[13, 2] = -8 * c * x * z
        out[14, 0], out[14, 1], out[14, 2] = 2 * e * x * z, -2 * e * y * z, e * (xx - yy)
        out[15, 0], out[15, 1] = -3 * a * (xx - yy), 6 * a * x * y
