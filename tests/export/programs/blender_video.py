"""Blender opens a video: ``python blender_video.py VIDEO OUT.npz FPS SECONDS …``.

Saves the vertices of every mesh at these instants in the world, +Z up, as NUMBER|PARENT|MESH.
"""

import sys

import bpy
import numpy as np

path, out, fps = sys.argv[1], sys.argv[2], float(sys.argv[3])
seconds = [float(s) for s in sys.argv[4:]]

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = round(fps)  # before: keyframes of glTF are placed by it
if path.endswith(".usda"):
    bpy.ops.wm.usd_import(filepath=path)
elif path.endswith(".abc"):
    bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
else:
    bpy.ops.import_scene.gltf(filepath=path)
scene.render.fps = round(fps)
found = {}
for number, second in enumerate(seconds):
    frame = second * fps
    scene.frame_set(int(frame), subframe=frame - int(frame))
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in bpy.data.objects:
        if thing.type != "MESH":
            continue
        posed = thing.evaluated_get(graph)
        mesh = posed.to_mesh()
        flat = np.empty(3 * len(mesh.vertices))
        mesh.vertices.foreach_get("co", flat)
        world = np.array(posed.matrix_world)
        parent = thing.parent.name if thing.parent else ""
        found[f"{number}|{parent}|{thing.name}"] = flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        posed.to_mesh_clear()
np.savez(out, **found)
