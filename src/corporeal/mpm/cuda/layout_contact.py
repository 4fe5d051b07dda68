"""Struct of contacts: see ``layout``."""

from corporeal.mpm.quiet_warp import wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class DeviceContacts:
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
    """Of every pair of bodies and planes in a round of impacts: ``ImpactSupport``, impact_support.h …"""
    lightness: wp.array(dtype=wp.float64)
    """… and inverse masses as it takes them."""
    friction: wp.array2d(dtype=wp.float64)
    restitution: wp.array2d(dtype=wp.float64)
    restitution_law: wp.array2d(dtype=wp.float64)
    """How it changes with the speed of an impact: 5 numbers a pair."""
    rolling_resistance: wp.array2d(dtype=wp.float64)
    """c [m]; unused without rolling friction."""
    face: wp.array(dtype=wp.float32)
    """Where the face of a half space lies whose mean offset is i/4096 · 1½ - 1½ [dx]."""
