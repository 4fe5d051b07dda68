"""Photographs of a painted ball on a mottled floor, made by a test."""

from functools import cache

import numpy as np

from corporeal.core.types import Views
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.region_growing import grow_masks
from corporeal.render.camera_placement import CameraAim, camera_from_aim

WIDE, HIGH = 96, 72
RADIUS, FLOOR = 0.5, -0.5
BELT, ASIDE = 0.25, 36
"""Half the width of a belt; how far from the middle a picture shows another thing [px]."""
DISCS = 0.95
"""From the ball to the middles of discs."""
OTHER, OTHER_RADIUS, BLUE = (0.85, -0.3, FLOOR + 0.2), 0.2, (0.1, 0.2, 0.7)
"""Middle, radius and colour of a second thing."""
HEAD = (0.6, -0.2, FLOOR + OTHER_RADIUS)
"""Its middle where it touches the ball."""
CLOSE = (0.68, -0.2, FLOOR + OTHER_RADIUS)
"""Its middle where it all but does."""
MIDDLES = {"head": HEAD, "close": CLOSE}
RED, GREY = (0.75, 0.15, 0.1), (0.5, 0.5, 0.45)


def scene(ball=RED, ground=GREY, seed=0, count=14, belt=None, flat=0.0, other=None, finer=1, floor=FLOOR):
    """Photographs of a ball on a mottled floor, its true masks, and points on both.

    belt: colour of a belt about the ball, and of what both sides of all pictures show; flat: radius
    of three discs of the ball's colour that lie on the floor around it; other: a blue "ball" beside
    it, or a blue "disc" that lies there, or a "head", the blue ball where it touches, or "close",
    where it all but does, which is in the masks, too: both sides of all pictures are blue then;
    finer: how many times as many rows and columns pictures have; floor: its height [m].
    """
    random = np.random.default_rng(seed)
    mottled = random.uniform(-1, 1, (64, 64, 64))
    wide, high = finer * WIDE, finer * HIGH
    turns = 2.4 * np.arange(count)
    eyes = np.stack([2.6 * np.cos(turns), 2.6 * np.sin(turns), np.linspace(0.5, 2.0, count)], -1)
    cameras = tuple(camera_from_aim(CameraAim(tuple(e), (0.0, 0.0, 0.0), 48.0, wide, high)) for e in eyes)
    pictures, masks, seen = [], [], []
    for camera in cameras:
        v, u = np.mgrid[:high, :wide] + 0.5
        local = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T
        rays = local @ camera.world_from_camera[:3, :3].T
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        eye = camera.world_from_camera[:3, 3]
        b = rays @ eye
        inside = b * b - (eye @ eye - RADIUS**2)
        on = inside > 0
        with np.errstate(divide="ignore"):
            down = np.where(rays[..., 2] < 0, (floor - eye[2]) / rays[..., 2], 30.0)
        far = np.where(on, -b - np.sqrt(np.maximum(inside, 0)), np.minimum(down, 30.0))
        blue, near = _met(rays, eye, far, MIDDLES[other] if other in MIDDLES else OTHER)
        if other in ("ball", *MIDDLES):
            on, far = on & ~blue, np.where(blue, near, far)
        place = eye + far[..., None] * rays
        if other == "disc":
            blue = ~on & (np.linalg.norm(place - OTHER, axis=-1) < 1.5 * OTHER_RADIUS)
        at = (np.floor(place * 16).astype(int) % 64).reshape(-1, 3).T
        tone = mottled[tuple(at)].reshape(high, wide)
        colour = np.where((on | on_discs(place, flat))[..., None], ball, ground)
        if other in MIDDLES:
            colour[np.abs(u - wide / 2) > ASIDE] = BLUE
        if other is not None:
            colour[blue] = BLUE
        if belt is not None:
            aside = np.abs(u - wide / 2) > ASIDE
            colour[aside | (on & (np.abs(place[..., 2]) < BELT))] = belt
        colour = colour * (1 + 0.15 * tone[..., None])
        light = np.where(on, 0.75 + 0.25 * place[..., 2] / RADIUS, 1.0)
        noisy = colour * light[..., None] + random.normal(scale=0.01, size=colour.shape)
        pictures.append(np.round(255 * np.clip(noisy, 0, 1)).astype(np.uint8))
        masks.append(on | blue if other in MIDDLES else on)
        near = np.abs(place).max(axis=-1) < 2
        seen.append(place[near][random.permutation(near.sum())[:60]])
    return Views(np.stack(pictures), cameras), np.stack(masks), np.concatenate(seen)


@cache
def grown_scene(other=None, count=14):
    """Give photographs, true masks, seeds, and what is grown of them: done once."""
    views, masks, _ = scene(other=other, count=count)
    seeds = seeds_from_cameras(views, None)
    grown = grow_masks(views, seeds)
    assert grown is not None
    return views, masks, seeds, grown


def _met(rays, eye, far, middle):
    """Which rays meet the second ball before anything else, and where."""
    away = eye - np.array(middle)
    b = rays @ away
    inside = b * b - (away @ away - OTHER_RADIUS**2)
    near = -b - np.sqrt(np.maximum(inside, 0))
    return (inside > 0) & (near < far), near


def on_discs(place, radius):
    turns = 2 * np.pi * np.arange(3) / 3
    middles = DISCS * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    near = [np.linalg.norm(place[..., :2] - middle, axis=-1) < radius for middle in middles]
    return np.any(near, axis=0)


def agreement(inside, masks):
    made = inside > 0.5
    both, either = (made & masks).sum(axis=(1, 2)), (made | masks).sum(axis=(1, 2))
    return both / np.maximum(either, 1)
