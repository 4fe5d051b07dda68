"""A scene and its motion in the formats of other tools; nothing of the run is changed."""
