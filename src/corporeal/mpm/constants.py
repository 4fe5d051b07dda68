"""Numerical constants of the method.

NumPy code imports them, GPU kernels compile them in, and C++ code finds them in ``namespace mpm``: ``cpp_constants``
writes it. They apply to all engines. Numbers of one constitutive law stand with the law, coefficients of a formula in
the formula. A cell is dx long.
"""

from collections.abc import Mapping

from corporeal.core import types

# ---------------------------------------------------------------- how long a step may be

COURANT = 0.4
"""Largest fraction of a cell that a wave may cross in one step [-]; the default of a problem."""
RIGID_COURANT = 0.05
"""Largest fraction of a cell that a rigid body may cross in one step [-]."""
FREE_FALL_STEP_FRACTION = 0.1
"""Largest step as a fraction of the time √(dx/g) in which a body at rest falls half a cell [-]."""
MAX_STEP_S = 1.0
"""[s]; where nothing else limits the step."""
STEP_ROUNDING = 1e-9
"""Share of a step by which a time may be missed before one more step is taken [-]."""
TETHER_STEP_FRACTION = 0.05
"""Longest step as a fraction of 1/ω of a tether [-]: its energy swings by ω dt/2."""
JOINT_STEP_FRACTION = 0.2
"""Longest step as a fraction of 1/ω of a joint [-], which is implicit."""

# ---------------------------------------------------------------- what left the domain

MAX_WALL_DEPTH_DX = 8.0
"""A particle, or all of a rigid body, deeper than this in a wall [cells] has left the domain."""
MAX_DISTANCE_FROM_ORIGIN_DX = 1e5
"""A particle farther than this from the origin [cells] has left the domain."""
MAX_TRAVEL_PER_STEP_DX = 1e4
"""A particle that goes farther than this in one step [cells] is lost; checked on GPUs, where a larger number of cells
would not fit the integer that counts them.
"""
MAX_FINITE_VALUE = 1e9
"""A larger velocity [m/s], velocity gradient or strain is as good as infinite where a lost particle is looked for."""

# ---------------------------------------------------------------- as good as nothing, or infinite

TINY = 1e-30
"""Single precision: what is smaller counts as zero, and divisors are at least this [any unit]."""
VAST = 1e30
"""Single precision: what is larger counts as infinite; where a search for a least one begins."""
TINY_DOUBLE = 1e-300
"""The same of divisors in double precision."""
VAST_DOUBLE = 1e300
"""The same of what counts as infinite there."""
MIN_NODE_MASS_KG = 1e-30
"""Nodes with less mass [kg] are empty."""
MIN_SLIP_SPEED = 1e-14
"""Slower slip [m/s] has no direction."""
MIN_ROTATION_SINE = 1e-12
"""Rotations whose sine is smaller have no axis: half their antisymmetric part is the vector."""
SMALL_ROTATION_RAD = 1e-6
"""Rotations by less [rad] follow the series of sine and cosine, exact to their last digit there."""
MIN_HALF_SPACE_WEIGHT = 1e-12
"""Of a half space in a node's spline, whose mean offset is then where its face lies."""
RANK_CUTOFF = 1e-12
"""Principal moments of inertia below this share of the largest are none: a line has no spin."""

# ---------------------------------------------------------------- what a grid cannot see

