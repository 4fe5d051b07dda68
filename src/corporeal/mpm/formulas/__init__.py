"""The formulas of the fast engines in C++, each once: eight lanes on processors, one on GPUs.

The headers beside this file are templates on the number type (``lanes.h``). Warp includes them in every module that was
given ``formula_options``, whatever the module is compiled for.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from corporeal.core.types import Law
from corporeal.mpm import constants, laws
from corporeal.mpm.quiet_warp import wp

FORMULAS_FOLDER = Path(__file__).parent.resolve()
HEADERS = tuple(sorted(path.name for path in FORMULAS_FOLDER.glob("*.h")))


def cpp_preamble() -> str:
    """C++ text in front of a module: the numbers of laws and method, then all formulas."""
    numbers = ", ".join(f"{law.name} = {law.value}" for law in Law)
    kinds = f"namespace mpm {{ enum Law {{ {numbers} }}; }}"
    lines = [kinds, *cpp_law_lists(), *(f'#include "{name}"' for name in HEADERS)]
    return constants.cpp_constants() + "".join(f"{line}\n" for line in lines)


def cpp_law_lists() -> list[str]:
    """C++ lists of laws, X(NUMBER) for each, from which ``laws.h`` chooses: written from the menu.

    Raises:
        ImportError: A law of the menu is not in ``laws.h``.
    """
    written = set(re.findall(r"struct Rule<(\w+), R>", (FORMULAS_FOLDER / "laws.h").read_text()))
    for law in Law:
        if law.name not in written:
            raise ImportError(
                f"types.Law has {law.name}, but formulas/laws.h has no struct Rule<{law.name}, R>. "
                "Write its formulas there: "
                "docs/how-to/add-a-law-material-provider-or-format.md says how."
            )
    menu = laws.CONSTITUTIVE_LAWS
    groups = {
        # Hencky's stress is shared with all that flow, and so is not on the first list.
        "MPM_ELASTIC": [k for k in Law if not menu[k].flows and k is not Law.HENCKY],
        "MPM_PLASTIC": [k for k in Law if menu[k].flows],
        "MPM_LIQUID": [k for k in Law if menu[k].liquid],
        "MPM_BULKY": [k for k in Law if menu[k].volumetric],
    }
    return [f"#define {name}(X) " + " ".join(f"X(mpm::{k.name})" for k in members) for name, members in groups.items()]


def formula_options(*headers: Path, numbers: Mapping[str, int] | None = None, **others: Any) -> dict[str, Any]:
    """Options of a Warp module that uses the formulas.

    Args:
        headers: Headers of the module's own, after those of the formulas.
        numbers: What they know by name in ``namespace mpm``.
        others: More options of ``wp.set_module_options``.
    """
    folders = [str(folder) for folder in (FORMULAS_FOLDER, *(header.parent for header in headers))]
    text = cpp_preamble() + constants.cpp_definitions(numbers or {})
    text += "".join(f'#include "{header.name}"\n' for header in headers)
    build = wp.ModuleBuildOptions(
        extra_cpu_include_dirs=folders,
        extra_cuda_include_dirs=folders,
        extra_cpu_preamble=text,
        extra_cuda_preamble=text,
        extra_build_dependencies=[*(str(FORMULAS_FOLDER / name) for name in HEADERS), *map(str, headers)],
    )
    return {"enable_backward": False, "extra_build_options": build, **others}
