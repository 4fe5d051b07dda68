"""Compare rules for an impact on what rests on a floor with fine springs in one dimension.

python benchmarks/squeezed.py
"""

import numpy as np
from laws.squeezed import RULES, cases, errors
from rich.console import Console
from rich.table import Table


def main() -> None:
    """Print how far each rule is off, over masses, stiffness and restitution."""
    table = Table("rule", "stiffness from", "mean", "95 % within", "worst", "within .05")
    for least in (1.0, 10.0):
        given = cases(least)
        for rule in RULES:
            off = np.abs(errors(rule, given))
            numbers = off.mean(), np.quantile(off, 0.95), off.max(), (off < 0.05).mean()
            table.add_row(rule, f"{least:g}", *(f"{n:.3f}" for n in numbers))
    Console().print(table)


if __name__ == "__main__":
    main()
