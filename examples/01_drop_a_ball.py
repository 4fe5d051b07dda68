"""A rubber ball in six lines, and how much of its fall it comes back."""

import corporeal as co


def main() -> float:
    """Return the height of the rebound over the height of the fall."""
    ball = co.ball("rubber", radius=0.03, at=(0, 0, 0.28))
    played = co.simulate_scene(co.build_scene(ball, duration=0.5))
    row = played.outcome.objects["ball"]
    print(f"fell {row.fall_m:.3f} m, rose {row.rebound_m:.3f} m")
    return row.rebound_ratio


if __name__ == "__main__":
    main()