FLIP_DAMPING_FRACTION = 0.1
"""κ [-]: a body forgets what its grid cannot see at this fraction of its wave speed per cell."""
GRANULAR_DAMPING_FRACTION = 0.5
"""How often granular material forgets while it falls half a cell, in √(dx/g) [-] (decision laws-sand)."""
LOCAL_BULK_RATIO = 4.0
"""λ/μ [-], at ν = 0.4: of nearly incompressible material what λ exceeds it by acts on the mean dilatation of a cluster
of particles, not on each one's own volume (decision laws-mean-dilatation).
"""
BULK_ROUNDING_FRACTION = 1e-6
"""Share by which λ must exceed that for material to be so at all: ν of 0.4 in single precision is not [-].
"""
MIN_VOLUME_RATIO = 1e-3
"""J of what is pressed flat or turned inside out, where pressure is a mean [-]."""
MAX_POISSON_RATIO = 0.49
"""Nearly incompressible bodies are simulated at this Poisson's ratio [-], with their true μ."""
MIN_REDUCED_POISSON_RATIO = 0.41
"""Where steps do not suffice the bulk gives way first, down to this Poisson's ratio [-]: pressure is still a mean there
(``LOCAL_BULK_RATIO``), waves run at 0.37 of the speed that they have at 0.49."""
BASELINE_COURANT, BASELINE_STEP_S = 0.5, 1e-4
"""Of the published cap on stiffness: its Courant number [-] and its step [s]."""

# ---------------------------------------------------------------- contact: where, and which way

