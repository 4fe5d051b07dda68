"""What is said of a scene: by its file, by a person, by a model."""
