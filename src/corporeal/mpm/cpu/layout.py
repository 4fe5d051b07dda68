"""Memory layout shared by Python and native loops: channels, columns, codes and structs.

``cpp_layout_numbers`` and the texts of the records stand in front of the loops that read them; no number and no struct
of this layout is written in ``loops``.
"""

from corporeal.mpm.constants import BRANCHES
from corporeal.mpm.native_records import NativeRecord

# ---------------------------------------------------------------- particles

PLACE = 22
"""Places are fixed point, relative to the field's window: 2**PLACE units per cell."""
CELL_UNITS, HALF_CELL_UNITS = 1 << PLACE, 1 << (PLACE - 1)
"""A cell and half a cell [units]."""
XI, VE, AF, DE, ST, MA, VO, MT, ID = 0, 3, 6, 15, 24, 30, 31, 32, 33
"""First channels of a particle in its batch, [channel][8]: place (3), velocity (3), affine part (9, per cell: dx times
the usual), F - 1 (9), stress (6), mass, volume, material and number."""
CHANNELS = 34
"""Channels of a particle."""
EP, VC, TM = 0, 1, 2
"""First channels of what material that flows remembers besides: plastic strain, volume correction, whole motion - 1
(9).
"""
LOG_VOLUME_RATIO, PRESSURE, OWN_DILATATION, CLUSTER, WAVE_BOUND = 1, 2, 3, 4, 5
"""The same of nearly incompressible material: ln of the mean volume over its own and the Kirchhoff pressure of the mean
[Pa]; within a step, its own dilatation, its cluster and the wave bound so far. Its plastic strain, in the channel
before, stays 0.
"""
HISTORY_CHANNELS = 11
"""Channels of that."""
BRANCH_STRAIN, BRANCH_DILATATION = 0, 6
"""First channels of a Maxwell branch: its strain (6) and θ."""
BRANCH_CHANNELS = 7
"""Channels of a branch."""
MAXWELL_CHANNELS = BRANCHES * BRANCH_CHANNELS
"""Channels of what all branches of a particle remember."""
LAW, MU, LAMBDA, YIELD, HARD, CONE, APEX, DRAG, INDEX, FLIP_DAMPING_RATE, RHO, STRAINLESS = range(12)
"""Columns of the table of materials: the law's number, μ, λ, σ_y, H [Pa], cone slope α, apex strain p₀/K, of a liquid
K_c/dtⁿ in this step [Pa] and n, FLIP damping rate [1/s], ρ [kg/m³], 1 of rigid bodies and of vertices of shells."""
SHEAR, BULK, BRANCH_KEPT, BRANCH_FRESH, BRANCH_TIME, PUSH_VELOCITY, CONSISTENCY, STIFFENING = (
    12,
    14,
    16,
    18,
    20,
    22,
    25,
    26,
)
"""And of each Maxwell branch G, K [Pa], what this step leaves of old and of new strain, T [s]; this step's push [m/s]
(3); K_c of a liquid [Pa sⁿ]; how many times stiffer waves find it with branches than without [-]."""
MATERIAL_COLUMNS = 32
"""Columns with room to spare: a row is two cache lines."""

# ---------------------------------------------------------------- triangles of shells

(WALL_LAW, WALL_MU, WALL_LAMBDA, WALL_POISSON, WALL_YIELD, WALL_HARD, WALL_STIFFNESS, WALL_BENDING) = range(8)
"""Columns of walls: law, membrane's μ, λ [Pa], ν, σ_y, H [Pa], E/(1 - ν²) of the membrane [Pa], D [N m] …"""
WALL_HINGE_MOMENT, WALL_THICKNESS, WALL_STRENGTH, WALL_DECAY = 8, 9, 10, 12
"""… moment of a plastic hinge [N], thickness [m], strength of either Maxwell branch, number of their times."""
WALL_COLUMNS = 16
"""Columns with room to spare: a row is a cache line."""
TRIANGLE_WALL, TRIANGLE_AREA, TRIANGLE_REST = 0, 1, 2
"""Channels of what never changes of a triangle, [channel][8]: row of walls, area (0: it fills a batch) [m²], B at rest
(4) [1/m]."""
TRIANGLE_CHANNELS = 6
"""Channels of that."""
(BARE_REST, SHELL_PLASTIC_STRAIN, PLASTIC_CURVATURE, LAST_GREEN, LAST_BEND, SHELL_BRANCH_STRAIN, SHELL_BRANCH_BEND) = (
    *(0, 4, 5, 8),
    *(11, 14, 20),
)
"""Channels of what changes, see ``shells.forces.ShellState``: B of the stress-free triangle (4), plastic strain,
plastic curvature (3), Green's strain (3) and curvature (3) at the last step, strain and curvature of branches (6)."""
SHELL_STATE_CHANNELS = 26
"""Channels of that."""
SHELL_PLACES, SHELL_HINGES, SHELL_TRIANGLES, SHELL_CORNERS, SHELL_VERTICES = range(5)
"""Phases of shells: where vertices are, angles, stress and moments, forces on corners, and on vertices."""
SHELL_BATCHES_PER_TASK = 32
"""Batches of eight triangles or hinges of one task."""
SHELL_VERTICES_PER_TASK = 256
SHELL_PLASTIC, SHELL_VISCOUS = 0, 1
"""Columns of such a task's report [J]."""
SHELL_REPORT_COLUMNS = 8
"""Columns with room to spare."""

