"""Materials of a glTF file as finishes.

What concerns only the look never refuses a file: a broken texture or material becomes a warning. Facts: glTF 2.0,
section 3.9, and the KHR extensions named below, Khronos Group.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Finish, NoteKind
from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry
from corporeal.io.image_decoder import decode_image

DEFAULT_FINISH = Finish("plain", colour=(0.8, 0.8, 0.8, 1.0), roughness=0.8)
"""For a surface without any material."""


@dataclass(frozen=True)
class TexturedFinish:
    """A finish, and how a mesh's texture coordinates lead into its picture."""

    finish: Finish
    uv_set: int = 0
    uv_matrix: np.ndarray | None = None
    """(2, 3) of KHR_texture_transform: rows give u' and v' from (u, v, 1)."""


class FinishReader:
    """The finishes of one file, each read once and numbered in order of use."""

    def __init__(self, document: GltfDocument) -> None:
        self.document = document
        self.finishes: list[Finish] = []
        self._dresses: dict[str, tuple[int, TexturedFinish]] = {}
        self._pictures: dict[str, np.ndarray | None] = {}

    def dress(self, primitive: GltfEntry) -> tuple[int, TexturedFinish]:
        """Return the number of a primitive's finish and how to wear it."""
        try:
            material = primitive.refer("material", "materials")
        except BadFileError as problem:
            self.document.warn_of("a material", problem)
            material = None
        key = material.pointer if material else ""
        if key not in self._dresses:
            dress = self._read(material) if material else TexturedFinish(DEFAULT_FINISH)
            self.finishes.append(dress.finish)
            self._dresses[key] = (len(self.finishes) - 1, dress)
        return self._dresses[key]

    def _read(self, material: GltfEntry) -> TexturedFinish:
        name = material.text("name")[:120] or f"material {material.pointer.rsplit('/', 1)[1]}"
        try:
            return self._read_sound(material, name)
        except BadFileError as problem:
            self.document.warn_of(f"the look of material {name!r}", problem)
            return TexturedFinish(replace(DEFAULT_FINISH, name=name))

    def _read_sound(self, material: GltfEntry, name: str) -> TexturedFinish:
        base = _BaseMaterial(self, material)
        finish = Finish(
            name=name,
            colour=_unit(base.colour),
            texture=base.picture,
            metallic=base.metallic,
            roughness=base.roughness,
            transmission=_transmission(material),
            emission=_emission_ratio(material, base.colour),
            alpha_mode=_alpha_mode(material),
            alpha_cutoff=material.number("alphaCutoff", 0.5),
        )
        if base.picture is None or base.texture is None:
            return TexturedFinish(finish)
        return TexturedFinish(finish, *_uv_transform(base.texture))

    def picture(self, texture: GltfEntry | None) -> np.ndarray | None:
        """Return the picture that a textureInfo leads to; None, with a warning, if it is broken."""
        if texture is None:
            return None
        try:
            item = texture.refer("index", "textures") or texture.fail("'index' is missing.")
            webp = item.extension("EXT_texture_webp")
            image = (webp or item).refer("source", "images")
            if image is None:
                item.fail("its picture is in a format that is not supported.")
            return self._image(image)
        except BadFileError as problem:
            self.document.warn_of("a texture", problem)
            return None

    def _image(self, image: GltfEntry) -> np.ndarray | None:
        if image.pointer not in self._pictures:
            self._pictures[image.pointer] = None
            self._pictures[image.pointer] = self._decode(image)
        return self._pictures[image.pointer]

    def _decode(self, image: GltfEntry) -> np.ndarray | None:
        try:
            if image.has("uri"):
                return decode_image(bytes(image.document.resource(image)))
            view = image.refer("bufferView", "bufferViews")
            if view is None:
                image.fail("names neither 'uri' nor 'bufferView'.")
            return decode_image(bytes(image.document.view(view)))
        except ValueError as problem:
            words = f"texture {image.text('name')!r} ({image.pointer})"
            self.document.warn(f"{words} is left out: {problem}.", NoteKind.LEFT_OUT)
            return None


