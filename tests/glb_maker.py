"""Small glTF files made by hand, so that tests know every byte."""

import json
import struct

import numpy as np

COMPONENT = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125}
KIND = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
CUBE_TRIANGLES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
    np.uint16,
)  # fmt: skip


def pack(document, binary=b""):
    """Bytes of a GLB; ``document`` is JSON text, JSON bytes or something to dump."""
    if not isinstance(document, bytes | str):
        document = json.dumps(document)
    text = document.encode() if isinstance(document, str) else document
    chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
    if binary:
        chunks.append((b"BIN\0", binary + b"\0" * (-len(binary) % 4)))
    body = b"".join(struct.pack("<I4s", len(d), k) + d for k, d in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


class Maker:
    """A glTF file in the making; change ``json`` at will before saving."""

    def __init__(self):
        self.binary = b""
        self.json = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, data):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values, **more):
        values = np.asarray(values)
        rows = values.reshape(len(values), -1)
        self.json["accessors"].append(
            {
                "bufferView": self.view(rows.tobytes()),
                "componentType": COMPONENT.get(values.dtype.name, 5126),
                "count": len(rows),
                "type": KIND[rows.shape[1]],
                **more,
            }
        )
        return len(self.json["accessors"]) - 1

    def mesh(self, vertices=CUBE, indices=CUBE_TRIANGLES, attributes=None, **primitive):
        first = {"POSITION": self.accessor(np.asarray(vertices, np.float32))}
        item = {"attributes": first | (attributes or {}), **primitive}
        if indices is not None:
            item["indices"] = self.accessor(np.asarray(indices).reshape(-1))
        self.json["meshes"].append({"primitives": [item]})
        return len(self.json["meshes"]) - 1

    def node(self, root=True, **fields):
        self.json["nodes"].append(fields)
        k = len(self.json["nodes"]) - 1
        if root:
            self.json["scenes"][0]["nodes"].append(k)
        return k

    def primitive(self, mesh=0):
        return self.json["meshes"][mesh]["primitives"][0]

    def save(self, path):
        if self.binary:
            self.json["buffers"] = [{"byteLength": len(self.binary)}]
        path.write_bytes(pack(self.json, self.binary))
        return path


def cube(**node):
    """A unit cube in its own file."""
    made = Maker()
    made.node(mesh=made.mesh(), **node)
    return made