# ---------------------------------------------------------------- blocks and tasks

BLOCK_INTEGERS = 32
"""Integers of a block's record: start, end, coordinates 3, neighbours 27."""
NEIGHBOURS = 5
"""The first of the node blocks around it, and …"""
OWN_BLOCK = NEIGHBOURS + 13
"""… its own."""
RUN_INTEGERS = 5
"""Integers of a run of slots before a sort: the first of them."""
ARENA_LAYER_NODES = 66
"""Nodes from one layer of an arena of 8 x 8 x 8 to the next: with 64, what is read in the third layer would wait for
what was just written in the first, 4096 bytes before."""
ARENA_FLOATS = 8 * ARENA_LAYER_NODES
LANES = 8
"""Numbers in a vector, in single precision."""
COLOURS = 8
"""Tasks on particles are pieces of columns of blocks. Those of one colour, the parities of their x, y and number in the
column, never overlap."""
SPEED2, WAVE2, PLASTIC, VISCOUS, REPORT_ASTRAY, REPORT_WORK = range(6)
"""Columns of a task's report."""
REPORT_COLUMNS = 8
"""Columns with room to spare: a row is a cache line."""
STOP_TIME_REACHED, STOP_PARTICLE_STRAYED, STOP_PAUSED, STOP_INFINITE = 1, 2, 3, 4
"""Why steps ended: time is up; a particle left its block; enough for now; something overflowed."""
NANOSECONDS = 1_000_000_000
"""Of a second: what phases are timed in."""
MAX_THREADS = 64
"""That may share tasks."""
SORT_SURVEY, COUNT, RANK, SORT_COPY = range(4)
"""Stages of a sort."""
READING_RUNS = 64
"""Runs of blocks that are added up on their own where particles are read."""
BODY_SUMS = 13
"""Of a body: m x (3), m v (3), angular momentum about the origin (3), kinetic and elastic energy, the energy in Maxwell
branches, and the largest |v|²."""

# ---------------------------------------------------------------- rigid bodies

(CENTRE, TURN, REST_INVERSE_INERTIA, SPEED, MOMENT, INERTIA, SPIN, RADIUS, KICK, FRAME_MASS, LOCAL_BOX) = (
    *(1, 4, 13, 22, 25, 28, 37, 40, 41),
    *(44, 48),
)
INVERSE_MASS, REST_INERTIA, NEXT_ROTATION = 54, 55, 64
"""First columns of a rigid state, after its mass: centre (3), rotation (9), inverse inertia at rest (9), velocity (3),
angular momentum (3), inverse inertia now (9), spin (3), radius, kick (3); while a frame holds soft nodes its own mass
and centre (4); lowest and highest corner of the box around its particles in its own frame (6). Then 1/M in contact (0:
prescribed motion), and of what does its inertia at rest (9) and its rotation at the end of the step (9)."""
RIGID_STATE_COLUMNS = 80
"""Columns with room to spare."""

# ---------------------------------------------------------------- contact

LIST_PARTS = 16
"""Parts that a list is cut into, whoever works on them."""
FIELDS_IN_BLOCK = 12
"""Fields that may meet in one block of nodes."""
PAIR_COLUMNS = 17
"""Columns of a pair of fields in a step: its part in a round of impacts, normal sum, weighted place (3), spare; in such
a round those of ``ImpactSupport`` in impact_support.h."""


def cpp_layout_numbers() -> str:
    """C++ text of all numbers of the layout."""
    found = {k: v for k, v in globals().items() if k.isupper() and isinstance(v, int)}
    return "".join(f"const int {name} = {value};\n" for name, value in found.items())