class _BaseMaterial:
    """Base colour, metalness and roughness, whichever way the material states them."""

    def __init__(self, wardrobe: FinishReader, material: GltfEntry) -> None:
        self.wardrobe = wardrobe
        self.unlit = material.extension("KHR_materials_unlit") is not None
        self.glossy = material.extension("KHR_materials_pbrSpecularGlossiness")
        self.pbr = material.child("pbrMetallicRoughness") or GltfEntry(
            material.document, {}, f"{material.pointer}/pbrMetallicRoughness"
        )

    @cached_property
    def texture(self) -> GltfEntry | None:
        if self.glossy:
            return self.glossy.child("diffuseTexture")
        return self.pbr.child("baseColorTexture")

    @cached_property
    def picture(self) -> np.ndarray | None:
        return self.wardrobe.picture(self.texture)

    @cached_property
    def _shiny(self) -> bool:
        """Whether a specular–glossiness material means a metal: bright specular, dark diffuse."""
        if not self.glossy:
            return False
        specular = np.mean(self.glossy.numbers("specularFactor", (1.0, 1.0, 1.0)))
        diffuse = np.mean(self.glossy.numbers("diffuseFactor", (1.0, 1.0, 1.0, 1.0))[:3])
        return bool(specular > 0.3 and diffuse < 0.5 * specular)

    @cached_property
    def colour(self) -> tuple[float, ...]:
        if not self.glossy:
            return self.pbr.numbers("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        diffuse = self.glossy.numbers("diffuseFactor", (1.0, 1.0, 1.0, 1.0))
        if not self._shiny:
            return diffuse
        return (*self.glossy.numbers("specularFactor", (1.0, 1.0, 1.0)), diffuse[3])

    @cached_property
    def metallic(self) -> float:
        if self.glossy or self.unlit:
            return float(self._shiny)
        # glTF's default is a metal, yet a material that states nothing about it is hardly one.
        silent = not self.pbr.has("metallicFactor") and not self.pbr.has("roughnessFactor")
        default = 0.0 if silent and not self._surface_texture else 1.0
        return _clip(self.pbr.number("metallicFactor", default) * self._mean_of_channel(2))

    @cached_property
    def roughness(self) -> float:
        if self.glossy:
            return _clip(1.0 - self.glossy.number("glossinessFactor", 1.0))
        if self.unlit:
            return 1.0
        return _clip(self.pbr.number("roughnessFactor", 1.0) * self._mean_of_channel(1))

    @cached_property
    def _surface_texture(self) -> GltfEntry | None:
        return self.pbr.child("metallicRoughnessTexture")

    def _mean_of_channel(self, channel: int) -> float:
        """Average of a metallic–roughness picture: a finish has one number for the whole."""
        picture = self.wardrobe.picture(self._surface_texture)
        return 1.0 if picture is None else float(picture[..., channel].mean() / 255.0)


def _uv_transform(texture: GltfEntry) -> tuple[int, np.ndarray | None]:
    """Return which coordinates a texture takes, and the matrix of KHR_texture_transform.

    The rotation is anticlockwise to the eye, and v runs down: (u, v) becomes (v, -u) at 90°. So
    says the extension's text and so do three.js and the Khronos viewer; the GLSL in its README
    is the transpose.
    """
    transform = texture.extension("KHR_texture_transform")
    uv_set = texture.whole("texCoord", 0)
    if transform is None:
        return uv_set, None
    angle = transform.number("rotation", 0.0)
    sx, sy = transform.numbers("scale", (1.0, 1.0))
    x, y = transform.numbers("offset", (0.0, 0.0))
    cos, sin = np.cos(angle), np.sin(angle)
    matrix = np.array([[cos * sx, sin * sy, x], [-sin * sx, cos * sy, y]])
    return transform.whole("texCoord", uv_set), matrix


def _transmission(material: GltfEntry) -> float:
    glass = material.extension("KHR_materials_transmission")
    return _clip(glass.number("transmissionFactor", 0.0)) if glass else 0.0


def _emission_ratio(material: GltfEntry, colour: tuple[float, ...]) -> float:
    """Return emitted light over base colour; an emission picture has no such number: none."""
    emitted = material.numbers("emissiveFactor", (0.0, 0.0, 0.0))
    if material.has("emissiveTexture") or max(emitted) <= 0 or max(colour[:3]) <= 0:
        return 0.0
    strong = material.extension("KHR_materials_emissive_strength")
    strength = strong.number("emissiveStrength", 1.0) if strong else 1.0
    return max(0.0, strength * max(emitted) / max(colour[:3]))


def _alpha_mode(material: GltfEntry):
    mode = material.text("alphaMode", "OPAQUE")
    return mode if mode in ("OPAQUE", "MASK", "BLEND") else "OPAQUE"


def _unit(colour: tuple[float, ...]) -> tuple[float, float, float, float]:
    r, g, b, a = (_clip(c) for c in colour)
    return (r, g, b, a)


def _clip(x: float) -> float:
    return min(max(x, 0.0), 1.0)
