"""Structs of rigid bodies, loads and inclusions: see ``layout``."""

from corporeal.mpm.quiet_warp import wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class DeviceRigidBodies:
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
    curvature: wp.array(dtype=wp.float64)
    """How the surface curves at each, one row after the other: see ``types.CURVATURE_COLUMNS``."""
    bends: wp.array(dtype=wp.int32)
    """Of each body: whether it curves outwards or inwards anywhere."""
    facets: int
    facet: wp.array(dtype=wp.float64)
    """Flat faces of all bodies, one row after the other: see ``physics.facets`` …"""
    facet_point: wp.array(dtype=wp.vec3d)
    """… points on them …"""
    facet_body: wp.array(dtype=wp.int32)
    """… and whose each is …"""
    facet_first: wp.array(dtype=wp.int32)
    """… of each body the first …"""
    facet_count: wp.array(dtype=wp.int32)
    """… and how many."""
    first: wp.array(dtype=wp.int32)
    """Of each body: its first surface point …"""
    points: wp.array(dtype=wp.int32)
    """… and how many it has; 0 for what deforms."""
    spacing: wp.array(dtype=wp.float64)
    """Distance of its surface points [m]."""
    thin: wp.array(dtype=wp.int32)
    """See ``physics.rigid.thinness``; 0 for what deforms."""
    flat: wp.array(dtype=wp.int32)
    """1: rigid, and bounded by flat faces for the most part."""
    edged: wp.array(dtype=wp.int32)
    """1: known to have edges."""
    slim: wp.array(dtype=wp.vec3d)
    """Surface points where a body is thin and not as a whole, see ``physics.rigid`` …"""
    slim_first: wp.array(dtype=wp.int32)
    """… of each body the first …"""
    slim_count: wp.array(dtype=wp.int32)
    """… and how many."""
    wetted_points: wp.array(dtype=wp.vec3d)
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
class DeviceLoads:
    """What acts on single particles, wind and tethers; and joints of rigid bodies."""

    acts: int
    """1: something acts on particles."""
    load_impulse: wp.array2d(dtype=wp.float32)
    """What wind and grips give each particle in this step [N s], in the order of ``Particles`` …"""
    tether_impulse: wp.array2d(dtype=wp.float32)
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
class DeviceBonds:
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