# ---------------------------------------------------------------- structs of a step

POST_RECORD = NativeRecord(  # one thread's, on a cache line of its own
    "Post",
    ("unsigned long long", "share"),  # its tasks of this phase: epoch 24 bits, next 20, end 20
    ("unsigned long long", "busy"),
    ("unsigned long long[6]", "spare"),
)
THREAD_POOL_RECORD = NativeRecord(
    "ThreadPool",
    ("void *", "yield_core read_clock"),  # the system's sched_yield and clock_gettime, or null
    ("int *", "phase"),  # [phases][4]: piece, first task, how many, or the field of World that holds it
    ("double *", "spent"),  # [phases + 1], or null
    ("int", "phases threads now piece first count started clock_id"),
    ("int", "epoch stopped"),  # a line of their own
    ("unsigned long long[7]", "fill1"),
    ("int", "done spare2"),
    ("unsigned long long[7]", "fill2"),
    (f"Post[{MAX_THREADS}]", "post"),
    within=(POST_RECORD,),
)
BOND_RECORD = NativeRecord(  # a frame and the soft nodes it holds in this step: see physics/inclusions.py
    "Bond",
    ("int *", "slot"),
    ("float *", "mass volume"),
    ("double *", "point"),  # [points][4] near the soft body: place in the frame's frame, volume
    ("double", "per_soft"),  # volume per mass [m³/kg]
    ("int", "frame soft points count"),
)
BODY_LOAD_RECORD = NativeRecord(  # uniform accelerations of a body
    "BodyLoad",
    ("double", "mass"),
    ("double[3]", "push"),
    ("double", "start end"),
    ("double *", "rigid"),
    ("double *", "path"),  # prescribed motion: see physics/prescribed_motion.py
    ("double[3]", "arm"),  # of the centre at the start from the path's first place
    ("int", "field first last"),  # first and last row of the field's materials
    ("int", "paths"),  # rows of the path; 0: it moves freely
)
CLOCK_RECORD = NativeRecord(
    "Clock",
    ("BodyLoad *", "body_load"),
    ("double *", "external_impulse push_work"),
    ("double", "until given stable speed wave smallest largest"),
    ("double[3]", "gravity"),
    ("double", "ramp courant rigid_courant fall"),
    ("long long", "count budget"),
    ("int", "body_loads started last laid fuse fused pushed spare"),
)
# Nodes: mass, momentum 3, force of stress 3, mass times height over the node [cells] along "level"; after the forces
# mass, velocity 3, velocity as it was 3, mean height. While a step reads its nodes, the next one's are laid.
FIELD_RECORD = NativeRecord(
    "Field",
    ("float *", "part node next history branch material"),
    ("int *", "table block where"),
    ("int *", "used"),  # which of the two sets of nodes hold anything in a node block: bits
    ("int *", "home box"),  # block of particles at a node block, -1: none; lowest, highest place
    ("unsigned long long *", "have"),  # nodes with mass of each node block, once forces have acted
    ("double *", "point"),  # rigid: [points][5] place in the body's frame, mass, volume
    ("double *", "rigid"),  # rigid: its state
    ("double *", "surface"),  # rigid: [surfaces][3] in the body's frame
    ("double *", "facet facet_point"),  # rigid: [facets][FACET_ROW] flat faces; places on them
    ("double *", "curvature"),  # rigid: [surfaces][CURVATURE_COLUMNS], see types.CURVATURE_COLUMNS
    ("double *", "wetted_points"),  # rigid: [..][6] points that liquids touch, and their normals
    ("double *", "patch"),  # rigid: [patches][6] of those, as of clumps
    ("float *", "places"),  # rigid: [3][wets] where they lie, to pass over most of them fast
    ("double *", "clump"),  # rigid: [clumps][6] first and last point, middle, radius
    ("double *", "shown show"),  # rigid: surface points in order of place; [shows][6] as of clumps
    ("double *", "slim"),  # rigid: [slims][3] surface points where it is thin and not as a whole
    ("double", "spacing"),  # rigid: of its surface points
    ("double", "mass full"),  # full: of a cell full of it
    ("double[3]", "flows_by"),  # of a liquid at a wall: yield stress [Pa], K/d^n [Pa (s/m)^n], n
    ("int[3]", "origin dim"),  # in blocks; the window's corner and size
    ("int", "blocks pool rigids points surfaces pushed uses_mean_dilatation flows relaxes"),
    ("int", "floor"),  # the only plane that the window reaches, or -1
    ("float[3]", "level"),  # its normal, or 0
    ("float *", "half_wall"),  # [particles of all fields] of vertices [cells], else 0; null: the field has none
    ("double", "widest_wall"),  # the largest of them
    ("int", "thin pours"),  # of a rigid body: see physics/rigid.py; pours: whether it is liquid
    ("int", "patches wets shows facets slims"),
    ("int", "pointed"),  # rigid: no node of it meets a plane: points of its own do, or nothing does
    ("int", "rolls"),  # rigid: whether any of its surface points is round
    ("int", "flat"),  # rigid: whether it is bounded by flat faces for the most part
    ("int", "edged"),  # rigid: whether it is known to have edges
    ("int", "bends"),  # rigid: whether it curves outwards or inwards anywhere
    ("int", "side clumps"),  # side: of the two sets of nodes, which this step reads
    ("int", "shells is_shell"),  # whether any of its particles are vertices of shells, and whether most are
)
WIND_RECORD = NativeRecord(  # a body in the wind: see wind_records.py
    "WindLoad",
    ("double *", "area point rigid impulse signal"),
    ("int *", "face"),
    ("double[3]", "wind"),
    ("double", "gust start end half_rho_c work"),
    ("int", "field first count free"),
)
TETHER_RECORD = NativeRecord(  # particles of a field on springs to a rigid body: see physics/springs.py
    "Tether", ("double *", "anchor rate holder"), ("double", "damping lost"), ("int", "field first count")
)
JOINT_RECORD = NativeRecord(  # two rigid bodies: arms in their own frames
    "Joint", ("double *", "first second"), ("double[3]", "arm_first arm_second"), ("double", "stiffness damping lost")
)
GRIP_RECORD = NativeRecord(  # a spring from a body to a point outside: see physics/spring_grips.py
    "Grip",
    ("double *", "share rigid impulse"),
    ("double[3]", "arm target"),
    ("double", "stiffness damping mass work"),
    ("int", "field first count"),
)
SHELL_RECORD = NativeRecord(  # triangles and hinges of all shells, in batches of eight: see shell_records.py
    "ShellMesh",
    ("int *", "vertex"),  # of every particle: its number as a vertex, -1: none
    ("int *", "place"),  # [vertices][4] fixed point, as of particles
    ("int *", "hinge"),  # [batches][4][8] vertices: of the edge, and opposite to it
    ("float *", "rest_angle turn"),  # [hinges]: angle at rest, and how far it is from that
    ("float *", "half"),  # [hinges][2] moment of either triangle at a hinge
    ("int *", "triangle"),  # [batches][3][8] vertices
    ("int *", "first_slot"),  # [batches + 1], in threes: one for each side
    ("int *", "slot"),  # [slots][8] hinge, 0 or 1 for which of its halves, and for winding against it: 30, 1, 1 bits
    ("float *", "curvature"),  # [slots][3][8] for each radian
    ("float *", "wall"),  # [walls][WALL_COLUMNS]
    ("float *", "rest state"),  # [batches][..][8]
    ("float *", "pull"),  # [batches][12][8] force of membranes on the second and third corner, edges to them
    ("float *", "corner force"),  # [triangles][3][4], [vertices][4]
    ("int *", "first_corner corners"),  # of every vertex
    ("double *", "branch_time"),  # [decays][2]
    ("float *", "decay"),  # [decays][4]: what a step leaves of old, and of new strain of either branch
    ("double *", "report"),
    ("double", "wave bending_step"),  # speed of waves in the plane [m/s]; longest step for bending [s]
    ("int", "decays hinges triangles vertices"),  # batches of hinges and triangles
)
WORLD_RECORD = NativeRecord(
    "World",
    ("ThreadPool *", "thread_pool"),
    ("Clock *", "clock"),
    ("Field *", "field"),
    ("int *", "task list contact_memory"),
    ("int *", "chore"),  # [chores][2]: first and last of the tasks that are done one by one
    ("double *", "report plane friction restitution"),
    ("double *", "restitution_law"),  # how restitution changes with speed: 5 numbers a pair
    ("double *", "rolling_resistance"),  # c of every pair [m]; null: there is none
    ("double *", "plane_impulse pair_impulse friction_loss first_contact last_contact"),
    ("double *", "contact_point face spread_face impact_loss impact_of_pair"),
    ("WindLoad *", "wind_load"),
    ("Bond *", "bond"),
    ("Tether *", "tether"),
    ("Joint *", "joint"),
    ("Grip *", "grip"),
    ("ShellMesh *", "shell"),
    ("double", "dx dt time"),
    ("double[3]", "kick"),
    ("int", "fields planes tasks full"),
    ("int", "names again"),  # bodies and planes in the books; a repeated call after more memory
    ("int", "wind_loads wind_tasks bonds"),  # bodies in the wind; tasks on them
    ("int", "tethers joints grips sprung"),  # sprung: whether there is any of them
    ("int", "stop"),  # why the steps end after this phase; 0: they go on
    ("int", "nodes"),  # tasks on nodes …
    (f"int[{COLOURS}]", "colour"),  # … and chores on particles of each colour
    ("int", "bare_nodes"),  # the same where this step's nodes are still to be laid
    (f"int[{COLOURS}]", "bare"),
    ("int", "stands parts"),  # tasks on nodes that may stand on a plane; on contacts
    (f"int[{COLOURS}]", "looks"),  # chores on particles for contact; 0 without any
    (f"int[{COLOURS}]", "spreads"),  # the same where a shell is listed
    (f"int[{COLOURS}]", "reaches"),  # the same where a normal is chosen anew
    ("int", "rigids turns"),  # fields, where some are rigid; tasks to look at those
    ("int", "chores shelled"),  # shelled: chores, where there are shells
    ("int", "shell_hinges shell_triangles shell_vertices spare2"),  # tasks
)
STEP_RECORDS = (
    POST_RECORD,
    THREAD_POOL_RECORD,
    BOND_RECORD,
    BODY_LOAD_RECORD,
    CLOCK_RECORD,
    FIELD_RECORD,
    WIND_RECORD,
    TETHER_RECORD,
    JOINT_RECORD,
    GRIP_RECORD,
    SHELL_RECORD,
    WORLD_RECORD,
)

