"""Every kind of splat says the same of the same Gaussians, and a bad file says what is wrong."""

import gzip
import io
import json
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.geometry.gaussian_transforms import rotation_to_z_up, transform_gaussians
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT, sh_basis
from corporeal.io.splat.load_splat import load_splat
from corporeal.io.splat.sog import read_sog_zip
from corporeal.io.splat.splat_ply import write_splat_ply

STEP = 2 * 0.5 / 511 * 0.5**0.5 * 12**0.5
"""Worst error of a rotation whose three smaller components have a sign and 9 bits [rad]: the
largest one, at 1/2, errs as much as the others together."""


def some_gaussians(count=300, degree=3, seed=0):
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=(count, 4))
    return Gaussians(
        mean=rng.normal(size=(count, 3)).astype(np.float32),
        rotation=(turn / np.linalg.norm(turn, axis=1)[:, None]).astype(np.float32),
        scale=np.exp(rng.uniform(-6, 0, (count, 3))).astype(np.float32),
        opacity=rng.uniform(0.01, 0.99, count).astype(np.float32),
        sh=rng.uniform(-0.9, 0.9, (count, (degree + 1) ** 2, 3)).astype(np.float32),
    )


def same_rotation(a, b):
    """Greatest angle between rotations [rad]; q and -q are one."""
    dot = np.abs((a.astype(float) * b.astype(float)).sum(axis=1))
    return 2 * np.arccos(np.minimum(dot, 1)).max()


def columns_of(g):
    """What INRIA's layout calls its properties, and their numbers."""
    rest = g.sh[:, 1:].swapaxes(1, 2).reshape(g.count, -1)
    names = [*"xyz", *(f"f_dc_{k}" for k in range(3)), *(f"f_rest_{k}" for k in range(rest.shape[1]))]
    names += ["opacity", *(f"scale_{k}" for k in range(3)), *(f"rot_{k}" for k in range(4))]
    logit = np.log(g.opacity / (1 - g.opacity))[:, None]
    table = np.concatenate([g.mean, g.sh[:, 0], rest, logit, np.log(g.scale), g.rotation], axis=1)
    return names, table


def ply(names, table, form="binary_little_endian", kind="float"):
    lines = ["ply", f"format {form} 1.0", "comment x", f"element vertex {len(table)}"]
    lines += [f"property {kind} {n}" for n in names] + ["end_header", ""]
    if form == "ascii":
        body = "\n".join(" ".join(repr(float(x)) for x in row) for row in table).encode()
    else:
        order = "<" if "little" in form else ">"
        body = table.astype(order + {"float": "f4", "double": "f8"}[kind]).tobytes()
    return "\n".join(lines).encode() + body


