"""The stages of a run in their order, their settings, and the results that they keep."""
