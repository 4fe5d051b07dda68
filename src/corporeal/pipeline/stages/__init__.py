"""The stages of a run: one module and one command each."""
