"""Wheel and sdist hold all that the package reads, and work in an empty environment."""

import os
import re
import subprocess
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

import corporeal

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = Path(corporeal.__file__).parent
READ = {".py", ".toml", ".html", ".css", ".js", ".txt", ".cpp", ".h", ".md", ".csv"}
"""Kinds of files that the package is made of."""
SMALL = ("--duration", "0.1", "--fps", "10", "--width", "160", "--height", "120")


def package_files():
    files = (p for p in PACKAGE.rglob("*") if p.is_file() and "__pycache__" not in p.parts)
    return {str(p.relative_to(PACKAGE.parent)) for p in files}


def do(*words, cwd, minutes=5):
    """Run a command away from the checkout; return what it printed."""
    env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [str(w) for w in words], cwd=cwd, env=env, capture_output=True, text=True,
        timeout=60 * minutes,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_package_is_made_of_known_kinds_of_files_and_each_is_there():
    """A wheel takes what git does not ignore: data of a new kind is named here once."""
    kinds = {Path(name).suffix for name in package_files()}
    assert kinds == READ


def test_no_file_of_the_package_is_ignored_by_git():
    """Hatchling leaves ignored files out of a wheel without a word."""
    asked = ["git", "-C", str(ROOT), "check-ignore", "--stdin"]
    names = "\n".join(f"src/{name}" for name in package_files())
    said = subprocess.run(asked, input=names, capture_output=True, text=True, check=False)
    if said.returncode == 128:
        pytest.skip("this is no git checkout")
    assert said.stdout == ""


def links_of_wheel(wheel):
    """Return the targets of links and images in the description that PyPI shows."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        text = archive.read(name).decode()
    assert "corporeal" in text
    return re.findall(r"\]\(([^)\s]+)\)", text)


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_wheel_and_sdist_work_in_an_empty_environment(tmp_path):
    venv.create(tmp_path / "empty", with_pip=True)
    python = tmp_path / "empty" / "bin" / "python"
    pip = (python, "-m", "pip", "--disable-pip-version-check", "--quiet")
    reached = subprocess.run(
        [*map(str, pip), "install", "build"],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    if reached.returncode:
        pytest.skip("the package registry cannot be reached, so nothing can be installed")

    # The sdist from the checkout, then the wheel from the sdist.
    do(python, "-m", "build", "--outdir", tmp_path / "dist", ROOT, cwd=tmp_path, minutes=15)
    (sdist,) = (tmp_path / "dist").glob("corporeal-*.tar.gz")
    (wheel,) = (tmp_path / "dist").glob("corporeal-*.whl")
    with tarfile.open(sdist) as archive:
        held = {name.partition("/src/")[2] for name in archive.getnames()}
    assert package_files() <= held
    assert package_files() <= set(zipfile.ZipFile(wheel).namelist())
    links = links_of_wheel(wheel)
    assert links
    assert [link for link in links if not link.startswith(("https://", "#"))] == []
    do(*pip, "install", wheel, cwd=tmp_path, minutes=15)

    where = do(python, "-c", "import corporeal; print(corporeal.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)
    do(python.parent / "corporeal", "demo", *SMALL, cwd=tmp_path)
    assert (tmp_path / "runs" / "duck-on-mud" / "report.html").stat().st_size > 10_000
    assert "rose" in do(python, ROOT / "examples" / "01_drop_a_ball.py", cwd=tmp_path)