# ---------------------------------------------------------------- structs of contact

JUNCTION_RECORD = NativeRecord(  # a block of nodes where fields meet each other or a plane
    "Junction",
    ("int[3]", "at"),
    ("int", "fields meet side touch last choice spare"),
    (f"int[{FIELDS_IN_BLOCK}]", "field block"),
    ("unsigned long long", "mask several"),
    ("unsigned long long", "chosen"),  # nodes at which some normal is chosen anew
    (f"unsigned long long[{FIELDS_IN_BLOCK}]", "have"),
    (f"int[{FIELDS_IN_BLOCK}]", "met"),  # of the fields here, those that each may meet: bits
)
MEET_RECORD = NativeRecord(  # one such node
    "Meet", ("int[3]", "at"), ("int", "side sides touch touches stiff")
)
SIDE_RECORD = NativeRecord(  # one field there
    "Side",
    ("int", "field slot"),
    ("float", "m"),
    ("float[3]", "mean out"),
    ("float", "spare"),
    ("double[3]", "v"),
    ("double", "inverse"),
)
SPREAD_RECORD = NativeRecord(  # of a side that is a shell: sums over its particles, weighted by spline and mass
    "Spread",
    ("float[6]", "square"),  # xx, yy, zz, xy, xz, yz of places about their mean [kg cells²]
    ("float", "half_wall spare"),  # [kg cells]
)
AIM_RECORD = NativeRecord(  # candidate normals of a possible contact of two fields
    "Aim",
    ("float[3][4]", "n"),  # component by component
    ("float[2][4]", "far"),  # how far the first reaches along them, and the second against them
    ("int", "fa fc"),  # the fields; -1 for a plane
    ("float[3]", "chosen"),
    ("float", "weight"),
)
LEAN_RECORD = NativeRecord(  # what neighbours read of a possible contact: pair by pair of a block's fields
    "Lean",
    ("float[3]", "u"),  # weighted normal
    ("int", "touch"),  # the contact, or the first of them
)
CHOICE_RECORD = NativeRecord(  # which candidates won where two fields meet in a block: see physics/contact.py
    "Choice",
    ("int[3]", "at"),
    ("int", "a c spare"),  # fields
    ("unsigned long long[2]", "bits"),  # low and high bit of 1 + candidate, node by node; 0: none
)
TOUCH_RECORD = NativeRecord(  # a possible contact of side a with side c, or with plane -1 - c
    "Touch",
    ("int", "meet a c fa fc active"),
    ("int", "face"),  # which face of a rigid body a liquid meets
    ("int", "choice"),  # where its candidate is kept; -1: nowhere
    ("int", "lean"),  # -1: a plane
    ("int", "known"),  # 1 + the candidate that is kept; 0: chosen anew
    ("double[3]", "normal"),
    ("double", "gap target inverse mu span"),  # span: over which a wall drags on a liquid [m² s]
    ("double[3]", "J"),
    # Of nodes with planes or rigid bodies alone, in memory that the others need not touch:
    ("double[3]", "x before"),
    ("double", "instead"),  # of round on curved: nodes nearer transmit nothing [m]; else 0
)
ENTRY_RECORD = NativeRecord(  # what some contacts of one pair add to the books
    "Entry", ("int", "a c"), ("double", "normal"), ("double[3]", "place J"), ("double", "loss impact")
)
PAST_RECORD = NativeRecord(  # force of a contact in the last step
    "Past", ("unsigned long long", "key"), ("double[3]", "force")
)
LINE_RECORD = NativeRecord(  # a contact in the list of those that move rigid bodies
    "Line",
    ("double *", "a c"),  # velocity of a node or state of a rigid body; 0: a plane
    ("double *", "flows_by"),  # flow curve of a liquid that a wall drags on over a span
    ("double", "ma mc"),  # inverse masses of nodes; negative: a rigid body
    ("double[3]", "n ra rc"),
    ("double[6]", "K"),
    ("double", "inverse target mu e span"),  # e: of restitution; span: as of its touch
    ("double[3]", "J change"),  # change: of J, while all contacts are solved at once
    ("unsigned long long", "key"),
    ("int", "touch group waits spare"),  # waits: not in this round of impacts
)
CONTACT_STAGE_RECORD = NativeRecord(
    "Stage",
    ("Junction *", "junction"),
    ("Meet *", "meet"),
    ("Side *", "side"),
    ("Spread *", "spread"),  # of the side of the same number; null: no field is a shell
    ("Touch *", "touch"),
    ("Aim *", "aim"),
    ("Entry *", "entry stand"),
    ("Line *", "line"),
    ("Past *", "past"),
    ("int *", "slot"),  # place of each past contact, by its key; slots: a power of two
    ("double *", "pair"),  # [fields and planes][fields and planes][PAIR]
    ("double *", "light"),  # inverse masses of fields and planes, as in ``ImpactSupport``
    ("int *", "order"),
    ("Lean *", "lean"),
    ("Choice *", "choice kept"),  # of this step, and of the last one
    ("int *", "kept_slot"),  # place of each of those, by block and pair
    ("int", "most_junctions most_meets most_sides most_touches"),
    ("int", "slots pasts sweeps"),
    ("int", "junctions meets sides touches points"),
    ("int", "choices kepts kept_slots anew"),  # kept_slots: a power of two
    (f"int[{LIST_PARTS}]", "entries"),
)
CONTACT_RECORDS = (
    JUNCTION_RECORD,
    MEET_RECORD,
    SIDE_RECORD,
    SPREAD_RECORD,
    AIM_RECORD,
    LEAN_RECORD,
    CHOICE_RECORD,
    TOUCH_RECORD,
    ENTRY_RECORD,
    PAST_RECORD,
    LINE_RECORD,
    CONTACT_STAGE_RECORD,
)

