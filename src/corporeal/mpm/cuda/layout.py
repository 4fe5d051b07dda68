"""Structs that the kernels of the device engine share: particles, grid, rigid bodies, contacts.

Plain Warp, so that the same kernels run on a CUDA card and on the processor. Every kernel loops
over its items with a stride: it is launched with as many threads as the device keeps busy, and
the number of items may change on the device without a word to the host.
"""

from corporeal.mpm import constants
from corporeal.mpm.warp_start import wp

wp.set_module_options({"enable_backward": False})

EMPTY = wp.constant(wp.int64(-1))

# What ``Sheet.flag`` holds.
GOING = wp.constant(0)
"""1: take another step."""
BLOCKS = wp.constant(1)
"""Blocks in use."""
FULL = wp.constant(2)
"""1: too few blocks; 2: too little room for contacts. The step was not taken."""
LOST = wp.constant(3)
"""1: a particle is not finite or left the domain."""
FRESH = wp.constant(4)
"""1: blocks were added since they were linked."""
MEETS = wp.constant(5)
TOUCHES = wp.constant(6)
STIFF = wp.constant(7)
"""Contacts that rigid bodies take part in."""
HITS = wp.constant(8)
"""1: something rigid bounces in this step; 2: rigid bodies lie on one another."""
SWEEPING = wp.constant(9)
SWEPT = wp.constant(10)
"""Sweeps of this step so far."""
IMPACTING = wp.constant(11)
"""1: rounds of impacts go on, of which the last is of all contacts."""
STRUCK = wp.constant(12)
"""1: some rigid pair is hit as things move now."""
ROUND = wp.constant(13)
"""Rounds of this step so far."""
LAST_ROUND = wp.constant(14)
KEPT = wp.constant(15)
"""Choices of candidate normals of the last step; 0 where all are made anew."""
ASKED = wp.constant(16)
"""1: some are made anew in this step."""
NODES = wp.constant(17)
"""Contacts on nodes: those on surface points come after them."""
HOLDS = wp.constant(18)
"""1: in this round of impacts something is held from behind."""
FLAGS = 19
# What ``Contacts.active`` says, where it is not 0: not in this step.
WAITING = wp.constant(1)
"""Not in this round of impacts."""
SWEPT_NOW = wp.constant(2)


# What ``Sheet.clock`` holds.
TIME = wp.constant(0)
UNTIL = wp.constant(1)
DT = wp.constant(2)
COUNT = wp.constant(3)
SMALLEST = wp.constant(4)
LARGEST = wp.constant(5)
STABLE = wp.constant(6)
"""Largest stable step as of now [s]."""
LAST = wp.constant(7)
"""1: this step ends exactly at UNTIL."""
FORCED = wp.constant(8)
"""1: one step to UNTIL, stable or not."""
CLOCK = 9

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
BODY = wp.constant(13)
SWELLS = wp.constant(14)
"""1: pressure comes from a mean dilatation."""
SHEAR = wp.constant(15)
"""G of each Maxwell branch [Pa], …"""
BULK = wp.constant(17)
"""… K [Pa], …"""
RELAXATION = wp.constant(19)
"""… and T [s]."""
CONSISTENCY = wp.constant(21)
"""K_c of a liquid [Pa sⁿ]."""
COLUMNS = 22

# Rows of ``Sheet.loss``; each is spread over LANES places, so that threads rarely collide.
PLASTIC = wp.constant(0)
VISCOUS = wp.constant(1)
PUSHING = wp.constant(2)
RUBBING = wp.constant(3)
STRIKING = wp.constant(4)
LANES = wp.constant(256)

vec6 = wp.types.vector(length=6, dtype=wp.float32)
vec14 = wp.types.vector(length=14, dtype=wp.float32)
BRANCHES, BRANCH = wp.constant(constants.BRANCHES), wp.constant(7)
"""Maxwell branches of a particle; numbers that each remembers: its strain (6) and θ."""
D = wp.float64


