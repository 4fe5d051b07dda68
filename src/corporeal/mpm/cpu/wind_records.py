"""Records of bodies in wind for native code."""

import numpy as np

from corporeal.mpm.cpu.contact_memory import write_pointers
from corporeal.mpm.cpu.layout import WIND_RECORD
from corporeal.mpm.physics import wind_pressure
from corporeal.mpm.problem import Body, Problem

GUST_SIGNAL = np.stack(
    [wind_pressure.GUST_SHARE, wind_pressure.GUST_FREQUENCY, wind_pressure.GUST_PHASE]
)
"""Of the gusts: share, frequency [Hz] and phase [rad] of every part."""


class WindRecords:
    """Records of the bodies in the wind, and the arrays that they point to."""

    def __init__(
        self,
        problem: Problem,
        first: list[int],
        impulse: np.ndarray,
        rigid: dict[int, np.ndarray],
        points: dict[int, np.ndarray],
    ) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            first: Number of each body's first particle.
            impulse: The ledger's external impulses, which the native piece adds to.
            rigid: States of the rigid bodies.
            points: Particles of the rigid bodies in their own frames.

        """
        blown = [b for b, body in enumerate(problem.bodies) if body.wind and len(body.faces.area)]
        self.body = blown
        self.record = np.zeros(len(blown), WIND_RECORD.dtype)
        self.kept: list[np.ndarray] = [np.ascontiguousarray(GUST_SIGNAL)]
        single = problem.contact == "single"
        for row, b in zip(range(len(blown)), blown, strict=True):
            record = self.record[row : row + 1]
            self._face(record, problem.bodies[b])
            write_pointers(record, impulse=impulse[b], signal=self.kept[0])
            record["field"], record["first"] = 0 if single else b, first[b]
            if b in rigid:
                self.kept.append(np.ascontiguousarray(points[b]))
                write_pointers(record, rigid=rigid[b], point=self.kept[-1])
                record["free"] = not single

    def _face(self, record: np.ndarray, body: Body) -> None:
        assert body.wind is not None
        count = len(body.position)
        order = np.argsort(body.faces.particle, kind="stable")
        area = np.ascontiguousarray(body.faces.area[order], np.float64)
        owned = np.bincount(body.faces.particle, minlength=count)
        face = np.concatenate([[0], np.cumsum(owned)]).astype(np.int32)
        self.kept += [area, face]
        write_pointers(record, area=area, face=face)
        record["count"], record["wind"] = count, body.wind.velocity
        record["gust"] = body.wind.gust
        record["start"], record["end"] = body.wind.start, body.wind.end
        record["half_rho_c"] = wind_pressure.HALF_RHO_C

    def set_wind(self, problem: Problem) -> None:
        """Take the winds of a problem that differs in nothing else."""
        for row, b in enumerate(self.body):
            moving = problem.bodies[b].wind
            assert moving is not None
            self.record["wind"][row], self.record["gust"][row] = moving.velocity, moving.gust
            self.record["start"][row], self.record["end"][row] = moving.start, moving.end

    def take_work(self) -> float:
        """Work done since it was last taken [J]."""
        total = float(self.record["work"].sum())
        self.record["work"] = 0.0
        return total
