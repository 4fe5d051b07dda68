"""Constants and structs shared by the kernels of the device engine.

Plain Warp, so that the same kernels run on a CUDA GPU and on the processor. Every kernel loops
over its items with a stride: it is launched with as many threads as the device keeps busy, and
the number of items may change on the device without a word to the host.
"""

from corporeal.mpm import constants
from corporeal.mpm.quiet_warp import wp

wp.set_module_options({"enable_backward": False})

EMPTY_KEY = wp.constant(wp.int64(-1))

# What ``Sheet.flag`` holds.
FLAG_GOING = wp.constant(0)
"""1: take another step."""
FLAG_BLOCKS = wp.constant(1)
"""Blocks in use."""
FLAG_FULL = wp.constant(2)
"""1: too few blocks; 2: too little room for contacts. The step was not taken."""
FLAG_LOST = wp.constant(3)
"""1: a particle is not finite or left the domain."""
FLAG_FRESH = wp.constant(4)
"""1: blocks were added since they were linked."""
FLAG_MEETS = wp.constant(5)
FLAG_TOUCHES = wp.constant(6)
FLAG_STIFF = wp.constant(7)
"""Contacts that rigid bodies take part in."""
FLAG_HITS = wp.constant(8)
"""1: something rigid bounces in this step; 2: rigid bodies lie on one another."""
FLAG_SWEEPING = wp.constant(9)
FLAG_SWEPT = wp.constant(10)
"""Sweeps of this step so far."""
FLAG_IMPACTING = wp.constant(11)
"""1: rounds of impacts go on, of which the last is of all contacts."""
FLAG_STRUCK = wp.constant(12)
"""1: some rigid pair is hit as objects move now."""
FLAG_ROUND = wp.constant(13)
"""Rounds of this step so far."""
FLAG_LAST_ROUND = wp.constant(14)
FLAG_NORMALS_KEPT = wp.constant(15)
"""Choices of candidate normals of the last step; 0 where all are made anew."""
FLAG_NORMALS_RENEWED = wp.constant(16)
"""1: some are made anew in this step."""
FLAG_NODES = wp.constant(17)
"""Contacts on nodes: those on surface points come after them."""
FLAG_HOLDS = wp.constant(18)
"""1: in this round of impacts something is held from behind."""
FLAG_STEPPING = wp.constant(19)
"""1: another step comes before particles are sorted."""
FLAG_HOMES = wp.constant(20)
"""Blocks that had particles in them when these were sorted: the first ones."""
FLAG_TASKS = wp.constant(21)
"""Tasks: parts of such blocks' particles, each for a group of threads."""
FLAG_PLACED = wp.constant(22)
"""Particles that have a place, while they are sorted."""
FLAG_STRAYS = wp.constant(23)
"""Particles that have left the block they were sorted into."""
FLAG_PAIRS = wp.constant(24)
"""Pairs that met in this step."""
FLAG_COUNT = 25
ARENA_SIDE, ARENA_NODES, NODES_OF_BLOCK = 6, 216, 64
"""Nodes along an axis that particles of one block reach, all of them, and nodes of a block."""
ARENA_SUMS, ARENA_MOTION = wp.constant(7), 6
"""Sums of a node: mass [kg], momentum and impulse [kg m/s]; numbers of its motion [m/s]."""
THREADS_PER_GROUP = 128
"""Threads of a group on a GPU."""
TASK = wp.constant(512)
"""Particles of a task at most: a block of eight a cell is one."""
# What ``Contacts.active`` says, where it is not 0: not in this step.
CONTACT_WAITING = wp.constant(1)
"""Not in this round of impacts."""
CONTACT_SWEPT = wp.constant(2)


# What ``Sheet.clock`` holds.
CLOCK_TIME = wp.constant(0)
CLOCK_UNTIL = wp.constant(1)
CLOCK_DT = wp.constant(2)
CLOCK_COUNT = wp.constant(3)
CLOCK_SMALLEST = wp.constant(4)
CLOCK_LARGEST = wp.constant(5)
CLOCK_STABLE = wp.constant(6)
"""Largest stable step as of now [s]."""
CLOCK_LAST_STEP = wp.constant(7)
"""1: this step ends exactly at UNTIL."""
CLOCK_FORCED = wp.constant(8)
"""1: one step to UNTIL, stable or not."""
CLOCK_LENGTH = 9

