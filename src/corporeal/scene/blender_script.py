# Let the bodies of a job fall and come to rest; run by Blender's Python, never imported:
#
#     blenderproc run blender_script.py job.json result.json
#
# BlenderProc starts no script whose first statement is not its import, hence no docstring. Bodies
# lie about their centres of mass, because Blender takes an object's origin for that. BlenderProc's
# own loop (bproc.object.simulate_physics) moves origins, and compares coordinates without their
# signs when it asks whether something still moves; so frames are stepped here.
# ruff: noqa: D100, I001
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

import blenderproc as bproc
import json
import os
import sys

import bpy
from mathutils import Matrix, Quaternion, Vector

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def body_of(entry: dict, job: dict):
    """Make one compound body of its convex pieces, where it starts."""
    body = bproc.object.create_from_blender_mesh(joined(entry["pieces"]), entry["name"])
    body.enable_rigidbody(
        True,
        collision_shape="COMPOUND",
        collision_margin=job["margin"],
        mass=entry["mass"],
        friction=job["friction"],
        linear_damping=job["damping"],
        angular_damping=job["damping"],
    )
    firm(body.get_rigidbody())
    for number, piece in enumerate(entry["pieces"]):
        part = bproc.object.create_from_blender_mesh(joined([piece]), f"{entry['name']} {number}")
        part.set_parent(body)
        part.enable_rigidbody(
            True, collision_shape="CONVEX_HULL", collision_margin=job["margin"], friction=job["friction"]
        )
        firm(part.get_rigidbody())
    turn = Quaternion(entry["quaternion"]).to_matrix().to_4x4()
    body.set_local2world_mat(Matrix.Translation(Vector(entry["position"])) @ turn)
    return body


def joined(pieces: list):
    """Make one Blender mesh of several meshes."""
    vertices, triangles = [], []
    for piece in pieces:
        first = len(vertices)
        vertices += [tuple(v) for v in piece["vertices"]]
        triangles += [tuple(first + k for k in t) for t in piece["triangles"]]
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(vertices, [], triangles)
    mesh.update()
    return mesh


def firm(rigid_body) -> None:
    """Let it neither bounce nor fall asleep: what sleeps looks at rest and is not."""
    rigid_body.restitution = 0.0
    rigid_body.use_deactivation = False


def lay_floor(job: dict) -> None:
    """Put a block below z = 0, far wider than the scene."""
    reach = job["floor"]
    block = {
        "vertices": [(x, y, z) for x in (-reach, reach) for y in (-reach, reach) for z in (-0.5, 0.5)],
        "triangles": QUADS,
    }
    floor = bproc.object.create_from_blender_mesh(joined([block]), "floor")
    floor.set_location([0.0, 0.0, -0.5])
    floor.enable_rigidbody(False, collision_shape="BOX", collision_margin=job["margin"], friction=job["friction"])
    firm(floor.get_rigidbody())


def farthest(before: list, after: list, radius: list) -> float:
    """How far at most any point of any body went between two frames."""
    most = 0.0
    for was, now, reach in zip(before, after, radius):  # noqa: B905
        angle = was.to_quaternion().rotation_difference(now.to_quaternion()).angle
        angle = min(angle, 6.283185307179586 - angle)
        most = max(most, (now.translation - was.translation).length + angle * reach)
    return most


def drop(job: dict) -> dict:
    """Step frames until nothing moves for a while, or time is up."""
    bproc.clean_up()
    scene = bpy.context.scene
    lay_floor(job)
    bodies = [body_of(entry, job) for entry in job["bodies"]]
    frames, window = round(job["longest"] * job["fps"]), round(job["hold"] * job["fps"])
    scene.gravity = (0.0, 0.0, -job["gravity"])
    scene.render.fps, scene.frame_start, scene.frame_end = job["fps"], 1, frames
    world = scene.rigidbody_world
    world.enabled = True
    world.substeps_per_frame, world.solver_iterations = job["substeps"], job["iterations"]
    world.point_cache.frame_start, world.point_cache.frame_end = 1, frames
    radius = [entry["radius"] for entry in job["bodies"]]
    quiet, before, frame = False, None, 0
    for frame in range(1, frames + 1):
        scene.frame_set(frame)
        if frame % window == 0:
            now = [b.blender_obj.matrix_world.copy() for b in bodies]
            quiet = before is not None and farthest(before, now, radius) < job["shift"]
            before = now
        if quiet:
            break
    rests = []
    for entry, body in zip(job["bodies"], bodies):  # noqa: B905
        where, turn, _ = body.blender_obj.matrix_world.decompose()
        rests.append({"name": entry["name"], "position": list(where), "quaternion": list(turn)})
    return {"seconds": frame / job["fps"], "quiet": quiet, "bodies": rests}


def main() -> None:
    """Read the job, write the result: all of it or nothing."""
    with open(sys.argv[1], encoding="utf-8") as file:
        job = json.load(file)
    result = drop(job)
    with open(sys.argv[2] + ".part", "w", encoding="utf-8") as file:
        json.dump(result, file)
    os.replace(sys.argv[2] + ".part", sys.argv[2])


main()