@wp.struct
class Sheet:
    """What one step shares: clock, flags, forces, and the books."""

    clock: wp.array(dtype=wp.float64)
    flag: wp.array(dtype=wp.int32)
    fast: wp.array(dtype=wp.float32)
    """Largest speed and largest wave speed of what can deform [m/s]: in this step, in the last."""
    change: wp.array(dtype=wp.float32)
    """Largest change of a contact's velocity in this sweep [m/s]."""
    pace: wp.array(dtype=wp.float64)
    """Nesterov's t and momentum, and whether the last sweep went back on its way."""
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
    bodies: int
    planes: int
    plane: wp.array(dtype=wp.vec3d)
    offset: wp.array(dtype=wp.float64)
    external: wp.array(dtype=wp.vec3d)
    plane_impulse: wp.array2d(dtype=wp.vec3d)
    pair_impulse: wp.array2d(dtype=wp.float64)
    first_contact: wp.array2d(dtype=wp.float64)
    last_contact: wp.array2d(dtype=wp.float64)
    contact_point: wp.array2d(dtype=wp.vec3d)
    step_impulse: wp.array2d(dtype=wp.float64)
    """Normal impulse of each pair in this step [N s] …"""
    step_place: wp.array2d(dtype=wp.vec3d)
    """… times where [N s m]."""


@wp.struct
class Particles:
    """Everything that can deform, sorted by block now and then."""

    count: int
    cell: wp.array(dtype=wp.vec3i)
    """Lowest of the particle's 27 nodes …"""
    place: wp.array(dtype=wp.vec3)
    """… and how far it is from it [cells], in [½, 1½)."""
    velocity: wp.array(dtype=wp.vec3)
    affine: wp.array(dtype=wp.mat33)
    """dx C [m/s]."""
    strain: wp.array(dtype=wp.mat33)
    """F - 1."""
    motion: wp.array(dtype=wp.mat33)
    """Total deformation gradient - 1, of plastic and granular matter."""
    stress: wp.array(dtype=vec6)
    """-(4/dx) V₀ τ: 00 01 02 11 12 22."""
    mass: wp.array(dtype=wp.float32)
    volume: wp.array(dtype=wp.float32)
    plastic: wp.array(dtype=wp.float32)
    opened: wp.array(dtype=wp.float32)
    branch: wp.array(dtype=vec14)
    """What Maxwell branches remember."""
    relief: wp.array(dtype=wp.float32)
    """Of nearly incompressible matter: ln of its mean volume over its own …"""
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
    lost: wp.array(dtype=wp.int32)
    table: wp.array2d(dtype=wp.float32)


@wp.struct
class Grid:
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
    aware: wp.array(dtype=wp.int32)
    """The same of any block that particles of this one reach."""
    node: wp.array(dtype=wp.vec4)
    """Mass [kg] and momentum [kg m/s], then velocity [m/s]."""
    old: wp.array(dtype=wp.vec4)
    """Momentum, then velocity, without forces."""
    pool: wp.array(dtype=wp.vec3)
    """Eight clusters of 2³ cells per block: volume, and volume times pressure and dilatation, of
    nearly incompressible matter."""
    meet: wp.array(dtype=wp.int32)
    """1 + the field's entry where it meets others; 0: nobody."""
    was: wp.array(dtype=wp.int32)
    """1 + the first kept choice of the field's node; 0: none."""
    held: wp.array(dtype=wp.int32)
    """1 + the frame that holds the node; 0: none."""


