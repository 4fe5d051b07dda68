"""Writer of Wavefront OBJ."""

import numpy as np
from jaxtyping import Float, Int


def format_obj(
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    uv: Float[np.ndarray, "V 2"] | None = None,
) -> str:
    """Return the file's text.

    Args:
        vertices: [m]
        triangles: Vertex numbers.
        uv: Texture coordinates, v running down as in glTF; OBJ's run up.

    """
    rows = ["v %.9g %.9g %.9g\n" * len(vertices) % _flat(vertices)]
    corners = np.asarray(triangles) + 1
    if uv is None:
        return "".join([*rows, "f %d %d %d\n" * len(corners) % _flat(corners)])
    rows.append("vt %.7g %.7g\n" * len(uv) % _flat(np.column_stack([uv[:, 0], 1 - uv[:, 1]])))
    twice = np.repeat(corners, 2, axis=1)
    return "".join([*rows, "f %d/%d %d/%d %d/%d\n" * len(twice) % _flat(twice)])


def _flat(values: np.ndarray) -> tuple:
    return tuple(np.asarray(values).ravel().tolist())
