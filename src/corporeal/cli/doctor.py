"""Checks of the installation on this machine, with advice."""

import os
import platform
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

from corporeal.core.process_resources import usable_cores
from corporeal.core.version import __version__

API_KEY_VARIABLES = ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GOOGLE_API_KEY")
LIBRARY_USES = {
    "embreex": "videos and pictures",
    "igl": "filling of meshes",
    "DracoPy": "Draco files",
    "pycolmap": "photographs without poses, and videos",
    "pxr": "meshes in USD",
    "lxml": "meshes in 3MF and DAE",
    "collada": "meshes in DAE",
}
PACKAGE_OF_MODULE = {"igl": "libigl", "pxr": "usd-core", "collada": "pycollada"}


@dataclass(frozen=True)
class CheckResult:
    """Result of one check."""

    what: str
    works: bool
    found: str
    advice: str = ""
    """What to do, or what would be gained; empty if nothing."""


def check_installation() -> list[CheckResult]:
    """Check engines, libraries, encoder and keys; a broken part is a result, never an exception."""
    checks: list[Callable[[], list[CheckResult]]] = [_machine, _engines, _libraries, _encoder, _keys]
    return [finding for check in checks for finding in check()]


def _machine() -> list[CheckResult]:
    system = f"corporeal {__version__}, Python {platform.python_version()}, {platform.platform()}"
    free = shutil.disk_usage(".").free / 1e9
    return [
        CheckResult("system", True, system),
        CheckResult("processor", True, _cores(usable_cores(), os.cpu_count() or 1)),
        CheckResult("disk", free > 1, f"{free:.0f} GB free", "" if free > 1 else "Free some space."),
    ]


def _cores(used: int, all_of_them: int) -> str:
    """Describe how many cores are used, and how many the machine has if that is more."""
    said = f"{used} core{'s' * (used != 1)}"
    return said if used >= all_of_them else f"{said} of the {all_of_them} that the machine has"


def _engines() -> list[CheckResult]:
    try:
        from corporeal.mpm.cpu.program import wp  # no message about GPUs on stderr

        cards = [_gpu(device) for device in wp.get_cuda_devices()]
    except Exception as error:  # a broken native library is a result, too
        return [CheckResult("cpu engine", False, str(error), "Reinstall: pip install warp-lang.")]
    gpu = ", ".join(cards) or "no CUDA GPU: simulations run on the CPU"
    use = "Simulate on it with --engine cuda." if cards else "Not needed."
    return [
        CheckResult("cpu engine", True, f"Warp {version('warp-lang')}, on the CPU"),
        CheckResult("GPU", bool(cards), gpu, use),
        CheckResult("reference engine", True, "NumPy, slow, for verification"),
    ]


def _gpu(device: Any) -> str:
    return f"{device.name} (sm_{device.arch}, {device.total_memory / 2**30:.0f} GB)"


def _libraries() -> list[CheckResult]:
    return [_library(module, use) for module, use in LIBRARY_USES.items()]


def _library(module: str, use: str) -> CheckResult:
    package = PACKAGE_OF_MODULE.get(module, module)
    try:
        return CheckResult(package, find_spec(module) is not None, f"{version(package)}, for {use}")
    except PackageNotFoundError:
        return CheckResult(package, False, "missing", f"pip install {package} (for {use}).")


def _encoder() -> list[CheckResult]:
    try:
        import imageio_ffmpeg

        path = imageio_ffmpeg.get_ffmpeg_version()
    except Exception as error:  # as above
        return [CheckResult("ffmpeg", False, str(error), "pip install imageio-ffmpeg (for videos).")]
    return [CheckResult("ffmpeg", True, f"{path}, a separate program, for videos")]


def _keys() -> list[CheckResult]:
    present = [name for name in API_KEY_VARIABLES if os.environ.get(name)]
    found = ", ".join(present) or "no API key in the environment"
    advice = (
        "Only needed to ask a model for materials (--vlm openai:MODEL). Alternatives: names in the "
        "file, --annotations, --vlm ask:FOLDER (you answer) and --vlm replay:FOLDER."
    )
    installed = find_spec("pydantic_ai") is not None
    client = f"pydantic-ai {version('pydantic-ai-slim')}" if installed else "not installed"
    install = "" if installed else "pip install 'corporeal[models]', to ask models over the network."
    return [
        CheckResult("model client", installed, client, install),
        CheckResult("model keys", bool(present), found, "" if present else advice),
    ]
