"""Small tileable textures, [H W 3] uint8 sRGB: filtered noise, wood, weave, bark, leaf, glaze."""

import numpy as np
from jaxtyping import Float, UInt8

TextureImage = UInt8[np.ndarray, "H W 3"]


def fractal_noise(
    n: int, seed: int, falloff: float = 1.6, stretch: tuple[float, float] = (1, 1)
) -> Float[np.ndarray, "n n"]:
    """Tileable fractal noise, mean 0 and variance 1; ``stretch`` makes it longer along (u, v)."""
    frequency = np.fft.fftfreq(n, 1 / n)
    ky, kx = np.meshgrid(frequency, frequency, indexing="ij")
    k = np.hypot(kx * stretch[0], ky * stretch[1])
    white = np.fft.fft2(np.random.default_rng(seed).standard_normal((n, n)))
    x = np.fft.ifft2(white / np.maximum(k, 1.5) ** falloff * (k > 0)).real
    return x / x.std()


def rgb_of_hex(hex_colour: str) -> Float[np.ndarray, "3"]:
    """'#rrggbb' to three numbers in [0, 255]."""
    return np.array([int(hex_colour[i : i + 2], 16) for i in (1, 3, 5)], float)


def colour_ramp(x: np.ndarray, *colours: str) -> np.ndarray:
    """Map x in [0, 1] through evenly spaced colours."""
    stops = np.linspace(0, 1, len(colours))
    c = np.array([rgb_of_hex(h) for h in colours])
    return np.stack([np.interp(x, stops, c[:, i]) for i in range(3)], -1)


def image_bytes(x: np.ndarray) -> TextureImage:
    """Round to bytes."""
    return np.clip(np.round(x), 0, 255).astype(np.uint8)


def speckle_texture(
    n: int, seed: int, *colours: str, falloff: float = 0.8, contrast: float = 0.22
) -> TextureImage:
    """Plain fractal noise through a ramp: sand, soil, terracotta, mud."""
    return image_bytes(colour_ramp(0.5 + contrast * fractal_noise(n, seed, falloff), *colours))


def swirl_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Marbled rubber."""
    return image_bytes(
        colour_ramp(0.5 + 0.25 * np.sin(3.0 * fractal_noise(n, seed, 2.4, (2, 1))), *colours)
    )


def wood_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Grain along u: warped rings and fine fibres."""
    v = np.arange(n)[:, None] / n
    rings = np.sin(2 * np.pi * (5 * v + 0.55 * fractal_noise(n, seed, 2.2, (9, 1))))
    fibre = fractal_noise(n, seed + 1, 0.9, (24, 1))
    return image_bytes(colour_ramp(0.5 + 0.20 * rings + 0.13 * fibre, *colours))


def weave_texture(n: int, seed: int, *colours: str, threads: int = 32) -> TextureImage:
    """Plain weave with slubs."""
    t = np.arange(n) * 2 * np.pi * threads / n
    over = np.sin(t / 2)[:, None] * np.sin(t / 2)[None]
    bump = np.where(over > 0, np.abs(np.cos(t / 2))[:, None], np.abs(np.cos(t / 2))[None])
    weft, warp = fractal_noise(n, seed, 0.35, (8, 1)), fractal_noise(n, seed + 1, 0.35, (1, 8))
    slub = 0.085 * weft + 0.085 * warp + 0.012 * fractal_noise(n, seed + 2, 1.5)
    return image_bytes(colour_ramp(0.42 + 0.30 * (bump - 0.5) + slub, *colours))


def bark_texture(n: int, seed: int, *colours: str) -> TextureImage:
    """Ridges along v."""
    ridges = 0.2 * fractal_noise(n, seed, 1.2, (1, 5)) + 0.1 * fractal_noise(n, seed + 1, 0.8)
    return image_bytes(colour_ramp(0.5 + ridges, *colours))


def leaf_texture(n: int, *colours: str) -> TextureImage:
    """Pale midrib and side veins; u from base to tip, v across."""
    v, u = np.meshgrid(np.abs(np.linspace(-1, 1, n)), np.linspace(0, 1, n), indexing="ij")
    veins = np.exp(-((np.sin(np.pi * 7 * (u - 0.35 * v)) / 0.18) ** 2)) * (v > 0.03)
    rib = (np.exp(-((v / 0.06) ** 2)) + 0.35 * veins)[..., None]
    blade = colour_ramp(0.35 + 0.25 * v + 0.08 * fractal_noise(n, 5), *colours)
    return image_bytes(blade + 38 * rib * [1, 1, 0.6])


def pages_texture(n: int = 256) -> TextureImage:
    """Edges of paper, one line per leaf."""
    line = np.random.default_rng(1).standard_normal(n)[:, None, None]
    return image_bytes(
        rgb_of_hex("#efe6d0") + 9 * line + 3 * fractal_noise(n, 2, 0.5, (12, 1))[..., None]
    )


def mug_glaze_texture(n: int = 512) -> TextureImage:
    """Below v = 0.5 the outside from foot to rim, above it the inside from rim to floor."""
    t = (np.arange(n) + 0.5) / n
    v, u = np.meshgrid(1 - t, t, indexing="ij")
    edge = 0.115 + 0.016 * np.sin(4 * np.pi * u) + 0.008 * np.sin(10 * np.pi * u + 1)
    foot, outside = (v < edge)[..., None], (v < 0.478)[..., None]
    x = np.where(
        foot, rgb_of_hex("#c19a76"), np.where(outside, rgb_of_hex("#2f7f86"), rgb_of_hex("#f3eee0"))
    )
    line = np.exp(-(((v - edge - 0.006) / 0.006) ** 2))[..., None]
    return image_bytes(x * (1 - 0.25 * line) + 5 * fractal_noise(n, 4, 1.0)[..., None] * foot)
