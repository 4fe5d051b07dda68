"""Granular heaps on the ground: mud, sand, snow."""

import numpy as np

from corporeal.showcase import parametric_surfaces, procedural_textures, sdf
from corporeal.showcase.prop_mesh import PropModel, PropPart, plain_finish, textured_finish


def mud_pile() -> PropModel:
    """Model wet mud, 0.26 m across and 9 cm high: lumpy, glossy, slumped at the rim."""
    rng = np.random.default_rng(5)
    rim = _heap_rim(0.125, 3, 0.06)
    fine = sdf.periodic_noise_3d(2, 2.0)
    angle, place = rng.random(16) * 2 * np.pi, 0.085 * np.sqrt(rng.random(16))
    wide, tall = 0.024 + 0.020 * rng.random(16), 0.008 + 0.014 * rng.random(16)
    lumps = np.stack([place * np.cos(angle), place * np.sin(angle), wide, tall], 1)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        s = _rim_distance_fraction(x, y, rim)
        z = bed = 0.068 * (1 - 0.55 * s**2)
        for cx, cy, w, h in lumps:
            # Soft maximum: clods melt into each other.
            clod = h * np.exp(-(((x - cx) ** 2 + (y - cy) ** 2) / w**2)) + bed
            z = 0.5 * (z + clod + np.sqrt((z - clod) ** 2 + 3e-5))
        return (1 - s**5) ** 0.6 * (z - 0.004 + 0.0012 * _heap_relief(fine, x, y, 0.07))

    colours = ("#2a2018", "#453527", "#5f4b38")
    look = textured_finish(
        "wet mud", procedural_textures.speckle_texture(512, 81, *colours, falloff=1.2, contrast=0.12), 0.22
    )
    return PropModel(
        "mud_pile", (PropPart("mud", parametric_surfaces.mound_surface(height, rim, 64, 144, 0.25), look, "mud"),)
    )


def sand_pile() -> PropModel:
    """Dry sand, 1.2 m across, poured at 25 degrees, with wind ripples."""
    rim = _heap_rim(0.6, 8, 0.025)
    dune, fine = sdf.periodic_noise_3d(4, 2.2), sdf.periodic_noise_3d(9, 1.0)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        s = _rim_distance_fraction(x, y, rim)
        cone = 0.6 * np.tan(np.radians(25)) * (1 - s - 0.28 * np.exp(-((s / 0.33) ** 2)))
        phase = (x * 0.8 + 0.5 * y + 0.035 * _heap_relief(dune, x, y, 0.3)) / 0.10
        strength = 0.5 + 0.5 * np.clip(_heap_relief(dune, y, x, 0.5), -1, 1)
        ripple = np.sin(2 * np.pi * phase) * np.clip((1 - s) * 4, 0, 1) * strength
        grain = 0.009 * _heap_relief(dune, x, y, 0.35) + 0.0008 * _heap_relief(fine, x, y, 0.08)
        return cone + 0.0055 * ripple + np.clip((1 - s) * 5, 0, 1) * grain

    colours = ("#b28a54", "#dcb77e", "#f1d9aa")
    look = textured_finish(
        "dry sand", procedural_textures.speckle_texture(512, 91, *colours, falloff=0.35, contrast=0.16), 0.95
    )
    return PropModel(
        "sand_pile", (PropPart("sand", parametric_surfaces.mound_surface(height, rim, 84, 168, 0.35), look, "sand"),)
    )


def snow_heap() -> PropModel:
    """Drift of fresh snow, 1.2 m across and 0.24 m high."""
    rim = _heap_rim(0.60, 12, 0.05)
    soft = sdf.periodic_noise_3d(17, 2.6)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        s = _rim_distance_fraction(x, y, rim)
        return 0.20 * (1 - s**2.4) ** 1.7 * (1 + 0.11 * _heap_relief(soft, x, y, 0.25))

    look = plain_finish("fresh snow", "#f3f7fc", 0.85)
    return PropModel(
        "snow_heap", (PropPart("snow", parametric_surfaces.mound_surface(height, rim, 60, 128), look, "snow"),)
    )


def _heap_rim(radius: float, seed: int, wobble: float) -> parametric_surfaces.RimRadius:
    """Draw a rim that wanders smoothly: radius [m] as a function of the angle."""
    c = np.random.default_rng(seed).standard_normal((2, 5)) / np.arange(1, 6) ** 1.2

    def rim(angle: np.ndarray) -> np.ndarray:
        waves = [c[0, k] * np.cos((k + 1) * angle) + c[1, k] * np.sin((k + 1) * angle) for k in range(5)]
        return radius * (1 + wobble * np.sum(waves, axis=0))

    return rim


def _rim_distance_fraction(x: np.ndarray, y: np.ndarray, rim: parametric_surfaces.RimRadius) -> np.ndarray:
    """Distance from the centre as a share of the rim's."""
    return np.clip(np.hypot(x, y) / rim(np.arctan2(y, x)), 0, 1)


def _heap_relief(noise: sdf.SignedDistanceField, x: np.ndarray, y: np.ndarray, wavelength: float) -> np.ndarray:
    return noise(np.stack([x, y, 0 * x], -1).reshape(-1, 3) / wavelength).reshape(x.shape)
