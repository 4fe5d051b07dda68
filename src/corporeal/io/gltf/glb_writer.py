"""Deterministic writer of scenes as GLB.

One node per object, named like the object, with a child node per surface. The file is Y-up, as
glTF asks: the root node turns our Z-up into it, so that numbers pass through unrounded. What glTF
has no word for (class, real extent, gravity, forces) stands in ``extras``; ``read_glb`` reads it.
"""

import io
import math
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core.types import Finish, Push, Scene, SceneObject, Surface, Wind
from corporeal.io.gltf.gltf_container import pack_glb

GLB_GENERATOR = "corporeal"
FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125
VERTEX_BUFFER, INDEX_BUFFER = 34962, 34963
ACCESSOR_TYPE_OF_WIDTH = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
Y_UP_FROM_Z_UP = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1]
"""(x, y, z) → (x, z, -y), column by column as glTF stores a matrix."""


def write_glb(path: Path, scene: Scene) -> None:
    """Save the scene; lengths in metres, velocities, pushes and winds in the extras of their nodes.

    Raises:
        ValueError: A number in the scene is NaN or infinite, which JSON cannot say.
    """
    Path(path).write_bytes(encode_glb(scene))


def encode_glb(scene: Scene) -> bytes:
    """Return the bytes of the GLB file."""
    document = GlbDocument(scene)
    objects = [document.object_node(k, o) for k, o in enumerate(scene.objects)]
    document.close(objects)
    return document.bytes()


