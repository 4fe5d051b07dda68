"""Masks of objects in posed photographs, from colours and the visual hull; no weights needed."""
