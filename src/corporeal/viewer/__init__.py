"""The web viewer's server: browse runs, interact with a live simulation, upload files."""
