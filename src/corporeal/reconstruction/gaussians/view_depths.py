"""Depths of views, and floating Gaussians."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.reconstruction.gaussians.kernels_plane_sweep import count_floater_votes
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

FEW_VIEWS_FRACTION = 0.25
"""Share of the views: what fewer see is known badly."""


@dataclass(frozen=True)
class DepthVotes:
    """Votes of views on Gaussians."""

    nearest: Float[np.ndarray, " N"]
    """Least depth at which a view has each in its picture [m]; inf: none has."""
    few: Bool[np.ndarray, " N"]
    """Whether few views have it in their pictures."""
    haze: Bool[np.ndarray, " N"]
    """Whether it is wide, and more views see past it than see something there."""


@dataclass(frozen=True)
class ViewDepths:
    """What each view sees how far away; V views, h × w looks from each."""

    cameras: Float[np.ndarray, "V 16"]
    """As ``hull.camera_rows``."""
    pace: float
    """Pixels of these cameras from one look to the next."""
    clear: Float[np.ndarray, " V"]
    """Depth before each camera where nothing is drawn [m]."""
    depths: Float[np.ndarray, "V h w"]
    """Of what other views confirm; else inf [m]."""
    behind: Float[np.ndarray, "V h w"]
    """Of what encloses everything [m]."""

    def judge(self, position: Float[np.ndarray, "N 3"], width: Float[np.ndarray, " N"], pool: ThreadPool) -> DepthVotes:
        """Ask all views about Gaussians; width: their greatest standard deviation [m].

        Where a view knows no depth it sees past what few others see, maybe as far as the enclosure.
        """
        votes = np.empty((len(position), 5))
        at, width = position.astype(np.float64), width.astype(np.float64)
        rest = self.cameras, self.depths, self.behind, self.clear, self.pace, votes
        pool.each(count_floater_votes, [(at, width, *span, *rest) for span in pool.spans(len(at))])
        there, past, maybe, wide, nearest = votes.T
        few = there + past + maybe < FEW_VIEWS_FRACTION * len(self.cameras)
        haze = (wide > 0) & ((past > there) | (few & (past + maybe > there)))
        return DepthVotes(nearest, few, haze)
