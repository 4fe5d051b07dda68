"""From things in the air to a scene at rest."""
