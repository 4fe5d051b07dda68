"""The data that pass between the stages, in the order they appear. Read its files first.

Every array states its shape and its unit. All quantities are SI. Frames are right-handed with +Z up and the floor at
z = 0; quaternions are (w, x, y, z); cameras follow OpenCV. A name ``x_of_y`` is an index array: for each y, which x.
Letters in shapes: V vertices, T triangles, P particles, N points, K parts.

``scene`` is what comes in, ``description`` what it is in words, ``material_field`` what it is made of, ``simulation``
what is simulated; ``notes`` what was noticed. All are imported from here.
"""

# ruff: noqa: F401

from corporeal.core.types.description import (
    NO_USAGE,
    WALLED_KINDS,
    AnswerSource,
    Hypothesis,
    Inventory,
    MassEvidence,
    MeasuredRange,
    ModelUsage,
    ObjectAnswer,
    ObjectDescription,
    Part,
    PartDescription,
    Parts,
    PrintedFact,
    Provenance,
    RangePlacement,
    ScanThickening,
    StructureKind,
    apply_hypothesis,
)
from corporeal.core.types.material_field import (
    AnsweredMass,
    Law,
    MassPosterior,
    Material,
    MaterialField,
    PartComponent,
    Structure,
    WeighedHypothesis,
)
from corporeal.core.types.notes import Note, NoteKind, note_kind, note_kinds, notes_with_kinds, with_text
from corporeal.core.types.scene import (
    GRAVITY_M_S2,
    GRAVITY_VECTOR,
    STATED_MATTER_KEY,
    SUBSTANCE_KEY,
    Camera,
    FeatureCloud,
    Finish,
    Gaussians,
    Keyframes,
    ObjectGrouping,
    Push,
    Reconstruction,
    Scene,
    SceneObject,
    Surface,
    Vector,
    Views,
    Wall,
    Wind,
)
from corporeal.core.types.simulation import (
    CURVATURE_COLUMNS,
    Discretization,
    FractureEvent,
    Frame,
    Ledger,
    Particles,
    PlantRoot,
    Trajectory,
    VesselContents,
    Video,
)

STORED_KINDS: dict[str, type] = {
    "range_placement": RangePlacement,
    "measured_range": MeasuredRange,
    "provenance": Provenance,
    "hypothesis": Hypothesis,
    "printed_fact": PrintedFact,
    "mass_evidence": MassEvidence,
    "scan_thickening": ScanThickening,
    "part_description": PartDescription,
    "object_answer": ObjectAnswer,
    "object_description": ObjectDescription,
    "model_usage": ModelUsage,
    "inventory": Inventory,
    "part": Part,
    "parts": Parts,
    "law": Law,
    "material": Material,
    "structure": Structure,
    "part_component": PartComponent,
    "weighed_hypothesis": WeighedHypothesis,
    "answered_mass": AnsweredMass,
    "mass_posterior": MassPosterior,
    "material_field": MaterialField,
    "finish": Finish,
    "surface": Surface,
    "push": Push,
    "keyframes": Keyframes,
    "wind": Wind,
    "wall": Wall,
    "scene_object": SceneObject,
    "scene": Scene,
    "camera": Camera,
    "views": Views,
    "gaussians": Gaussians,
    "feature_cloud": FeatureCloud,
    "reconstruction": Reconstruction,
    "discretization": Discretization,
    "plant_root": PlantRoot,
    "vessel_contents": VesselContents,
    "particles": Particles,
    "frame": Frame,
    "ledger": Ledger,
    "fracture_event": FractureEvent,
    "trajectory": Trajectory,
    "video": Video,
}
"""Kind → its dataclass or enumeration. A kind stays when the class is renamed or moved."""
KIND_OF: dict[type, str] = {stored: kind for kind, stored in STORED_KINDS.items()}
