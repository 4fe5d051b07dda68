"""Running an engine: frames, checkpoints, fracture, conservation audit and outcome."""
