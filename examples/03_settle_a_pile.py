"""Settle three bricks on each other and certify that they rest: meshes → bodies → poses."""

import numpy as np
import trimesh

from corporeal.settle.body import Body
from corporeal.settle.decompose import decompose
from corporeal.settle.rest import at_rest

LENGTH, WIDTH, HEIGHT = 0.24, 0.115, 0.071
"""Of a brick [m]."""


def a_brick(name: str) -> Body:
    """Return a brick as a rigid body."""
    mesh = trimesh.creation.box((LENGTH, WIDTH, HEIGHT))
    vertices, triangles = np.array(mesh.vertices), np.array(mesh.faces)
    return Body(name, vertices, triangles, decompose(vertices, triangles), density=1900.0)


def main() -> float:
    """Return the height of the pile over three bricks' height."""
    bricks = [a_brick(f"brick_{k}") for k in range(3)]
    poses, proof = at_rest(bricks, "stack", seed=0, deepest=1e-3)
    top = max(
        float(pose.world(brick.vertices)[:, 2].max())
        for brick, pose in zip(bricks, poses, strict=True)
    )
    print(f"{top:.4f} m high; moves {1e3 * proof.drift_m:.2g} mm in a second at rest")
    return top / (3 * HEIGHT)


if __name__ == "__main__":
    main()