@wp.struct
class Rigid:
    """Rigid bodies, their particles and surface points; arrays of states go by body."""

    stiff: wp.array(dtype=wp.int32)
    """1: the field moves with six degrees of freedom."""
    pointed: wp.array(dtype=wp.int32)
    """1: it meets planes with surface points, not on nodes."""
    light: wp.array(dtype=wp.float64)
    """1/M [1/kg]; 0 where motion is prescribed: then it is as heavy as a wall."""
    path: wp.array2d(dtype=wp.float64)
    """Rows of all paths, one after the other: see ``physics.prescribed``."""
    path_first: wp.array(dtype=wp.int32)
    path_count: wp.array(dtype=wp.int32)
    """Rows of each body's path; 0: it moves freely."""
    path_arm: wp.array(dtype=wp.vec3d)
    heavy: wp.array(dtype=wp.mat33d)
    """Inertia at the start of what has a prescribed motion [kg m²] …"""
    heading: wp.array(dtype=wp.mat33d)
    """… and how it is turned when the step ends."""
    centre: wp.array(dtype=wp.vec3d)
    turn: wp.array(dtype=wp.mat33d)
    rest: wp.array(dtype=wp.mat33d)
    """I⁻¹ of the body as it started [1/(kg m²)]."""
    speed: wp.array(dtype=wp.vec3d)
    moment: wp.array(dtype=wp.vec3d)
    inertia: wp.array(dtype=wp.mat33d)
    """I⁻¹ now."""
    spin: wp.array(dtype=wp.vec3d)
    radius: wp.array(dtype=wp.float64)
    speed_change: wp.array(dtype=wp.vec3d)
    moment_change: wp.array(dtype=wp.vec3d)
    last_speed: wp.array(dtype=wp.vec3d)
    last_moment: wp.array(dtype=wp.vec3d)
    busy: wp.array(dtype=wp.int32)
    """Contacts that share the body in this sweep."""
    lost: wp.array(dtype=wp.int32)
    count: int
    body: wp.array(dtype=wp.int32)
    arm: wp.array(dtype=wp.vec3d)
    mass: wp.array(dtype=wp.float32)
    volume: wp.array(dtype=wp.float32)
    cell: wp.array(dtype=wp.vec3i)
    place: wp.array(dtype=wp.vec3)
    home: wp.array(dtype=wp.int32)
    surfaces: int
    surface_body: wp.array(dtype=wp.int32)
    surface: wp.array(dtype=wp.vec3d)
    rounding: wp.array(dtype=wp.float64)
    """How the surface curves at each, one row after the other: see ``types.ROUNDING``."""
    bends: wp.array(dtype=wp.int32)
    """Of each body: whether it curves outwards or inwards anywhere."""
    facets: int
    facet: wp.array(dtype=wp.float64)
    """Flat faces of all bodies, one row after the other: see ``physics.facets`` …"""
    facet_point: wp.array(dtype=wp.vec3d)
    """… points on them …"""
    facet_body: wp.array(dtype=wp.int32)
    """… and whose each is."""
    first: wp.array(dtype=wp.int32)
    """Of each body: its first surface point …"""
    points: wp.array(dtype=wp.int32)
    """… and how many it has; 0 for what deforms."""
    spacing: wp.array(dtype=wp.float64)
    """Distance of its surface points [m]."""
    thin: wp.array(dtype=wp.int32)
    """See ``physics.rigid.thinness``; 0 for what deforms."""
    wetted: wp.array(dtype=wp.vec3d)
    """Points that liquids touch, each followed by its normal."""
    wetted_first: wp.array(dtype=wp.int32)
    """Of each body: its first such point …"""
    wetted_count: wp.array(dtype=wp.int32)
    """… and how many it has."""
    pours: wp.array(dtype=wp.int32)
    """1: the body is liquid."""
    full: wp.array(dtype=wp.float32)
    """Mass of a cell full of the body [kg]."""
    flows_by: wp.array(dtype=wp.vec3d)
    """Flow curve of a liquid at a wall: see ``physics.wall_stress``."""


