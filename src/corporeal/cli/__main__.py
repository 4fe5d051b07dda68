"""``python -m corporeal.cli`` does as ``corporeal``."""

from corporeal.cli import main

main()