MAX_FACE_DEPTH_DX = 1.25
"""Faces farther than this from the node [cells] are treated as if they were here."""
WALL_REACH = 0.51
"""Nodes higher than this above a wall [cells] ignore it: its infinite mass would grip the inside. Half a cell, and a
hundredth so that rounding does not decide about nodes at exactly half a cell."""
SHELL_WALL_REACH_DX = 1.5
"""A wall holds a shell at all nodes up to this high above it [cells], as nothing within a layer hands on what only the
lowest nodes bear …"""
MAX_LAYER_DEVIATION_DX = 0.2
"""… where the standard deviation of its vertices across the wall is below this [cells]: it is a layer along the wall,
and does not stand on it."""
LAYER_DEVIATION_DX = 0.05
"""What lies within this about a plane [cells] shows a node a layer, whose normal is that of the plane, …"""
MIN_LAYER_COSINE, FULL_LAYER_COSINE = 0.6, 0.9
"""… where the normal of a contact is less than this away from it [-]: from the second on it is the layer's. Others are
contacts of its rim."""
SURFACE_POINT_REACH_DX = 0.3
"""Surface points of rigid bodies are watched this far above a wall [cells]."""
CURVATURE_ROW = types.CURVATURE_COLUMNS
"""Numbers that say how a surface curves at a point."""
MIN_ARC_COMPONENT = 0.1
"""A direction whose part in the plane of an arc is shorter than this has none there [-]."""
MAX_ARC_ANGLE_RAD = 1.57
"""Nothing stands for a surface that looks farther aside from its own normal than this [rad]."""
FACET_ROW = 11
"""Numbers of a rigid body's flat face: see ``physics/flat_facets.py``."""
FACET_MIN_NORMAL_COSINE, FACET_MAX_HEIGHT_RATIO = 0.9998, 0.02
"""Points of one flat face have normals with at least this cosine [-], and differ in height by less than this, over how
far it goes on from each [-]."""
MIN_POINTS_PER_FACET = 6
"""Fewer points are no face on which anything rolls."""
FACET_SPREAD_RATIO = 0.5
"""A face goes on from its points by this share of what they stand for [-]: a point's distance from the next."""
FACET_HOLE_RATIO = 0.8
"""A hole between a face's points whose middle is no farther from them than this, over what they stand for [-], is of
their scatter and belongs to the face."""
MIN_FLAT_SURFACE_FRACTION = 0.67
"""A body of flat faces has more than this share of its surface points on some [-]. Where two such bodies meet, surface
points say where they begin, however thick they are …"""
FLAT_BODY_GAP_DX = 1.2
"""… unless means alone say that they are farther apart than this [cells]: those misjudge the gap of what is thicker
than ``THIN_BODY_DX`` by less."""
PARALLEL_EDGE_SINE2 = 0.01
"""Edges of two bodies at a node are parallel if the squared sine between them is below this [-]."""
FACET_REPLACES_NODES_DX = 2.0
"""What is round meets a flat face exactly, and not on nodes that are nearer to there than this [cells] and √(r dx/2 + 9
dx²): beyond, the gap of a ball of radius r is larger than what nodes misjudge, as they take it for a plane within the 3
cells that each sees …"""
FACET_NORMAL_COSINE = 0.95
"""… and on which they meet along nearly the same normal: the least cosine [-]. On what is ``THIN_BODY_DX`` normals of
nodes lean, since mass lies around them on both sides: there ``CURVED_NORMAL_COSINE`` counts.
"""
OPPOSED_FACES_COSINE = 0.5
"""Where normals of nodes lean farther than ``FACET_NORMAL_COSINE`` from all faces, around edges of both bodies, they
are of two that look at one another so nearly and lean no farther than that [-].
"""
FACE_SCATTER_DX = 0.03
"""What a node sees aside of a face is no edge, but the scatter of particles [cells]."""
VALLEY_ITERATIONS = 6
"""How often a normal of a face is taken off that of a node, to see whether that lies between such normals: what is
round and lies in a valley meets the faces, and not nodes that see both."""
MIN_CENTRE_DISTANCE_RATIO = 0.05
"""Least distance of what meets a hollow from its centre of curvature, over the radius [-]: at the centre all of the
hollow is equally near."""
CURVED_PATCH_RATIO = 0.8
"""How far from a surface point its curvature describes the face, over the point's reach [-]: far enough that these
patches leave no part of a face uncovered."""
CURVED_CONTACT_ITERATIONS = 4
"""Iterations for the place where something round touches a curved face, which depends on the
face's normal there."""
NEAREST_POINT_FACTOR = 1.1
"""A contact belongs to its surface point if no other is nearer to it by this factor [-]."""
FACING_POINTS_COSINE = 0.2
"""Surface points of two bodies face each other if their normals have a cosine below minus this."""
CURVED_GAP_ERROR_DX2 = 9.0
"""Twice the error of a gap on grid nodes over the curvature that they neglect [cells²]: within the 3 cells that a node
sees, a curve of curvature k leaves its tangent by k (3 cells)²/2."""
CURVED_NORMAL_COSINE = 0.5
"""Least cosine of normals on nodes around a contact of what is round with what is curved [-]."""
LATTICE_GAP_DX = 0.05
"""What two particles per cell and axis add to the continuous touching distance [cells] …"""
LATTICE_SLOPE = 0.25
"""… and what they add per cell once the face is farther than … [-]"""
LATTICE_START_DX = 0.7
"""… this from the node [cells]; all three fitted to flat faces at that density."""
LATTICE_ROWS = 6
"""Rows of such a lattice within a node's spline."""
THIN_BODY_DX = 2.0
"""A rigid body thinner than this [cells] fills no half space around a node: its surface points say where it begins."""
MIN_THIN_WALL_FRACTION = 0.67
"""So they do for a body of which walls thinner than that are more than this share of its surface; walls are found by
…"""
WALL_SAMPLE_POINTS, FACING_AWAY_COSINE = 400, 0.8
"""… this many points at least, of its surface or all, behind which points have normals with a cosine below minus this
[-]."""
SURFACE_SEARCH_RADIUS_DX = 1.0
"""They are looked at this far from the normal through the node [cells]."""
NODE_SIGHT_DX = 3.0
"""Between two rigid bodies they say so too where one is thin that is not thin as a whole, as near to a node as it sees
[cells]: at the thin end of a wedge. Points that lie farther behind a node are of another wall."""
POINT_RUN_WIDTH_RATIO = 6.0
"""Width of a run of them that is passed over together, over their spacing [-]: some forty."""
NORMAL_CACHE_STEPS = 8
"""Which candidate normal is widest is looked at anew in every so manieth step (decision contact-normal-cache) …"""
NORMAL_CACHE_TRAVEL_DX = 0.5
"""… or two, four or eight times as often, where something moves farther meanwhile [cells]."""
FACE_TABLE_INTERVALS = 4096
"""Intervals of the table that says where the face of a half space lies, from 1½ cells to none."""
SPLINE_DEVIATION_DX = 0.5
"""Standard deviation of all that a node sees along an axis [cells]: of its quadratic spline."""
FIRST_BIAS, OTHER_BIAS = 0.10, 0.05
"""Head start of the candidate normals g_a - g_c, and g_a or -g_c [cells]."""
FIELDS_AT_NODE = 6
"""Fields that may meet at one node on a GPU."""
DENSE_CONTACT_REACH_DX, LOOSE_CONTACT_REACH_DX = 1.25, 1.5
"""Particles of two bodies farther apart than this along an axis [cells] are not in contact. Those of a solid are less
than a cell from one another and touch from 1.14 on, lone grains from 1.5 on."""
REACH_BOUND_FACTOR = 1.00001
"""How much a bound on what a particle reaches exceeds it [-]: rounding leaves no particle out."""