@wp.struct
class Loads:
    """What acts on single particles, wind and tethers; and joints of rigid bodies."""

    blown: wp.array(dtype=wp.vec3)
    """What wind and grips give each particle in this step [N s], in the order of ``Particles`` …"""
    pulled: wp.array(dtype=wp.vec3)
    """… and what its tether does."""
    wind_force: wp.array(dtype=wp.vec3d)
    """What the wind gives each rigid body [N s] …"""
    wind_moment: wp.array(dtype=wp.vec3d)
    """… about its centre [N m s] …"""
    force: wp.array(dtype=wp.vec3d)
    """… and what tethers do [N s] …"""
    moment: wp.array(dtype=wp.vec3d)
    """[N m s]"""
    external: wp.array(dtype=wp.vec3d)
    """Of wind and grips on each body [N s]."""
    loss: wp.array(dtype=wp.float64)
    """What dampers of tethers and joints took in this step [J]."""
    at: wp.array(dtype=wp.int32)
    """Where the particle of a number is now."""
    air: wp.array(dtype=wp.vec3d)
    """Velocity of each body's wind [m/s], and …"""
    gust: wp.array(dtype=wp.float64)
    start: wp.array(dtype=wp.float64)
    end: wp.array(dtype=wp.float64)
    """… its swell and window; end before start: none."""
    octave: wp.array(dtype=wp.vec3d)
    """Share, frequency [Hz] and phase [rad] of a gust's parts."""
    faces: int
    face: wp.array(dtype=wp.int32)
    """Number of the particle that each face moves with."""
    face_body: wp.array(dtype=wp.int32)
    area: wp.array(dtype=wp.vec3)
    """Outward, at rest [m²]."""
    arm: wp.array(dtype=wp.vec3d)
    """Of a rigid body's face, from its centre [m]."""
    weight: wp.array(dtype=wp.float32)
    """Mass of the face's particle [kg]."""
    tethers: int
    tied: wp.array(dtype=wp.int32)
    """Number of a tethered particle."""
    holder: wp.array(dtype=wp.int32)
    anchor: wp.array(dtype=wp.vec3d)
    """Where it started, from the holder's centre [m]."""
    rate: wp.array(dtype=wp.float64)
    damping: wp.array(dtype=wp.float64)
    """2 ζ ω [1/s]."""
    joints: int
    first: wp.array(dtype=wp.int32)
    second: wp.array(dtype=wp.int32)
    first_arm: wp.array(dtype=wp.vec3d)
    second_arm: wp.array(dtype=wp.vec3d)
    stiffness: wp.array(dtype=wp.float64)
    friction: wp.array(dtype=wp.float64)
    """Damping [N m s/rad]."""
    gripped: wp.array(dtype=wp.int32)
    """1: the body is pulled by a spring …"""
    target: wp.array(dtype=wp.vec3d)
    """… to here [m] …"""
    spring: wp.array(dtype=wp.float64)
    """… with k [N/m] …"""
    brake: wp.array(dtype=wp.float64)
    """… and c [N s/m] …"""
    grip_mass: wp.array(dtype=wp.float64)
    """… that move so much at once [kg] …"""
    grip_arm: wp.array(dtype=wp.vec3d)
    """… at this place of a rigid body, in its own frame [m] …"""
    share: wp.array(dtype=wp.float32)
    """… or by this share at each particle, by its number."""
    hand: wp.array(dtype=wp.vec3d)
    """Where each body that bends is held now [m], and …"""
    hand_speed: wp.array(dtype=wp.vec3d)
    """… how fast that moves [m/s]."""


@wp.struct
class Bonds:
    """Rigid frames and the soft bodies' nodes that they hold; sums go by body."""

    count: int
    frame: wp.array(dtype=wp.int32)
    soft: wp.array(dtype=wp.int32)
    stiff_density: wp.array(dtype=wp.float64)
    soft_density: wp.array(dtype=wp.float64)
    framing: wp.array(dtype=wp.int32)
    """1: the body is a frame."""
    mass: wp.array(dtype=wp.float64)
    lever: wp.array(dtype=wp.vec3d)
    """Σ m r from the frame's centre [kg m]."""
    momentum: wp.array(dtype=wp.vec3d)
    moment: wp.array(dtype=wp.vec3d)
    spread: wp.array(dtype=wp.mat33d)
    """Σ m r rᵀ [kg m²]."""
    centre: wp.array(dtype=wp.vec3d)
    """The frame's own centre, and …"""
    inertia: wp.array(dtype=wp.mat33d)
    """… inverse inertia, while it stands for the whole."""