class GlbDocument:
    """The JSON and the binary chunk, growing together."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.binary = bytearray()
        self.json: dict = {"asset": _asset(scene)}
        self.extensions: set[str] = set()
        self.materials: dict[int, int] = {}

    def add(self, group: str, item: dict) -> int:
        """Append to a top-level list of the JSON and return the place."""
        self.json.setdefault(group, []).append(item)
        return len(self.json[group]) - 1

    def object_node(self, k: int, thing: SceneObject) -> int:
        """Add an object with its surfaces below it; return its node."""
        children = [self.surface_node(s) for s in self.scene.surfaces if s.object == k]
        node: dict = {"name": thing.name, "extras": _object_extras(thing)}
        if children:
            node["children"] = children
        return self.add("nodes", node)

    def surface_node(self, surface: Surface) -> int:
        """Add a surface with its mesh; return its node."""
        node: dict = {"name": surface.name}
        if len(surface.triangles):
            mesh = {"name": surface.name, "primitives": [self.primitive(surface)]}
            node["mesh"] = self.add("meshes", mesh)
        if surface.extras:
            node["extras"] = surface.extras
        return self.add("nodes", node)

    def primitive(self, s: Surface) -> dict:
        """Add a surface's arrays and return what draws them."""
        attributes = {"POSITION": self.array(s.vertices, bounds=True)}
        for name, values in (("NORMAL", s.normals), ("TEXCOORD_0", s.uv), ("COLOR_0", s.colours)):
            if values is not None:
                attributes[name] = self.array(values)
        return {
            "attributes": attributes,
            "indices": self.indices(s.triangles, len(s.vertices)),
            "material": self.material(s.finish),
        }

    def array(self, values: np.ndarray, bounds: bool = False) -> int:
        """Add floats, one row a vertex."""
        data = np.ascontiguousarray(values, "<f4")
        if not np.isfinite(data).all():
            raise ValueError("a surface holds NaN or infinite numbers")
        item = {
            "bufferView": self.view(data.tobytes(), VERTEX_BUFFER),
            "componentType": FLOAT,
            "count": len(data),
            "type": ACCESSOR_TYPE_OF_WIDTH[data.shape[1]],
        }
        if bounds:
            item |= {"min": data.min(0).tolist(), "max": data.max(0).tolist()}
        return self.add("accessors", item)

    def indices(self, triangles: np.ndarray, vertices: int) -> int:
        """Add triangles."""
        # The largest value of each type is reserved (glTF 2.0, 3.7.2.1).
        small = vertices < 2**16
        data = np.ascontiguousarray(triangles, "<u2" if small else "<u4").reshape(-1)
        item = {
            "bufferView": self.view(data.tobytes(), INDEX_BUFFER),
            "componentType": UNSIGNED_SHORT if small else UNSIGNED_INT,
            "count": len(data),
            "type": "SCALAR",
        }
        return self.add("accessors", item)

    def view(self, data: bytes, target: int | None = None) -> int:
        """Add bytes, on a boundary of four."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        return self.add("bufferViews", view | ({"target": target} if target else {}))

    def material(self, finish: int) -> int:
        """Return the place of a finish, added once."""
        if finish not in self.materials:
            item = self.material_item(self.scene.finishes[finish])
            self.materials[finish] = self.add("materials", item)
        return self.materials[finish]

    def material_item(self, f: Finish) -> dict:
        """Return a finish as glTF says it."""
        pbr: dict = {"baseColorFactor": list(f.colour), "metallicFactor": f.metallic, "roughnessFactor": f.roughness}
        if f.texture is not None:
            pbr["baseColorTexture"] = {"index": self.texture(f)}
        item: dict = {"name": f.name, "pbrMetallicRoughness": pbr}
        if f.alpha_mode != "OPAQUE":
            item["alphaMode"] = f.alpha_mode
        if f.alpha_mode == "MASK":
            item["alphaCutoff"] = f.alpha_cutoff
        extensions = {}
        if f.transmission:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": f.transmission}
        if f.emission:
            strength = max(f.emission, 1.0)
            item["emissiveFactor"] = [f.emission / strength * c for c in f.colour[:3]]
            if strength > 1:
                extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if extensions:
            item["extensions"] = extensions
            self.extensions.update(extensions)
        return item

    def texture(self, f: Finish) -> int:
        """Add a finish's picture."""
        png = io.BytesIO()
        Image.fromarray(np.asarray(f.texture)).save(png, "PNG")
        image = {"name": f.name, "mimeType": "image/png", "bufferView": self.view(png.getvalue())}
        if "samplers" not in self.json:
            self.add("samplers", {"magFilter": 9729, "minFilter": 9987})
        return self.add("textures", {"sampler": 0, "source": self.add("images", image)})

    def close(self, objects: list[int]) -> None:
        """Add the root that stands the scene on its feet, and the lists that sum up the file."""
        scene = self.scene
        root: dict = {
            "name": scene.name,
            "matrix": Y_UP_FROM_Z_UP,
            "extras": {"gravity_m_s2": list(scene.gravity), "duration_s": scene.duration, "fps": scene.fps}
            | ({"settled": True} if scene.settled else {}),
        }
        if objects:
            root["children"] = objects
        self.json["scene"] = 0
        self.json["scenes"] = [{"name": scene.name, "nodes": [self.add("nodes", root)]}]
        if self.extensions:
            self.json["extensionsUsed"] = sorted(self.extensions)

    def bytes(self) -> bytes:
        """Return the file."""
        return pack_glb(self.json, self.binary)


def _asset(scene: Scene) -> dict:
    credits = sorted({o.credit for o in scene.objects if o.credit})
    asset = {"version": "2.0", "generator": GLB_GENERATOR}
    return asset | ({"copyright": "; ".join(credits)} if credits else {})


def _object_extras(thing: SceneObject) -> dict:
    extras: dict = {"class": thing.class_name, "real_extent_m": thing.real_extent, "scale": thing.scale}
    if any(thing.velocity):
        extras["velocity_m_s"] = list(thing.velocity)
    if thing.push is not None:
        acceleration = list(thing.push.acceleration)
        extras["push"] = {"acceleration_m_s2": acceleration} | _window(thing.push)
    if thing.wind is not None:
        blown = {"velocity_m_s": list(thing.wind.velocity), "gust": thing.wind.gust}
        extras["wind"] = blown | _window(thing.wind)
    if thing.path is not None:
        path = thing.path
        extras["path"] = {
            "time_s": list(path.time),
            "shift_m": [x for row in path.shift for x in row],
            "turn_rad": [x for row in path.turn for x in row],
        }
    origin = {"source": thing.source, "credit": thing.credit, "sized_by": thing.sized_by}
    for key, words in origin.items():
        if words:
            extras[key] = words
    return extras


def _window(force: Push | Wind) -> dict:
    return {"start_s": force.start, "end_s": force.end if math.isfinite(force.end) else None}