@pytest.fixture
def kept(tmp_path):
    def keep(data, name="a.ply"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return keep


# ---------------------------------------------------------------- PLY


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_what_is_written_is_read_again_to_single_precision(tmp_path, degree):
    given = some_gaussians(degree=degree)
    read = load_splat(write_splat_ply(tmp_path / "a" / "b.ply", given))
    np.testing.assert_array_equal(read.mean, given.mean)
    np.testing.assert_array_equal(read.sh, given.sh)
    np.testing.assert_allclose(read.rotation, given.rotation, atol=1e-7)
    np.testing.assert_allclose(read.scale, given.scale, rtol=6e-7)
    np.testing.assert_allclose(read.opacity, given.opacity, atol=1.2e-7)
    assert read.warnings == ()


def test_reading_and_writing_again_changes_no_number(tmp_path):
    first = write_splat_ply(tmp_path / "1.ply", some_gaussians())
    again = load_splat(write_splat_ply(tmp_path / "2.ply", load_splat(first)))
    third = load_splat(write_splat_ply(tmp_path / "3.ply", again))
    for name in ("mean", "rotation", "scale", "opacity", "sh"):
        np.testing.assert_allclose(getattr(third, name), getattr(again, name), rtol=6e-7)


def test_the_written_file_is_laid_out_as_viewers_expect(tmp_path):
    given = some_gaussians(count=2)
    data = write_splat_ply(tmp_path / "a.ply", given).read_bytes()
    head, body = data.split(b"end_header\n", 1)
    names = [line.split()[-1] for line in head.decode().splitlines() if line.startswith("property")]
    assert len(names) == 62
    assert names[:9] == ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    assert names[54:] == ["opacity", *(f"scale_{k}" for k in range(3)), *(f"rot_{k}" for k in range(4))]
    table = dict(zip(names, np.frombuffer(body, "<f4").reshape(2, 62).T, strict=True))
    np.testing.assert_array_equal(table["f_rest_15"], given.sh[:, 1, 1])  # green begins at 15
    np.testing.assert_allclose(table["scale_2"], np.log(given.scale[:, 2]), rtol=1e-6)


def test_another_program_reads_what_is_written(tmp_path):
    given = some_gaussians(count=7, degree=2)
    found = trimesh.load(write_splat_ply(tmp_path / "a.ply", given), process=False)
    np.testing.assert_array_equal(found.vertices, given.mean)
    rows = found.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(rows["f_dc_2"].ravel(), given.sh[:, 0, 2])
    np.testing.assert_array_equal(rows["f_rest_7"].ravel(), given.sh[:, 8, 0])
    np.testing.assert_array_equal(rows["f_rest_8"].ravel(), given.sh[:, 1, 1])
    np.testing.assert_array_equal(rows["rot_0"].ravel(), given.rotation[:, 0])


@pytest.mark.parametrize("form", ["binary_little_endian", "binary_big_endian", "ascii"])
@pytest.mark.parametrize("kind", ["float", "double"])
def test_any_form_of_ply_says_the_same(kept, form, kind):
    given = some_gaussians(count=20, degree=1)
    read = load_splat(kept(ply(*columns_of(given), form, kind)))
    np.testing.assert_array_equal(read.mean, given.mean)
    np.testing.assert_array_equal(read.sh, given.sh)
    np.testing.assert_allclose(read.scale, given.scale, rtol=1e-6)


def test_rotations_of_any_length_and_unknown_properties_are_read(kept):
    given = some_gaussians(count=20, degree=0)
    names, table = columns_of(given)
    table[:, -4:] *= 7
    read = load_splat(kept(ply([*names, "semantics"], np.c_[table, np.ones(20)])))
    np.testing.assert_allclose(read.rotation, given.rotation, atol=2e-7)


def test_windows_line_ends_are_read(kept):
    head, body = ply(*columns_of(some_gaussians(20))).split(b"end_header\n", 1)
    assert load_splat(kept(head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body)).count == 20


def test_an_infinite_logit_is_a_certain_opacity(kept):
    names, table = columns_of(some_gaussians(count=3, degree=0))
    table[:, names.index("opacity")] = [np.inf, -np.inf, 0]
    np.testing.assert_array_equal(load_splat(kept(ply(names, table))).opacity, [1, 0, 0.5])


# ---------------------------------------------------------------- packed kinds


def packed_ply(g, colours=True):
    """Pack as PlayCanvas documents it: chunks of 256."""
    lines, rows = [], []
    log = np.log(g.scale)
    tint = g.sh[:, 0] * SH_DC_COEFFICIENT + 0.5
    chunks = [slice(k, k + 256) for k in range(0, g.count, 256)]
    bounds = [
        np.concatenate(
            [f(v[c], axis=0) for v in ((g.mean, log, tint) if colours else (g.mean, log)) for f in (np.min, np.max)]
        )
        for c in chunks
    ]
    names = [
        f"{e}_{w}{a}" for w, axes in (("", "xyz"), ("scale_", "xyz"), ("", "rgb")) for e in ("min", "max") for a in axes
    ]
    names = names if colours else names[:12]
    for k, c in enumerate(chunks):
        low = bounds[k].reshape(-1, 2, 3)[:, 0]
        span = bounds[k].reshape(-1, 2, 3)[:, 1] - low
        place = np.round((g.mean[c] - low[0]) / span[0] * [2047, 1023, 2047]).astype(np.uint64)
        size = np.round((log[c] - low[1]) / span[1] * [2047, 1023, 2047]).astype(np.uint64)
        shade = (tint[c] - low[2]) / span[2] if colours else tint[c]
        shade = np.round(np.clip(np.c_[shade, g.opacity[c]], 0, 1) * 255).astype(np.uint64)
        q = g.rotation[c].astype(float)
        largest = np.abs(q).argmax(axis=1)
        q = q * np.sign(q[np.arange(len(q)), largest])[:, None]
        others = np.array([np.delete(row, i) for row, i in zip(q, largest, strict=True)])
        turn = np.round((others / np.sqrt(2) + 0.5) * 1023).astype(np.uint64)
        rows.append(
            np.stack(
                [
                    place[:, 0] << 21 | place[:, 1] << 11 | place[:, 2],
                    largest.astype(np.uint64) << 30 | turn[:, 0] << 20 | turn[:, 1] << 10 | turn[:, 2],
                    size[:, 0] << 21 | size[:, 1] << 11 | size[:, 2],
                    shade[:, 0] << 24 | shade[:, 1] << 16 | shade[:, 2] << 8 | shade[:, 3],
                ],
                axis=1,
            )
        )
    rest = g.sh[:, 1:].swapaxes(1, 2).reshape(g.count, -1)
    lines = ["ply", "format binary_little_endian 1.0", f"element chunk {len(chunks)}"]
    lines += [f"property float {n}" for n in names] + [f"element vertex {g.count}"]
    lines += [f"property uint packed_{n}" for n in ("position", "rotation", "scale", "color")]
    if rest.shape[1]:
        lines += [f"element sh {g.count}"] + [f"property uchar f_rest_{k}" for k in range(rest.shape[1])]
    body = np.array(bounds, "<f4").tobytes() + np.concatenate(rows).astype("<u4").tobytes()
    body += np.clip((rest / 8 + 0.5) * 256, 0, 255).astype(np.uint8).tobytes()
    return "\n".join([*lines, "end_header", ""]).encode() + body


@pytest.mark.parametrize("colours", [True, False])
def test_compressed_ply_says_the_same_to_its_steps(kept, colours):
    given = some_gaussians(count=600, degree=2)
    read = load_splat(kept(packed_ply(given, colours)))
    span = np.ptp(given.mean, axis=0).max()
    np.testing.assert_allclose(read.mean, given.mean, atol=span / 1023 / 2 + 1e-6)
    np.testing.assert_allclose(np.log(read.scale), np.log(given.scale), atol=6 / 1023 / 2 + 1e-5)
    np.testing.assert_allclose(read.opacity, given.opacity, atol=0.5 / 255 + 1e-6)
    inside = np.abs(given.sh[:, 0] * SH_DC_COEFFICIENT) <= 0.5
    np.testing.assert_allclose(read.sh[:, 0][inside], given.sh[:, 0][inside], atol=0.5 / 255 / SH_DC_COEFFICIENT)
    np.testing.assert_allclose(read.sh[:, 1:], given.sh[:, 1:], atol=8 / 256 / 2 + 1e-6)
    assert same_rotation(read.rotation, given.rotation) < STEP


def spz_attributes(g, version):
    fixed = np.round(g.mean * 4096).astype(np.int32) & 0xFFFFFF
    place = np.stack([fixed & 255, fixed >> 8 & 255, fixed >> 16], axis=-1).astype(np.uint8)
    q = g.rotation[:, [1, 2, 3, 0]].astype(float)
    if version == 2:
        turn = np.round(q * np.where(q[:, 3:] < 0, -127.5, 127.5) + 127.5)[:, :3].astype(np.uint8)
    else:
        largest = np.abs(q).argmax(axis=1)
        q *= np.sign(q[np.arange(len(q)), largest])[:, None]
        others = np.array([np.delete(row, i) for row, i in zip(q, largest, strict=True)])
        part = np.round(np.abs(others) * np.sqrt(2) * 511).astype(np.uint32) | (others < 0) << 9
        turn = largest.astype(np.uint32) << 30 | part[:, 0] << 20 | part[:, 1] << 10 | part[:, 2]
        turn = turn.astype("<u4")
    return [
        place,
        np.round(g.opacity * 255).astype(np.uint8),
        np.clip(np.round(g.sh[:, 0] * 0.15 * 255 + 127.5), 0, 255).astype(np.uint8),
        np.clip(np.round((np.log(g.scale) + 10) * 16), 0, 255).astype(np.uint8),
        turn,
        np.clip(np.round(g.sh[:, 1:] * 128 + 128), 0, 255).astype(np.uint8),
    ]


def spz(g, version, degree, flags=0):
    head = struct.pack("<4sIIBBBB", b"NGSP", version, g.count, degree, 12, flags, 0)
    attributes = [a.tobytes() for a in spz_attributes(g, version)]
    if version < 4:
        return gzip.compress(head + b"".join(attributes))
    zstandard = pytest.importorskip("zstandard")
    attributes = [a for a in attributes if a]
    streams = [zstandard.ZstdCompressor().compress(a) for a in attributes]
    head = head[:15] + bytes([len(streams)]) + struct.pack("<I12x", 32)
    table = b"".join(struct.pack("<QQ", len(s), len(a)) for s, a in zip(streams, attributes, strict=True))
    return head + table + b"".join(streams)


@pytest.mark.parametrize("version", [2, 3, 4])
@pytest.mark.parametrize("degree", [0, 3])
def test_spz_says_the_same_to_its_steps(kept, version, degree):
    given = some_gaussians(degree=degree)
    read = load_splat(kept(spz(given, version, degree), "a.spz"))
    np.testing.assert_allclose(read.mean, given.mean, atol=0.5 / 4096 + 1e-6)
    np.testing.assert_allclose(np.log(read.scale), np.log(given.scale), atol=0.5 / 16 + 1e-5)
    np.testing.assert_allclose(read.opacity, given.opacity, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(read.sh[:, 0], given.sh[:, 0], atol=0.5 / 255 / 0.15 + 1e-6)
    np.testing.assert_allclose(read.sh[:, 1:], given.sh[:, 1:], atol=0.5 / 128 + 1e-6)
    assert same_rotation(read.rotation, given.rotation) < (0.2 if version == 2 else STEP)


def test_harmonics_of_degree_4_lose_their_last_band_and_it_is_reported(kept):
    given = some_gaussians(count=5, degree=4)
    read = load_splat(kept(spz(given, 3, 4), "a.spz"))
    assert read.sh.shape == (5, 16, 3)
    np.testing.assert_allclose(read.sh[:, 1:], given.sh[:, 1:16], atol=0.5 / 128 + 1e-6)
    assert "degree 4" in read.warnings[0]


def sog(g, degree, **changes):
    """Write as PlayCanvas documents it; harmonics have one palette entry per Gaussian."""
    side = int(np.ceil(np.sqrt(g.count)))

    def picture(values, width=side):
        pixels = np.zeros((-(-len(values) // width) * width, 4), np.uint8)
        pixels[:, 3] = 255
        pixels[: len(values), : values.shape[1]] = values
        out = io.BytesIO()
        Image.fromarray(pixels.reshape(-1, width, 4)).save(out, "WEBP", lossless=True, exact=True)
        return out.getvalue()

    def book(values):
        steps = np.linspace(values.min(), values.max(), 256)
        return steps.tolist(), np.abs(values[..., None] - steps).argmin(axis=-1)

    logarithm = np.sign(g.mean) * np.log1p(np.abs(g.mean))
    low, high = logarithm.min(axis=0), logarithm.max(axis=0)
    place = np.round((logarithm - low) / (high - low) * 65535).astype(int)
    sizes, size = book(np.log(g.scale))
    tints, tint = book(g.sh[:, 0])
    q = g.rotation.astype(float)
    largest = np.abs(q).argmax(axis=1)
    q *= np.sign(q[np.arange(len(q)), largest])[:, None]
    others = np.array([np.delete(row, i) for row, i in zip(q, largest, strict=True)])
    turn = np.c_[np.round((others * np.sqrt(2) + 1) * 127.5), largest + 252]
    files = {
        "means_l.webp": picture(place & 255),
        "means_u.webp": picture(place >> 8),
        "scales.webp": picture(size),
        "quats.webp": picture(turn),
        "sh0.webp": picture(np.c_[tint, np.round(g.opacity * 255)]),
    }
    meta = {
        "version": 2,
        "count": g.count,
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": ["means_l.webp", "means_u.webp"]},
        "scales": {"codebook": sizes, "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": tints, "files": ["sh0.webp"]},
    }
    if degree:
        shades, shade = book(g.sh[:, 1:])
        entries = np.zeros((-(-g.count // 64) * 64, *shade.shape[1:]), int)
        entries[: g.count] = shade
        label = np.arange(g.count)
        files["shN_centroids.webp"] = picture(entries.reshape(-1, 3), 64 * shade.shape[1])
        files["shN_labels.webp"] = picture(np.c_[label & 255, label >> 8])
        meta["shN"] = {
            "count": g.count,
            "bands": degree,
            "codebook": shades,
            "files": ["shN_centroids.webp", "shN_labels.webp"],
        }
    return {"meta.json": json.dumps(meta | changes).encode(), **files}


def zipped(files):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("form", ["zip", "folder", "meta.json"])
def test_sog_says_the_same_to_its_steps(tmp_path, kept, degree, form):
    given = some_gaussians(count=400, degree=degree)
    files = sog(given, degree)
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    path = {"zip": kept(zipped(files), "a.sog"), "folder": tmp_path, "meta.json": tmp_path / "meta.json"}
    read = load_splat(path[form])
    np.testing.assert_allclose(read.mean, given.mean, atol=4e-4)
    np.testing.assert_allclose(np.log(read.scale), np.log(given.scale), atol=6 / 255 / 2 + 1e-5)
    np.testing.assert_allclose(read.opacity, given.opacity, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(read.sh, given.sh, atol=1.8 / 255 / 2 + 1e-6)
    assert same_rotation(read.rotation, given.rotation) < 0.02


def test_splat_records_say_the_same_to_their_steps(kept):
    given = some_gaussians(degree=0)
    rgba = np.clip(np.round(np.c_[given.sh[:, 0] * SH_DC_COEFFICIENT + 0.5, given.opacity] * 255), 0, 255)
    turn = np.clip(np.round((given.rotation + 1) * 127.5), 0, 255)
    rows = [
        m.tobytes() + s.tobytes() + bytes(c) + bytes(q)
        for m, s, c, q in zip(
            given.mean.astype("<f4"),
            given.scale.astype("<f4"),
            rgba.astype(np.uint8),
            turn.astype(np.uint8),
            strict=True,
        )
    ]
    read = load_splat(kept(b"".join(rows), "a.splat"))
    np.testing.assert_array_equal(read.mean, given.mean)
    np.testing.assert_array_equal(read.scale, given.scale)
    np.testing.assert_allclose(read.sh, given.sh, atol=0.5 / 255 / SH_DC_COEFFICIENT + 1e-6)
    np.testing.assert_allclose(read.opacity, given.opacity, atol=0.5 / 255 + 1e-6)
    assert same_rotation(read.rotation, given.rotation) < 0.02


def ksplat(g, level, degree):
    """Write one section: a full bucket of 256 and one of the rest, each about its own middle."""
    number, place, rest = [("<f4", "<f4", "<f4"), ("<f2", "<u2", "<f2"), ("<f2", "<u2", "u1")][level]
    block, half = 20.0, 32767
    middles = np.array([[0.5, 0, 0], [0, -0.25, 0]], "<f4")
    owner = (np.arange(g.count) >= 256).astype(int)
    mean = g.mean if level == 0 else np.round((g.mean - middles[owner]) / (block / 2 / half) + half)
    order = [g.sh[:, a:b].swapaxes(1, 2).reshape(g.count, -1) for a, b in ((1, 4), (4, 9))][:degree]
    harmonics = np.concatenate([np.zeros((g.count, 0)), *order], axis=1)
    if level == 2:
        harmonics = np.round((harmonics + 1.5) / 3 * 255)
    kind = np.dtype(
        [("m", place, 3), ("s", number, 3), ("q", number, 4), ("c", "u1", 4), ("h", rest, harmonics.shape[1])]
    )
    rows = np.zeros(g.count, kind)
    rows["m"], rows["s"], rows["q"], rows["h"] = mean, g.scale, g.rotation, harmonics
    rows["c"] = np.clip(np.round(np.c_[g.sh[:, 0] * SH_DC_COEFFICIENT + 0.5, g.opacity] * 255), 0, 255)
    head = bytearray(4096 + 1024)
    head[1] = 1
    struct.pack_into("<II", head, 4, 1, 1)
    struct.pack_into("<IH", head, 16, g.count, level)
    struct.pack_into("<ff", head, 36, -1.5, 1.5)
    struct.pack_into("<IIIIfHxxIxxxxIIH", head, 4096, g.count, g.count, 256, 2, block, 12, half, 1, 1, degree)
    return bytes(head) + struct.pack("<I", g.count - 256) + middles.tobytes() + rows.tobytes()


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_ksplat_says_the_same_to_its_steps(kept, level, degree):
    given = some_gaussians(degree=degree)
    read = load_splat(kept(ksplat(given, level, degree), "a.ksplat"))
    np.testing.assert_allclose(read.mean, given.mean, atol=[1e-9, 2e-4, 2e-4][level])
    np.testing.assert_allclose(read.scale, given.scale, rtol=[1e-9, 5e-4, 5e-4][level], atol=1e-9)
    np.testing.assert_allclose(read.sh[:, 1:], given.sh[:, 1:], atol=[1e-9, 5e-4, 6e-3][level])
    np.testing.assert_allclose(read.sh[:, 0], given.sh[:, 0], atol=0.5 / 255 / SH_DC_COEFFICIENT + 1e-6)
    assert same_rotation(read.rotation, given.rotation) < [2e-3, 3e-3, 3e-3][level]


@pytest.mark.parametrize(
    "make",
    [
        lambda: spz(some_gaussians(9), 3, 3),
        lambda: zipped(sog(some_gaussians(9), 3)),
        lambda: ksplat(some_gaussians(300), 1, 0),
        lambda: packed_ply(some_gaussians(9)),
    ],
)
def test_the_content_counts_and_not_the_name(kept, make):
    assert load_splat(kept(make(), "photo.jpg")).count in (9, 300)


# ---------------------------------------------------------------- frames


def test_turning_a_file_upright_turns_shape_and_colour_with_it(tmp_path):
    given = some_gaussians(count=40)
    path = write_splat_ply(tmp_path / "a.ply", given)
    for up, axis in (("-y", [0, -1, 0]), ("+y", [0, 1, 0]), ("+x", [1, 0, 0]), ("-z", [0, 0, -1])):
        R, turned = rotation_to_z_up(up), load_splat(path, up)
        np.testing.assert_allclose(R @ axis, [0, 0, 1], atol=1e-15)
        assert np.linalg.det(R) == pytest.approx(1)
        np.testing.assert_allclose(turned.mean, given.mean @ R.T, atol=1e-6)
        for k in range(5):
            there = R @ matrix_from_quaternion(given.rotation[k])
            np.testing.assert_allclose(matrix_from_quaternion(turned.rotation[k]), there, atol=1e-6)
        rays = np.random.default_rng(1).normal(size=(9, 3))
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        seen = np.einsum("rk,nkc->rnc", sh_basis(rays, 3), given.sh)
        again = np.einsum("rk,nkc->rnc", sh_basis(rays @ R.T, 3), turned.sh)
        np.testing.assert_allclose(again, seen, atol=1e-5)


def test_harmonics_are_orthonormal_and_turn_by_any_rotation():
    z, w = np.polynomial.legendre.leggauss(8)
    turn = np.arange(16) * np.pi / 8
    z, turn, w = (a.ravel() for a in np.broadcast_arrays(z[:, None], turn, w[:, None]))
    flat = np.sqrt(1 - z * z)
    rays = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    Y = sh_basis(rays, 3)
    np.testing.assert_allclose((Y * w[:, None] * np.pi / 8).T @ Y, np.eye(16), atol=1e-12)
    R = matrix_from_quaternion(np.array([0.3, -0.5, 0.7, 0.2]))
    one = some_gaussians(3)
    moved = transform_gaussians(one, R, scale=2.0, shift=(1.0, 2.0, 3.0))
    np.testing.assert_allclose(moved.mean, 2 * one.mean @ R.T + [1, 2, 3], rtol=1e-5)
    np.testing.assert_allclose(moved.scale, 2 * one.scale)
    np.testing.assert_allclose(
        np.einsum("rk,nkc->rnc", sh_basis(rays @ R.T, 3), moved.sh), np.einsum("rk,nkc->rnc", Y, one.sh), atol=1e-5
    )


# ---------------------------------------------------------------- bad files


def test_bad_gaussians_are_left_out_and_counted(kept):
    names, table = columns_of(some_gaussians(1000, degree=0))
    table[:5, 0] = np.nan
    table[5:8, names.index("scale_1")] = 1e4  # exp overflows
    table[8:10, -4:] = 0
    table[10, names.index("scale_0")] = np.log(2e6)
    read = load_splat(kept(ply(names, table)))
    assert read.count == 989
    assert np.isfinite(read.mean).all() and np.isfinite(read.scale).all()
    (words,) = read.warnings
    assert "11 of 1,000" in words and "8 hold NaN" in words and "2 have a rotation" in words


def test_a_million_points_that_are_mostly_nan_are_refused_at_once(kept):
    names, table = columns_of(some_gaussians(1, degree=0))
    many = np.repeat(table.astype(np.float32), 1_000_000, axis=0)
    many[: len(many) // 2 + 1, 0] = np.nan
    with pytest.raises(BadFileError, match=r"500,001 of 1,000,000 .* NaN.*Train or export"):
        load_splat(kept(ply(names, many)))


def test_of_a_million_points_with_some_nan_the_rest_is_kept(kept):
    names, table = columns_of(some_gaussians(1, degree=0))
    many = np.repeat(table.astype(np.float32), 1_000_000, axis=0)
    many[::100, 0] = np.nan
    read = load_splat(kept(ply(names, many)))
    assert read.count == 990_000
    assert "10,000 of 1,000,000" in read.warnings[0] and "NaN" in read.warnings[0]


GOOD = ply(*columns_of(some_gaussians(50, degree=1)))
BAD = {
    "truncated ply": (GOOD[:-10], r"49 of the 50 rows"),
    "lying count": (GOOD.replace(b"vertex 50", b"vertex 99999999999"), r"50 of the 99,999,999,999"),
    "negative count": (GOOD.replace(b"vertex 50", b"vertex -5"), r"header is bad"),
    "no end of header": (GOOD.replace(b"end_header", b"end_hea"), r"no complete PLY header"),
    "unknown type": (GOOD.replace(b"float x", b"quad x"), r"header is bad: 'property quad x'"),
    "twice the same": (GOOD.replace(b"float y", b"float x"), r"header is bad"),
    "unknown form": (GOOD.replace(b"little", b"middle"), r"no known format"),
    "no scales": (GOOD.replace(b"scale_1", b"scala_1"), r"lack scale_1"),
    "odd harmonics": (GOOD.replace(b"f_rest_3", b"f_best_3"), r"8 properties f_rest"),
    "points": (ply(["x", "y", "z", "red"], np.zeros((4, 4))), r"cloud of points.*lack f_dc_0"),
    "nothing": (
        GOOD.split(b"end_header\n")[0].replace(b"vertex 50", b"vertex 0") + b"end_header\n",
        r"holds no Gaussians",
    ),
    "short ascii": (ply(*columns_of(some_gaussians(9, 0)), "ascii").replace(b"vertex 9", b"vertex 10"), r"9 of the 10"),
    "words in ascii": (ply(*columns_of(some_gaussians(9, 0)), "ascii")[:-9] + b" hello", r"rows of 'vertex'"),
    "long ascii": (
        ply(*columns_of(some_gaussians(9, 0)), "ascii").replace(b"vertex 9", b"vertex 999999999999"),
        r"fewer of the",
    ),
    "empty": (b"", r"empty"),
    "noise": (bytes(range(256)) * 9, r"no Gaussian splat.*SPZ"),
    "a picture": (b"\x89PNG\r\n\x1a\n" + bytes(300), r"no Gaussian splat"),
    "gzip of something": (gzip.compress(b"hello" * 100), r"no SPZ"),
    "broken gzip": (spz(some_gaussians(50), 3, 3)[:40] + bytes(99), r"gzip stream is broken|no SPZ|ends"),
    "cut spz": (spz(some_gaussians(50), 3, 3)[:-400], r"ends [\d,]+ bytes before"),
    "spz of version 9": (gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 9, 4, 0, 12, 0, 0)), r"version 9"),
    "spz of the released past": (gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 1, 4, 0, 12, 0, 0)), r"version 1"),
    "spz of billions": (
        gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 3, 2**31, 0, 12, 0, 0) + bytes(10**6)),
        r"claims 2,147,483,648",
    ),
    "spz with early extensions": (
        gzip.compress(struct.pack("<4sIIBBBBI", b"NGSP", 3, 1, 0, 12, 2, 0, 0xADBE0002) + bytes(99)),
        r"extensions before",
    ),
    "cut zip": (zipped(sog(some_gaussians(50), 3))[:-60], r"ZIP is broken"),
    "zip of something": (zipped({"a.txt": b"a"}), r"meta.json: it is not in the archive"),
    "sog of version 3": (zipped(sog(some_gaussians(50), 0, version=3)), r"SOG version 3"),
    "sog with a lying count": (zipped(sog(some_gaussians(50), 0, count=10**12)), r"of 1,000,000,000,000"),
    "sog without a picture": (
        zipped({k: v for k, v in sog(some_gaussians(50), 0).items() if k != "quats.webp"}),
        r"quats.webp: it is not",
    ),
    "sog with words": (
        zipped(sog(some_gaussians(50), 0, scales={"codebook": ["a"], "files": ["scales.webp"]})),
        r"no list 'codebook'",
    ),
    "some json": (b'{"asset": {}}', r"meta.json: 'meta.json' is not there|describes no"),
    "cut ksplat": (ksplat(some_gaussians(300), 1, 0)[:-100], r"runs past the end"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_in_one_sentence(kept, case):
    data, words = BAD[case]
    with pytest.raises(BadFileError, match=words):
        load_splat(kept(data))


def test_no_byte_of_a_file_can_make_the_reader_crash(kept):
    rng = np.random.default_rng(0)
    files = [
        GOOD,
        packed_ply(some_gaussians(300)),
        spz(some_gaussians(30), 3, 3),
        ksplat(some_gaussians(300), 2, 1),
        zipped(sog(some_gaussians(30), 1)),
    ]
    refused = 0
    for data in files:
        for _ in range(25):
            broken = bytearray(data)
            for at in rng.integers(0, min(len(data), 6000), 4):
                broken[at] = rng.integers(256)
            try:
                load_splat(kept(bytes(broken)))
            except BadFileError:
                refused += 1
    assert refused > 25


def test_a_folder_and_a_missing_file_are_refused(tmp_path):
    with pytest.raises(BadFileError, match=r"folder without the meta.json.*SPZ"):
        load_splat(tmp_path)
    with pytest.raises(BadFileError, match="no such file"):
        load_splat(tmp_path / "a.ply")


def test_what_is_packed_with_zstandard_says_what_to_install(kept, monkeypatch):
    path = kept(spz(some_gaussians(9), 4, 3), "a.spz")
    monkeypatch.setitem(sys.modules, "zstandard", None)
    with pytest.raises(BadFileError, match=r"Zstandard .SPZ version 4.*pip install"):
        load_splat(path)


def test_a_broken_stream_of_version_4_is_refused(kept):
    good = spz(some_gaussians(50), 4, 3)
    for at, words in ((15, "table of streams"), (40, "not as long as"), (140, "stream is broken|ends")):
        broken = bytearray(good)
        broken[at] ^= 0x5A
        with pytest.raises(BadFileError, match=words):
            load_splat(kept(bytes(broken)))
    with pytest.raises(BadFileError, match="not as long as its table says"):
        load_splat(kept(good[:-9]))
    # Extensions stand before the table: unknown ones are skipped, those that matter are refused.
    for kind, refused in ((0xADBE0002, False), (0xADBE0001, True)):
        record = struct.pack("<III", kind, 4, 0)
        longer = good[:14] + b"\2" + good[15:16] + struct.pack("<I12x", 32 + len(record))
        path = kept(longer + record + good[32:])
        if refused:
            with pytest.raises(BadFileError, match="bounds of their own"):
                load_splat(path)
        else:
            assert load_splat(path).count == 50


def test_a_bomb_is_not_unpacked(kept):
    head = struct.pack("<4sIIBBBB", b"NGSP", 3, 10, 0, 12, 0, 0)
    bomb = gzip.compress(head + bytes(10 * 20) + bytes(2**24), 9)
    assert load_splat(kept(bomb, "bomb.spz")).count == 10
    big = zipped({"meta.json": bytes(2**17)})
    with pytest.raises(BadFileError, match="too large"):
        read_sog_zip(Path("bomb.sog"), memoryview(big), max_file_bytes=2**16)


# ---------------------------------------------------------------- files of other programs


def test_splats_of_other_programs_are_read(shared_assets):
    folder = shared_assets / "splats"
    dog = load_splat(folder / "vomp_dog_3dgs_sh3.ply")
    assert (dog.count, dog.sh.shape[1], dog.warnings) == (9983, 16, ())
    guitar = load_splat(folder / "guitar.compressed.ply")
    assert (guitar.count, guitar.sh.shape[1]) == (90854, 1)
    # A guitar is some three times as long as it is wide, and flat.
    good = guitar.mean[guitar.opacity > 0.5]
    low, high = np.percentile(good, [1, 99], axis=0)
    assert 2 < np.ptp([low, high], axis=0)[1] / np.ptp([low, high], axis=0)[0] < 4
    upright = load_splat(folder / "guitar.compressed.ply", "-y").mean
    assert np.percentile(upright[:, 2], 1) > -0.2  # its stand is on the floor, its neck is up
    assert np.percentile(upright[:, 2], 99) > 3.5
    with pytest.raises(BadFileError, match="cloud of points"):
        load_splat(folder / "brush_test_init.ply")


@pytest.mark.parametrize("name", ["raw.spz", "v2.spz", "v3.spz", "v4.spz", "ksplat", "splat"])
def test_fixtures_of_other_programs_hold_what_they_were_made_of(shared_assets, name):
    if name == "v4.spz":
        pytest.importorskip("zstandard")
    dot = "." if "." not in name else "-"
    read = load_splat(shared_assets / "splats" / "fixtures" / f"minimal{dot}{name}")
    back = 1 if name in ("v3.spz", "v4.spz") else -1
    places = [[-1, 0, back], [0, 0, back], [-1, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(read.mean, places, atol=1e-6)
    np.testing.assert_allclose(read.scale, 0.1, rtol=0.02)
    np.testing.assert_allclose(read.opacity, 230 / 255, rtol=1e-6)
    assert read.sh.shape == (4, 1, 3)
    np.testing.assert_allclose(np.abs(read.rotation).max(axis=1), 1, atol=1e-4)