@wp.struct
class Contacts:
    """Nodes where fields meet, FIELDS_AT_NODE entries for each, and the touches of pairs there."""

    room: int
    """Meets there is memory for; touches: twice as many."""
    at: wp.array(dtype=wp.vec3i)
    number: wp.array(dtype=wp.int32)
    first: wp.array(dtype=wp.int32)
    last: wp.array(dtype=wp.int32)
    stiff: wp.array(dtype=wp.int32)
    field: wp.array(dtype=wp.int32)
    slot: wp.array(dtype=wp.int32)
    mean: wp.array(dtype=wp.vec3)
    """X: mass times offset from the node [kg m]."""
    outward: wp.array(dtype=wp.vec3)
    velocity: wp.array(dtype=wp.vec3d)
    last_velocity: wp.array(dtype=wp.vec3d)
    light: wp.array(dtype=wp.float64)
    """1/m [1/kg]."""
    meet: wp.array(dtype=wp.int32)
    """Of a touch; -1: a surface point."""
    a: wp.array(dtype=wp.int32)
    """Entry the normal points away from …"""
    c: wp.array(dtype=wp.int32)
    """… and to; -1 - plane: a plane."""
    candidate: wp.array(dtype=wp.mat33)
    far_a: wp.array(dtype=wp.float32)
    far_c: wp.array(dtype=wp.float32)
    pick: wp.array(dtype=wp.int32)
    """The candidate that is kept from the last step; -1: none is."""
    chosen: wp.array(dtype=wp.vec3)
    kept_at: wp.array(dtype=wp.vec3i)
    """Choices that the next step finds, those of a node and field next to one another: node …"""
    kept_fa: wp.array(dtype=wp.int32)
    kept_fc: wp.array(dtype=wp.int32)
    """… fields …"""
    kept_pick: wp.array(dtype=wp.int32)
    """… and candidate; -1: it is not kept."""
    normal: wp.array(dtype=wp.vec3)
    gap: wp.array(dtype=wp.float32)
    fa: wp.array(dtype=wp.int32)
    fc: wp.array(dtype=wp.int32)
    """Fields; B + plane for a plane."""
    facet: wp.array(dtype=wp.int32)
    """Which face of a rigid body a liquid meets."""
    rolls: wp.array(dtype=wp.int32)
    """1: something round may roll on it; of surface points only."""
    instead: wp.array(dtype=wp.float64)
    """Of what is round on what is curved: nodes nearer than this transmit nothing [m]; else 0 …"""
    inward: wp.array(dtype=wp.float64)
    """… and the speed at which a way straight ahead leads into a hollow within a step [m/s]."""
    slips: wp.array(dtype=wp.int32)
    """1: there is no friction in it."""
    span: wp.array(dtype=wp.float64)
    """Over which a wall drags on a liquid that sticks to it [m² s]; 0: Coulomb's friction."""
    point: wp.array(dtype=wp.vec3d)
    active: wp.array(dtype=wp.int32)
    """0: not in this step; ``WAITING`` or ``SWEPT_NOW``."""
    target: wp.array(dtype=wp.float64)
    before: wp.array(dtype=wp.vec3d)
    impulse: wp.array(dtype=wp.vec3d)
    struck: wp.array(dtype=wp.vec3d)
    """Impulses of the rounds before [N s]."""
    last_impulse: wp.array(dtype=wp.vec3d)
    turn: wp.array(dtype=wp.float64)
    apart: wp.array2d(dtype=wp.int32)
    """1: two bodies that are never in contact."""
    rounds: wp.array2d(dtype=wp.float64)
    """Of every pair of bodies and planes in a round of impacts: ``Backing``, backing.h …"""
    lightness: wp.array(dtype=wp.float64)
    """… and inverse masses as it takes them."""
    friction: wp.array2d(dtype=wp.float64)
    restitution: wp.array2d(dtype=wp.float64)
    blows: wp.array2d(dtype=wp.float64)
    """How it changes with the speed of a blow: 5 numbers a pair."""
    rolling: wp.array2d(dtype=wp.float64)
    """c [m]; where nothing brakes what rolls nobody looks."""
    face: wp.array(dtype=wp.float32)
    """Where the face of a half space lies whose mean offset is i/4096 · 1½ - 1½ [dx]."""
