"""Copying of meshes and materials of a glTF file, byte for byte, into another.

Entries are copied once, on first use. Whatever an index points to gets a new number; all else passes as it is. glTF 2.0
specification, sections 3.6 to 3.9, and the extensions named below, Khronos Group.
"""

from typing import Any

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import NoteKind
from corporeal.io.gltf.gltf_container import MAX_MODEL_FILE_BYTES
from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry

MIME_OF_IMAGE_SIGNATURE = {
    b"\x89PNG\r\n\x1a\n": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
    b"\xabKTX 20": "image/ktx2",
}
"""First bytes of a picture → what a file must call it."""
DRACO_EXTENSION = "KHR_draco_mesh_compression"
IMPLICIT_EXTENSIONS = ("KHR_mesh_quantization",)
"""Extensions that show in no place of the JSON but the lists of those used."""


class MergedDocument:
    """The JSON and the binary chunk of the file in the making."""

    def __init__(self, max_bytes: int = MAX_MODEL_FILE_BYTES) -> None:
        self.max_bytes = max_bytes
        self.json: dict[str, Any] = {}
        self.binary = bytearray()
        self.used: set[str] = set()
        self.required: set[str] = set()

    def add(self, group: str, item: dict) -> int:
        """Append to a top-level list and return the place."""
        self.json.setdefault(group, []).append(item)
        return len(self.json[group]) - 1

    def view(self, data: memoryview, rest: dict) -> int:
        """Append bytes as a buffer view; ``rest`` holds its entry's other members.

        Raises:
            UserError: The file would grow beyond what is read back.
        """
        self.binary += b"\0" * (-len(self.binary) % 4)
        if len(self.binary) + len(data) > self.max_bytes:
            raise UserError(
                f"The merged file would be larger than {self.max_bytes >> 30} GiB. "
                "Take fewer objects, or smaller textures."
            )
        place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        return self.add("bufferViews", place | rest)


