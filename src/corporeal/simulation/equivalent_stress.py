"""Von Mises stress of every particle."""

import numpy as np
from jaxtyping import Float

from corporeal.mpm import laws
from corporeal.mpm.laws.kinematics import determinant
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.problem import Problem, Snapshot


def equivalent_of_principal(tau: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, " P"]:
    """Von Mises' equivalent of principal stresses [Pa]: σ_v = √(3/2) ‖dev τ‖."""
    return np.sqrt(1.5 * np.sum((tau - tau.mean(axis=1, keepdims=True)) ** 2, axis=1))


class VonMises:
    """Von Mises stress of every particle of a problem, in its order."""

    def __init__(self, problem: Problem) -> None:
        """Look up the constitutive laws of the particles."""
        substances, row = MaterialTable.of(problem)
        self.soft = np.flatnonzero(~substances.rigid[row])
        mine = row[self.soft]
        self.law = substances.law[mine]
        self.mu, self.lam = substances.mu[mine], substances.lam[mine]

    def at(self, now: Snapshot) -> Float[np.ndarray, " P"]:
        """Return the stress [Pa] at one instant; 0 in rigid bodies, which have no strain.

        That of the Cauchy stress σ = τ / J of the material's law, whose τ follows from the elastic deformation
        gradient; what a lossy material resists only for a while is not in it.
        """
        out = np.zeros(len(now.position))
        F = np.asarray(now.deformation[self.soft], dtype=np.float64)
        tau = laws.principal_tau(self.law, F, self.mu, self.lam)
        volume = np.maximum(determinant(F), np.finfo(np.float32).tiny)
        out[self.soft] = equivalent_of_principal(tau) / volume
        return np.nan_to_num(out, nan=0.0, posinf=0.0)