# ---------------------------------------------------------------- contact: what it transmits

IMPACT_PATCH_DX = 0.1
"""Contacts of a hit pair nearer than this [cells] rebound with it: one impact is one event."""
MIN_REBOUND_SPEED = 0.05
"""Slower approaches [m/s] don't rebound, as in other rigid-body engines."""
SWEEPS, IMPACT_SWEEPS = 10, 100
"""Gauss–Seidel sweeps of a step, and of one in which something rigid rebounds or is stacked."""
SWEEP_STRIDE_FRACTION = 0.6180339887498949
"""Contacts are swept in strides of this share of their number [-], the golden section: in the order in which they lie
next to one another the first would carry more, and what rests would tilt."""
SUPPORT_FREQUENCY_RATIO2 = 3.0
"""A body between what strikes it and what it rests on is squeezed at once where the square of its own frequency between
the two is more than this times that of the impact [-] (decision restitution-soft-and-layered) …
"""
SUPPORT_NORMAL_COSINE = 0.5
"""… and what it rests on lies behind it: least cosine of the normal with the impact's [-] …"""
SUPPORT_MASS_RATIO = 0.9
"""… and is no lighter than this share of it [-]."""
LAYER_STIFFNESS_FACTOR = 1.5707963267948966
"""Stiffness E π a²/h of a layer under a disc over that of a half-space, 2 E* a, by a/h: π/2 [-] (decision
restitution-soft-and-layered)."""
SUPPORTED_IMPACT_SWEEPS = 1000
"""Gauss–Seidel sweeps of such a round: what is heavy presses on what is light."""
SIMULTANEOUS_SWEEPS = 30
"""Sweeps of all contacts at once, where those in order do not come to rest and a rigid body meets one that follows a
prescribed path: two that close leave it no room, and the last would have its way.
"""
MAX_RESTING_SPEED = 1e-3
"""Contacts that open faster than this [m/s] rest on nothing."""
MAX_IMPACTS_PER_STEP = 50
"""Most impacts that follow one another within a step, as along a row of touching balls."""
WARM_START_MIN_SWEEPS = 2
"""Fewest sweeps where contacts begin with the forces of the last step."""
SWEEP_TOLERANCE_DX, IMPACT_SWEEP_TOLERANCE_DX = 2e-3, 2e-5
"""Sweeps end when no contact changes its velocity by more than this [cells/s]: stacks that creep slower stand. An
impact is one event, whose error stays in the motion."""
JACOBI_SWEEPS, JACOBI_IMPACT_SWEEPS, JACOBI_SUPPORTED_IMPACT_SWEEPS = 100, 400, 2000
"""The same of Jacobi sweeps on GPUs, which converge more slowly …"""
JACOBI_TOLERANCE_DX = 1e-4
"""… and end where they change less [cells/s]."""

# ---------------------------------------------------------------- what is lost inside of material

