"""Plan, assemble, run and report many scenes."""