# Columns of the table of materials.
LAW = wp.constant(0)
MU = wp.constant(1)
LAMBDA = wp.constant(2)
YIELD = wp.constant(3)
HARD = wp.constant(4)
CONE = wp.constant(5)
APEX = wp.constant(6)
DRAG = wp.constant(7)
"""As on the processor; worked out in every step from ``CONSISTENCY``."""
INDEX = wp.constant(8)
FORGET = wp.constant(9)
DENSITY = wp.constant(10)
RIGID = wp.constant(11)
STIFFENING = wp.constant(12)
"""How much faster waves run with Maxwell branches; 1 without."""
MATERIAL_BODY = wp.constant(13)
USES_MEAN_DILATATION = wp.constant(14)
"""1: pressure comes from a mean dilatation."""
SHEAR = wp.constant(15)
"""G of each Maxwell branch [Pa], …"""
BULK = wp.constant(17)
"""… K [Pa], …"""
RELAXATION = wp.constant(19)
"""… and T [s]."""
CONSISTENCY = wp.constant(21)
"""K_c of a liquid [Pa sⁿ]."""
MATERIAL_COLUMNS = 22

# Rows of ``Sheet.loss``; each is spread over LANES places, so that threads rarely collide.
LOSS_PLASTIC = wp.constant(0)
LOSS_VISCOUS = wp.constant(1)
LOSS_PUSH_WORK = wp.constant(2)
LOSS_FRICTION = wp.constant(3)
LOSS_IMPACT = wp.constant(4)
LOSS_LANES = wp.constant(256)

vec6 = wp.types.vector(length=6, dtype=wp.float32)
vec14 = wp.types.vector(length=14, dtype=wp.float32)
BRANCHES, BRANCH_CHANNELS = wp.constant(constants.BRANCHES), wp.constant(7)
"""Maxwell branches of a particle; numbers that each remembers: its strain (6) and θ."""
D = wp.float64


@wp.struct
class StepGlobals:
    """What one step shares: clock, flags, forces, and the books."""

    clock: wp.array(dtype=wp.float64)
    flag: wp.array(dtype=wp.int32)
    fast: wp.array(dtype=wp.float32)
    """Largest speed and largest wave speed of what can deform [m/s]: in this step, in the last."""
    change: wp.array(dtype=wp.float32)
    """Largest change of a contact's velocity in this sweep [m/s]."""
    pace: wp.array(dtype=wp.float64)
    """Nesterov's t and momentum, whether the last sweep went back, and momentum of this one."""
    loss: wp.array2d(dtype=wp.float64)
    gravity: wp.vec3d
    ramp: wp.float64
    pull: wp.float64
    """Largest acceleration [m/s²]."""
    courant: wp.float64
    longest: wp.float64
    """Longest step that follows every spring [s]."""
    dx: wp.float64
    cell: wp.float32
    push: wp.array(dtype=wp.vec3d)
    """Acceleration of each body [m/s²] …"""
    start: wp.array(dtype=wp.float64)
    end: wp.array(dtype=wp.float64)
    kick: wp.array(dtype=wp.vec3d)
    """Velocity that each body is given in this step [m/s], and …"""
    pushed: wp.array(dtype=wp.vec3d)
    """… the push's part of it."""
    mass: wp.array(dtype=wp.float64)
    particles: int
    """Those that can deform."""
    bodies: int
    planes: int
    plane: wp.array(dtype=wp.vec3d)
    offset: wp.array(dtype=wp.float64)
    external: wp.array(dtype=wp.vec3d)
    plane_impulse: wp.array2d(dtype=wp.vec3d)
    pair_impulse: wp.array2d(dtype=wp.float64)
    impact_of_pair: wp.array2d(dtype=wp.float64)
    first_contact: wp.array2d(dtype=wp.float64)
    last_contact: wp.array2d(dtype=wp.float64)
    contact_point: wp.array2d(dtype=wp.vec3d)
    marked: wp.array2d(dtype=wp.int32)
    """1: the pair met in this step, and …"""
    met: wp.array(dtype=wp.int32)
    """… all that did: rows times their number, plus columns."""
    step_impulse: wp.array2d(dtype=wp.float64)
    """Normal impulse of each pair in this step [N s] …"""
    step_place: wp.array2d(dtype=wp.vec3d)
    """… times where [N s m]."""


