"""``python -m corporeal`` does as ``corporeal``."""

from corporeal.cli import main

if __name__ == "__main__":
    main()
