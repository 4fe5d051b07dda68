"""Object masks of posed photographs without a learned model."""
