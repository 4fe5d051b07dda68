"""Share of static pixels of a video: a screen's frame, or the surroundings of a turntable.

Where a camera moves about an object, whatever has contrast moves in its pictures. What does not
would be taken for the world that stands still, and all cameras put at one place.
"""

import numpy as np
from jaxtyping import Float32, UInt8

MIN_PIXEL_CONTRAST_U8 = 12.0
"""Mean difference of neighbouring pixels, of 255, from which on one would see a pixel move."""
STATIC_RANGE_U8 = 10
"""Range of a pixel's greys over the video, of 255, that compression makes of what stands still."""
MIN_CONTRAST_PIXELS = 50
"""Pixels of contrast without which nothing is said."""


class StaticPixels:
    """Told all frames of a video, one after the other."""

    def __init__(self) -> None:
        self.frames = 0
        self.low: UInt8[np.ndarray, "H W"] = np.zeros((0, 0), np.uint8)
        self.high: UInt8[np.ndarray, "H W"] = np.zeros((0, 0), np.uint8)
        self.contrast: Float32[np.ndarray, "H W"] = np.zeros((0, 0), np.float32)

    def look(self, grey: UInt8[np.ndarray, "H W"]) -> None:
        """Take in one more frame, of the same size."""
        if not self.frames:
            self.low, self.high = grey.copy(), grey.copy()
            self.contrast = np.zeros(grey.shape, np.float32)
        self.frames += 1
        np.minimum(self.low, grey, out=self.low)
        np.maximum(self.high, grey, out=self.high)
        signed = grey.astype(np.float32)
        self.contrast[:, 1:] += np.abs(np.diff(signed, axis=1))
        self.contrast[1:] += np.abs(np.diff(signed, axis=0))

    @property
    def share(self) -> float:
        """Of the pixels of contrast, those that never changed [-]."""
        clear = self.contrast > MIN_PIXEL_CONTRAST_U8 * self.frames
        if np.count_nonzero(clear) < MIN_CONTRAST_PIXELS:
            return 0.0
        still = self.high.astype(int) - self.low <= STATIC_RANGE_U8
        return float((clear & still).sum() / clear.sum())