class GltfCopier:
    """What one file holds, on its way into the merged one."""

    def __init__(self, document: GltfDocument, merged: MergedDocument) -> None:
        self.document = document
        self.merged = merged
        self._numbers: dict[str, int] = {}
        used = [*document.required, *document.root.sequence("extensionsUsed")]
        self.use(*(name for name in IMPLICIT_EXTENSIONS if name in used))

    def use(self, *extensions: str) -> None:
        """Remember that a copied entry speaks by these extensions."""
        self.merged.used.update(extensions)
        self.merged.required.update(set(extensions) & set(self.document.required))

    def mesh(self, entry: GltfEntry) -> int:
        """Copy a mesh with all its primitives."""
        primitives = entry.children("primitives")
        return self._once(
            "meshes",
            entry,
            lambda: copy_without_extensions(entry) | {"primitives": [self._primitive(p) for p in primitives]},
        )

    def accessor(self, entry: GltfEntry) -> int:
        """Copy an accessor with the bytes that it reads."""
        return self._once("accessors", entry, lambda: self._accessor(entry))

    def _once(self, group: str, entry: GltfEntry, copy: Any) -> int:
        if entry.pointer not in self._numbers:
            self._numbers[entry.pointer] = self.merged.add(group, copy())
        return self._numbers[entry.pointer]

    def _primitive(self, entry: GltfEntry) -> dict:
        item = copy_without_extensions(entry, "material")
        item["attributes"] = self._attributes(entry.needed("attributes"))
        indices = entry.refer("indices", "accessors")
        if indices:
            item["indices"] = self.accessor(indices)
        item |= self._look(entry)
        if entry.has("targets"):
            item["targets"] = [self._attributes(t) for t in entry.children("targets")]
        packed = entry.extension(DRACO_EXTENSION)
        if packed:
            item["extensions"] = {DRACO_EXTENSION: packed.value | {"bufferView": self._view(packed)}}
            self.use(DRACO_EXTENSION)
        return item

    def _attributes(self, entry: GltfEntry) -> dict[str, int]:
        found = {name: entry.refer(name, "accessors") for name in entry.value}
        return {name: self.accessor(a) for name, a in found.items() if a}

    def _accessor(self, entry: GltfEntry) -> dict:
        item = copy_without_extensions(entry)
        if entry.has("bufferView"):
            item["bufferView"] = self._view(entry)
        sparse = entry.child("sparse")
        if sparse:
            parts = {key: sparse.needed(key) for key in ("indices", "values")}
            parts = {key: p.value | {"bufferView": self._view(p)} for key, p in parts.items()}
            item["sparse"] = sparse.value | parts
        return item

    def _view(self, entry: GltfEntry) -> int:
        view = entry.refer("bufferView", "bufferViews") or entry.fail("'bufferView' is missing.")
        if view.pointer not in self._numbers:
            rest = copy_without_extensions(view, "buffer", "byteOffset", "byteLength")
            self._numbers[view.pointer] = self.merged.view(self.document.view(view), rest)
        return self._numbers[view.pointer]

    def _look(self, primitive: GltfEntry) -> dict:
        """Copy a primitive's material; a broken one refuses no file, as for a reader."""
        try:
            entry = primitive.refer("material", "materials")
            if entry is None:
                return {}
            return {"material": self._once("materials", entry, lambda: self._material(entry))}
        except BadFileError as problem:
            self.document.warn_of("a material", problem)
        except RecursionError:
            self.document.warn("a material is left out: it is nested too deeply.", NoteKind.LEFT_OUT)
        return {}

    def _material(self, entry: GltfEntry) -> dict:
        """Copy a material, or a part of one; what is called a texture and has an index is one."""
        item = dict(entry.value)
        for key, x in entry.value.items():
            if isinstance(x, dict) and key != "extras":
                item[key] = self._material(entry.needed(key))
        spoken = entry.child("extensions")
        self.use(*(spoken.value if spoken else ()))
        if entry.pointer.lower().endswith("texture"):
            texture = entry.refer("index", "textures") or entry.fail("'index' is missing.")
            item["index"] = self._once("textures", texture, lambda: self._texture(texture))
        return item

    def _texture(self, entry: GltfEntry) -> dict:
        item = copy_without_extensions(entry) | self._source(entry)
        sampler = entry.refer("sampler", "samplers")
        if sampler:
            item["sampler"] = self._once("samplers", sampler, lambda: copy_without_extensions(sampler))
        others = entry.child("extensions")
        found = {} if others is None else {n: self._source(others.needed(n)) for n in others.value}
        found = {name: source for name, source in found.items() if source}
        if found:
            item["extensions"] = found
            self.use(*found)
        return item

    def _source(self, entry: GltfEntry) -> dict:
        """Copy the picture of a texture, or of a format that an extension adds to it."""
        image = entry.refer("source", "images")
        if image is None:
            return {}
        try:
            return {"source": self._once("images", image, lambda: self._image(image))}
        except BadFileError as problem:
            self.document.warn_of("a texture", problem)
            return {}

    def _image(self, entry: GltfEntry) -> dict:
        item = copy_without_extensions(entry, "uri")
        if not entry.has("uri"):
            return item | {"bufferView": self._view(entry)}
        data = self.document.resource(entry)
        item["mimeType"] = entry.text("mimeType") or _image_mime(bytes(data[:12]))
        if not item["mimeType"]:
            entry.fail("it is neither PNG, JPEG, WebP nor KTX2.", "Convert the picture to PNG.")
        return item | {"bufferView": self.merged.view(data, {})}


def copy_without_extensions(entry: GltfEntry, *dropped: str) -> dict:
    """Copy an entry without its extensions, which may point anywhere, and without some keys."""
    return {k: x for k, x in entry.value.items() if k != "extensions" and k not in dropped}


def _image_mime(start: bytes) -> str:
    return next((kind for sign, kind in MIME_OF_IMAGE_SIGNATURE.items() if start.startswith(sign)), "")