@wp.struct
class DeviceParticles:
    """Everything that can deform, sorted by block now and then."""

    count: int
    words: wp.array2d(dtype=wp.int32)
    """What is kept of them, channel by channel: the following up to ``number`` are parts of it."""
    cell: wp.array2d(dtype=wp.int32)
    """Lowest of the particle's 27 nodes …"""
    place: wp.array2d(dtype=wp.float32)
    """… and how far it is from it [cells], in [½, 1½)."""
    velocity: wp.array2d(dtype=wp.float32)
    affine: wp.array2d(dtype=wp.float32)
    """dx C [m/s]."""
    strain: wp.array2d(dtype=wp.float32)
    """F - 1."""
    motion: wp.array2d(dtype=wp.float32)
    """Total deformation gradient - 1, of plastic and granular material."""
    stress: wp.array2d(dtype=wp.float32)
    """-(4/dx) V₀ τ: 00 01 02 11 12 22."""
    mass: wp.array(dtype=wp.float32)
    volume: wp.array(dtype=wp.float32)
    plastic: wp.array(dtype=wp.float32)
    opened: wp.array(dtype=wp.float32)
    branch: wp.array2d(dtype=wp.float32)
    """What Maxwell branches remember."""
    log_volume_ratio: wp.array(dtype=wp.float32)
    """Of nearly incompressible material: ln of its mean volume over its own …"""
    pressure: wp.array(dtype=wp.float32)
    """… Kirchhoff pressure of that mean [Pa] …"""
    cluster: wp.array(dtype=wp.int32)
    """… the group of particles it is taken over in this step …"""
    grown: wp.array(dtype=wp.float32)
    """… dilatation of its own in this step …"""
    bound: wp.array(dtype=wp.float32)
    """… and bound on ρ c² without the mean [Pa]."""
    kind: wp.array(dtype=wp.int32)
    field: wp.array(dtype=wp.int32)
    number: wp.array(dtype=wp.int32)
    home: wp.array(dtype=wp.int32)
    """Block of ``cell``; -1: not looked up since it changed."""
    rank: wp.array(dtype=wp.int32)
    """Number within its block, while particles are sorted, and …"""
    spare: wp.array2d(dtype=wp.int32)
    """… room for some of their channels."""
    lost: wp.array(dtype=wp.int32)
    table: wp.array2d(dtype=wp.float32)


@wp.struct
class BlockGrid:
    """Node blocks of 4³ of all fields, found by hashing (field, block)."""

    keys: wp.array(dtype=wp.int64)
    slots: wp.array(dtype=wp.int32)
    mask: int
    room: int
    """Blocks there is memory for."""
    fields: int
    where: wp.array(dtype=wp.vec3i)
    field: wp.array(dtype=wp.int32)
    near: wp.array(dtype=wp.int32)
    """Eight per block: itself and its neighbours at +1; -1: absent."""
    partner: wp.array(dtype=wp.int32)
    """FIELDS_AT_NODE per block: blocks of other fields at the same place, by field; -1: no more."""
    seen: wp.array(dtype=wp.int32)
    """1: fields meet in this block; 2: more than one does."""
    held_by: wp.array(dtype=wp.int32)
    """Particles sorted into each block …"""
    first: wp.array(dtype=wp.int32)
    """… and the first of them."""
    task_home: wp.array(dtype=wp.int32)
    """Of each task: its block …"""
    task_first: wp.array(dtype=wp.int32)
    task_last: wp.array(dtype=wp.int32)
    """… and its particles, from the first to before the last."""
    arena: wp.array(dtype=wp.float32)
    """Sums and lists of a group where it has no memory of its own, on the processor."""
    sum: wp.array(dtype=wp.float32)
    """Mass [kg], momentum and impulse [kg m/s] of nodes: see ``arena.h``; 0 between steps."""
    node: wp.array(dtype=wp.vec4)
    """Mass [kg] and velocity [m/s]."""
    old: wp.array(dtype=wp.vec4)
    """Velocity without the step's forces [m/s]."""
    pool: wp.array2d(dtype=wp.float32)
    """Eight clusters of 2³ cells per block: volume, and volume times pressure and dilatation, of nearly incompressible
    material.
    """
    meet: wp.array(dtype=wp.int32)
    """1 + the field's entry where it meets others; 0: none."""
    was: wp.array(dtype=wp.int32)
    """1 + the first kept choice of the field's node; 0: none."""
    held: wp.array(dtype=wp.int32)
    """1 + the frame that holds the node; 0: none."""
