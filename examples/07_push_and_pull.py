"""Step an engine by hand: kick a ball, read its momentum, then take hold of it and lift it."""

import corporeal as co

IMPULSE = 0.05
"""Of the kick, along x [N s]."""
REACH = 0.05
"""How far above the ball's centre the hand is [m]."""


def main() -> float:
    """Return the momentum along x right after the kick over the impulse that was given."""
    ball = co.ball("rubber", radius=0.04, at=(0, 0, 0.1))
    engine = co.build_engine(co.pose_problem(co.prepare_scene(co.build_scene(ball, gravity=(0, 0, 0)))))
    engine.advance(0.01)
    engine.apply_impulse(0, (0.0, 0.0, 0.1), (IMPULSE, 0.0, 0.0))
    engine.advance(0.03)
    given = float(engine.measure().momentum[0, 0])
    x, y, z = engine.measure().centre[0]
    engine.stop([0])
    engine.attach_spring(0, (x, y, z), (x, y, z + REACH), stiffness=200.0)
    engine.advance(0.5)
    lifted = engine.measure().centre[0, 2] - z
    print(f"kicked: {given:.4f} of {IMPULSE:.4f} N s; then lifted by {100 * lifted:.1f} cm")
    return given / IMPULSE


if __name__ == "__main__":
    main()
