"""Outcomes and audits made by hand: what a test does not name is as in a run where all is well."""

from corporeal.core.audit_data import (
    AuditFinding,
    FindingEffect,
    ObjectOutcome,
    Outcome,
    PairOutcome,
    PartAudit,
    RunAudit,
)
from corporeal.core.types import NO_USAGE


def object_outcome(**what):
    """One that lies still."""
    said = {
        "at_rest": True, "rms_speed_end": 0.0, "shape_error_end": 0.0, "shape_error_max": 0.0,
        "dent_depth_m": 0.0, "dent_depth_dx": 0.0, "dent_place": None, "dent_share": 0.0,
        "dent_from_contact_m": {}, "deepest_squeeze_m": 0.0, "moved_m": (0.0, 0.0, 0.0),
        "moved_level_m": 0.0, "turned_deg": 0.0, "rest_drift_m": 0.0, "length_m": 0.1,
        "fall_m": None, "rebound_m": None, "rebound_ratio": None,
    }  # fmt: skip
    return ObjectOutcome(**said | what)


def pair_outcome(**what):
    """Two that never met."""
    names = PairOutcome.__dataclass_fields__
    return PairOutcome(**dict.fromkeys(names) | {"impulse": 0.0} | what)


def outcome(objects, pairs=None, order=()):
    """Say what happened to some objects and pairs, in one second."""
    return Outcome(objects, pairs or {}, tuple(order), cell_m=0.01, duration_s=1.0)


def part_audit(**what):
    """A part of something soft."""
    said = {
        "name": "part", "object": "thing_0", "material": "rubber", "law": "neo_hookean",
        "treatment": "deformable", "structure": "solid", "young_pa": 1e6, "simulated_young_pa": 1e6, "nu": 0.45,
        "density": 1e3, "density_sim": 1e3, "yield_stress": None, "yield_stress_sim": None,
        "thickness_m": None, "contents": None, "fill": None, "thickness_sim_m": None,
        "mass_kg": 1.0, "real_mass_kg": 1.0, "reason": "",
    }  # fmt: skip
    return PartAudit(**said | what)


def audit_finding(**what):
    """A shelf that buckles."""
    seen = FindingEffect("deformation", 0.06, 0.005, True)
    said = {
        "object": "shelf_0", "part": "boards", "severity": "grave", "causes": ("thickened wall",),
        "stiffness_ratio": 5e-5, "in_plane_ratio": 1.4e-3, "cells_across": None, "effects": (seen,),
        "sentence": "shelf_0: boards is simulated with 5e-05 of its measured Young's modulus: it deforms by 60 mm.",
    }  # fmt: skip
    return AuditFinding(**said | what)


def run_audit(**what):
    """A run whose every bound holds."""
    said = {
        "particles": 1000, "objects": 2, "frames": 61, "cell_m": 0.01, "steps": 100,
        "dt_min": 1e-4, "dt_max": 1e-4, "nan_count": 0, "particles_out_of_domain": 0,
        "momentum_residual": 1e-6, "energy_growth": 0.0, "mechanical_growth": 0.0,
        "mass_error": 0.0, "max_penetration_m": 0.002, "max_penetration_dx": 0.2,
        "floor_penetration_m": 0.001, "pair_penetration_m": 0.002, "parts": (), "settling": None,
        "warnings": (), "outcome": outcome({}), "expectations": (),
        "seconds": {"simulate": 40.0, "total": 60.0}, "peak_memory_mb": 400.0,
        "settings": {"detail": "draft"}, "questions": NO_USAGE,
    }  # fmt: skip
    made = RunAudit(**said | what)
    return made.noting(made.warnings)