BRANCHES = 2
"""Maxwell branches of lossy material."""
LOSS_BAND_LOW_RATIO, LOSS_BAND_HIGH_RATIO = 0.2, 2.0
"""Frequencies between which their loss factor is flat, over that of the slowest vibration [-]: an impact lasts two to
three of its half periods."""
MIN_LOSS_FACTOR = 0.02
"""A smaller loss factor takes less than the grid does, and gets no branches [-]."""
GRID_LOSS_FACTOR = 3.2
"""Loss factor of contact and transfers themselves in an impact, times the square of the number of cells across what is
struck [-]; measured on balls of 8 to 12 cells (decision discretize-effective-stiffness).
"""
MIN_CELLS_FOR_GRID_LOSS = 8.0
"""Where there are fewer cells across, it is taken as with so many [-]."""

# ---------------------------------------------------------------- liquids

SOUND_TO_FLOW_SPEED_RATIO = 10.0
"""Of a liquid's waves over its largest expected speed [-]: its density changes by 1 %."""
LIQUID_SHEAR_TO_BULK_RATIO = 0.125
"""G/K of a liquid's Maxwell branch [-]."""
LIQUID_WALL_REACH_DX = 1.5
"""Nodes of a liquid up to this high over a wall are held too, without friction, where … [cells]"""
HALF_SPACE_TOLERANCE_DX = 0.15
"""… its mean place there is that of a half space within this [cells]: pressure pushes them all, and the wall answers
behind its face alone …"""
MIN_FILLED_FRACTION = 0.4
"""… and it fills this share of what the node sees [-]: what is thin lies on the wall itself. Where a second wall passes
through the node, .42 are left."""
STICKING_FRICTION = 0.5
"""Where friction is at least this, what lies at the wall is not squeezed along it, and higher nodes are not held: a
layer that sticks could not thin [-]."""
WALL_LAYER_DX = 1.0 / 3.0
"""Thickness of the layer through which a wall drags on a liquid that sticks to it [cells], where its stress is shared
among nodes by their splines' weights on the wall (decision liquids-walls-and-vessels)."""
LIQUID_TOUCH_DX = 0.15
"""It does so where the liquid's face is nearer than this by its mean place [cells]."""
WETTED_REACH_DX = 2.0
"""A liquid looks for the surface of a rigid body no farther than this [cells]."""
WETTED_SEARCH_FACTOR = 1.001
"""How much farther it looks in single precision first, which passes over most points [-]."""
WETTED_PATCH_DX = 0.5
"""Points of it count that are farther than the nearest by no more than this [cells] …"""
WETTED_NORMAL_COSINE = 0.7
"""… and whose normals have at least this cosine; what looks another way is another face [-]."""
MAX_WETTED_FACES = 3
"""Faces of one body that a node knows: three meet in a corner."""
MAX_WETTED_POINTS = 512
"""Points of a surface that are looked at for one node, at most."""

# ---------------------------------------------------------------- what bodies are tied to

MIN_FRAME_VOLUME_FRACTION = 0.15
"""A node of a soft field is a rigid frame's where the frame has this share of the volume [-]. Never a half: a face on a
grid plane would be a tie."""
FRAME_LAYER_DX = 2.0
"""Soft material this near to a frame [cells] says how dense what it holds is."""
FRAME_REACH_DX = 6.0
"""Particles of a frame farther than this from what it holds [cells] never share a node with it."""
PARTICLES_PER_CELL = 8
"""Of material at rest."""
JOINT_GAP_FRACTION_PER_STEP = 0.2
"""Share of a joint's gap that is closed in a step [-]."""
GRIP_RADIUS_DX = 2.0
"""Radius of what a grip holds [cells]."""
GRIP_STIFFNESS, GRIP_DAMPING = 0.25, 0.5
"""Most that a step can follow of a grip's k dt²/m and c dt/m [-]."""

# ---------------------------------------------------------------- prescribed motion

KEY_START, KEY_SPAN, KEY_PLACE, KEY_TURN, KEY_FRAME, KEY_ROW = 0, 1, 2, 14, 26, 35
"""Columns of a row of a path, one for each interval: when it begins and how long it lasts [s]; its place [m] and its
turn since then [rad] as cubics in the time since then (3 components, 4 coefficients from the constant on); the rotation
as it begins (9); and how many there are."""

