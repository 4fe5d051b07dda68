"""The material library: measured ranges of properties, with sources."""

from corporeal.materials.contact_pairs import (
    Friction,
    ImpactBody,
    Restitution,
    RestitutionLaw,
    combine_friction,
    friction_between,
    pair_restitution,
    pair_restitution_law,
    series_restitution,
)
from corporeal.materials.library import (
    check_library,
    content_materials,
    find_material,
    find_material_or_default,
    library,
    library_counterpart,
    part_materials,
    read_library,
)
from corporeal.materials.library_entry import MaterialEntry, citation, cited_sources, is_estimate
from corporeal.materials.library_lint import LibraryProblem
from corporeal.materials.library_listing import describe_material, list_materials, materials_json
from corporeal.materials.quantities import QUANTITIES, Quantity, parse_quantity_key

__all__ = [
    "QUANTITIES",
    "Friction",
    "ImpactBody",
    "LibraryProblem",
    "MaterialEntry",
    "Quantity",
    "Restitution",
    "RestitutionLaw",
    "check_library",
    "citation",
    "cited_sources",
    "combine_friction",
    "content_materials",
    "describe_material",
    "find_material",
    "find_material_or_default",
    "friction_between",
    "is_estimate",
    "library",
    "library_counterpart",
    "list_materials",
    "materials_json",
    "pair_restitution",
    "pair_restitution_law",
    "parse_quantity_key",
    "part_materials",
    "read_library",
    "series_restitution",
]
