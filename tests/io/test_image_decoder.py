import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from corporeal.io.image_decoder import decode_image


def png(picture):
    data = io.BytesIO()
    picture.save(data, "PNG")
    return data.getvalue()


def bomb(width, height):
    """A PNG that claims a size and holds next to nothing."""

    def chunk(kind, data):
        crc = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + crc

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(b"\0" * 1000)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize(("mode", "channels"), [("RGB", 3), ("RGBA", 4), ("L", 3), ("LA", 4), ("P", 3), ("1", 3)])
def test_every_kind_of_picture_ends_as_eight_bit_rgb(mode, channels):
    start = Image.new("RGBA", (3, 2), (255, 255, 255, 128))
    picture = (start.convert("RGB") if mode == "P" else start).convert(mode)
    array = decode_image(png(picture))
    assert array.shape == (2, 3, channels) and array.dtype == np.uint8
    assert (array[..., :3] == 255).all()


def test_sixteen_bits_are_scaled_not_clipped():
    picture = Image.fromarray(np.full((2, 2), 0x8000, np.uint16))
    assert (decode_image(png(picture)) == 0x80).all()


def test_a_huge_picture_is_halved():
    array = decode_image(png(Image.new("L", (5000, 10))))
    assert array.shape == (5, 2500, 3)


@pytest.mark.parametrize("size", [(60000, 60000), (2**31 - 1, 2**31 - 1), (20000, 7000)])
def test_a_decompression_bomb_is_refused_unopened(size):
    with pytest.raises(ValueError, match="pixels"):
        decode_image(bomb(*size))


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a\x01\0\x01\0", b"%PDF-1.4", bomb(100, 100), png(Image.new("L", (9, 9)))[:40]]
)
def test_what_is_no_whole_picture_is_refused(data):
    with pytest.raises(ValueError, match="picture") as told:
        decode_image(data)
    assert "object at" not in str(told.value)
