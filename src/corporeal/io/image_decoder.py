"""Decoding of untrusted images."""

import io
import warnings
from collections.abc import Callable

import numpy as np
from jaxtyping import Int32, UInt8, UInt16
from PIL import Image, ImageFile, UnidentifiedImageError

IMAGE_FORMATS = ("PNG", "JPEG", "WEBP")
MAX_IMAGE_PIXELS = 2**27
"""A picture that claims more is refused before it is unpacked."""
MAX_IMAGE_SIDE_PX = 4096
"""Larger pictures are halved until they fit: no rendering shows more of one object [px]."""


def decode_image(data: bytes, side: int = MAX_IMAGE_SIDE_PX) -> UInt8[np.ndarray, "H W C"]:
    """Return a PNG, JPEG or WebP picture as sRGB, or sRGB with alpha where it has some.

    Larger pictures than ``side`` are halved until they fit.

    Raises:
        ValueError: The bytes are no such picture, or it is broken or absurdly large.
    """
    return _decode_checked(data, lambda picture: as_reduced_array(picture, side))


def as_reduced_array(picture: Image.Image, side: int = MAX_IMAGE_SIDE_PX) -> UInt8[np.ndarray, "H W C"]:
    """Return an opened picture as ``decode_image`` returns its bytes.

    Raises:
        ValueError: It claims to be absurdly large.
    """
    if picture.width * picture.height > MAX_IMAGE_PIXELS:
        size = f"{picture.width} × {picture.height}"
        raise ValueError(f"the picture claims {size} pixels, too many to unpack")
    return np.array(as_eight_bit_image(_halve_until_fits(picture, side)), np.uint8)


def decode_grey_numbers(data: bytes) -> UInt16[np.ndarray, "H W"]:
    """Return the numbers of a grey PNG of 8 or 16 bits.

    Raises:
        ValueError: The bytes are no such picture, or it is broken or absurdly large.
    """
    return _decode_checked(data, _numbers)


def decode_instances(data: bytes) -> Int32[np.ndarray, "H W"]:
    """Return which instance each pixel of a PNG or WebP picture shows: a number per grey or colour.

    Black, and the first colour of a palette, is 0.

    Raises:
        ValueError: The bytes are no such picture, or it is broken or absurdly large.
    """
    return _decode_checked(data, _instances)


def _decode_checked(data: bytes, take: Callable[[ImageFile.ImageFile], np.ndarray]) -> np.ndarray:
    if not data:
        raise ValueError("the picture is empty (0 bytes)")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _opened(data, take)
    except Image.DecompressionBombError:
        raise ValueError("the picture claims more pixels than any texture has") from None
    except MemoryError:
        raise ValueError("the picture does not fit into memory") from None
    except ValueError:
        raise
    except UnidentifiedImageError:
        raise ValueError("the picture is no PNG, JPEG or WebP") from None
    except Exception as problem:  # Pillow's decoders raise almost anything on broken input
        raise ValueError(f"the picture is broken ({str(problem)[:80]})") from None


def _opened(data: bytes, take: Callable[[ImageFile.ImageFile], np.ndarray]) -> np.ndarray:
    with Image.open(io.BytesIO(data), formats=IMAGE_FORMATS) as picture:
        if picture.width * picture.height > MAX_IMAGE_PIXELS:
            size = f"{picture.width} × {picture.height}"
            raise ValueError(f"the picture claims {size} pixels, too many to unpack")
        picture.load()
        return take(picture)


def _numbers(picture: ImageFile.ImageFile) -> np.ndarray:
    if picture.mode != "L" and not picture.mode.startswith("I"):
        raise ValueError(f"the picture holds colours ({picture.mode}), not grey numbers")
    return np.asarray(picture).astype(np.uint16)


def _instances(picture: ImageFile.ImageFile) -> np.ndarray:
    if picture.format == "JPEG":
        raise ValueError("the picture is a JPEG, which blurs numbers")
    if picture.mode in ("L", "P", "1") or picture.mode.startswith("I"):
        return np.asarray(picture).astype(np.int32)
    red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB"), np.int32), -1, 0)
    return (red << 16) | (green << 8) | blue


def _halve_until_fits(picture: Image.Image, side: int) -> Image.Image:
    factor = 1
    while max(picture.size) > factor * side:
        factor *= 2
    return picture if factor == 1 else picture.reduce(factor)


def as_eight_bit_image(picture: Image.Image) -> Image.Image:
    """Return a picture of any kind as one of 8 bits: RGB, or RGBA where it has transparency."""
    if picture.mode.startswith("I"):  # 16 bits a pixel: Pillow would clip instead of scaling
        return Image.fromarray((np.asarray(picture) >> 8).astype(np.uint8)).convert("RGB")
    alpha = "A" in picture.mode or "transparency" in picture.info
    return picture.convert("RGBA" if alpha else "RGB")
