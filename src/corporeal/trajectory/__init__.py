"""What a simulation leaves: frames, checkpoints, the audit and what happened."""