# ---------------------------------------------------------------- air and gravity

GRAVITY = types.GRAVITY_M_S2
"""[m/s²]"""
AIR_DENSITY = 1.2
"""ρ_air at 20 °C and sea level [kg/m³]."""
PLATE_DRAG_COEFFICIENT = 1.17
"""C: pressure on a plate that faces the wind, over ½ ρ u² [-] (Hoerner 1965, ch. 3)."""
GUST_SINES = 8
"""Sines that a gust is made of, half an octave apart …"""
MIN_GUST_FREQUENCY_HZ = 0.25
"""… from this frequency on [Hz]."""

# ---------------------------------------------------------------- how far bodies are apart

PARTICLE_RADIUS_DX = 0.25
"""Of the ball that a particle stands for where distances are measured [cells]."""
OVERLAP_RADIUS_DX = 1.5
"""Radius in which neighbours are counted [cells]; deeper overlap reads as this plus a radius."""
SQUEEZED_VOLUME_RATIO = 0.99
"""Where no particle is below this share of its volume at rest, neighbours are counted instead of their volumes added
up, which is quicker [-]."""
BOUNDING_BOX_DISTANCE_DX = 4.0
"""Bodies farther apart than this [cells] are measured by their bounding boxes."""
OVERLAP_DEPTH_PARTICLES = 8
"""The depth is the mean over so many deepest particles: one cell's worth, against jitter."""

# ---------------------------------------------------------------- shells

MIN_TRIANGLE_QUALITY = 1e-3
"""Least area of a triangle over the square of its longest edge [-]."""
MIN_FIT_SINGULAR_RATIO = 0.1
"""Singular values of the quadratic fit of a triangle's curvature below this fraction of the largest [-] are left out:
neighbours of a triangle that nearly coincide do not tell its curvature."""
QUADRATIC_FIT_SHARE = 0.5
"""Share of the quadratic fit in a triangle's curvature [-]. On irregular meshes it is a few percent too soft, and the
mean of the normals as much too stiff (decision mpm-shells)."""
FIT_RANK_CUTOFF = 1e-9
"""Energies of free angles below this fraction of the largest count as none [-]."""
MIN_SQUARED_STRETCH = 1e-6
"""Squared stretch of a membrane that is pressed flat [-]."""
NEO_HOOKEAN_ITERATIONS = 4
"""Newton iterations for the stretch across a neo-Hookean wall; converged to 1e-10 at stretches of 0.3 to 4."""
NEO_HOOKEAN_ROUNDING = 1e-3
"""Change of its logarithm by which an iteration in single precision is the last one [-]: what is left is the square of
that."""
RETURN_MAP_ITERATIONS = 12
"""Newton iterations of the plane-stress return map."""
RETURN_MAP_ROUNDING = 1e-4
"""Share of the plastic multiplier by which an iteration in single precision changes it when it is the last one [-]:
what is left is the square of that."""

# ---------------------------------------------------------------- how the processor is kept busy

OUT_OF_BLOCK_FRACTION = 0.1
"""Share of a field's particles outside of their blocks from which it is sorted with others [-]."""
POLL_INTERVAL_S = 0.2
"""Computing time after which Python checks for interrupts [s]."""


def constants_by_name() -> dict[str, int | float]:
    """All of them by name."""
    return {name: value for name, value in globals().items() if name.isupper()}


def cpp_constants() -> str:
    """Define all of them in C++."""
    return cpp_definitions(constants_by_name())


def cpp_definitions(given: Mapping[str, int | float]) -> str:
    """Define numbers in C++, in ``namespace mpm``: whole ones as int, others as double."""
    lines = [f"constexpr {cpp_type(v)} {name} = {v!r};" for name, v in given.items()]
    return "\n".join(["namespace mpm {", *lines, "}", ""])


def cpp_type(value: int | float) -> str:
    """Return the C++ type of a number."""
    return "int" if isinstance(value, int) else "double"