# ---------------------------------------------------------------- sorting and reading

SORTING_RECORD = NativeRecord(
    "Sorting",
    ("float *", "part history branch to past_to branch_to"),
    ("int *", "old"),  # [olds][RUN]: runs of slots in use before, and the blocks they were
    ("int *", "line inner"),  # [slots before]: a particle's block, its material and cell
    ("int *", "count bin"),  # [lines], [bins]: how many there are
    ("int *", "edge"),  # [lines]: neighbours that particles may reach before the next sort
    ("int *", "middle order"),  # particles by material and cell; source of every slot, -1: none
    ("int *", "block table where"),
    ("double *", "plane"),  # [planes][4]
    ("double", "deepest farthest"),
    ("int[3]", "low high"),  # of blocks, in the old window
    ("int[3]", "dim origin"),  # of the new one
    ("int", "olds bins planes lost blocks slots pool flows relaxes out_of_block"),
)
READING_RECORD = NativeRecord(
    "Reading",
    ("float *", "part history branch material"),
    ("int *", "block owner"),  # owner of each row of materials
    ("double *", "position velocity strain motion plastic"),
    ("double *", "sum"),  # [runs][owners][SUMS]
    ("double", "dx"),
    ("int[3]", "origin"),
    ("int", "runs owners blocks uses_mean_dilatation"),
)
