"""What the README says of itself: its three lines of Python, and its counts."""

import re
from pathlib import Path

from corporeal.materials import library

ROOT = Path(__file__).parents[1]


def first_python(page: str) -> str:
    """Return the first block of Python of a page."""
    found = re.search(r"```python\n(.+?)```", (ROOT / page).read_text(), re.DOTALL)
    assert found is not None
    return found[1]


def test_the_ball_of_the_readme_rebounds(capsys):
    exec(first_python("README.md"), {})
    assert 0.3 < float(capsys.readouterr().out) < 0.98


def test_readme_and_api_page_begin_with_the_same_lines():
    assert first_python("README.md") == first_python("docs/reference/api-on-one-page.md")


def test_the_library_is_as_large_as_it_says():
    said = {int(n) for n in re.findall(r"(\d+) materials", (ROOT / "README.md").read_text())}
    assert said == {len(library("default"))}


def test_rebounds_are_counted_as_their_page_counts_them():
    said = re.search(r"of (\d+) rebounds of real objects (\d+) lie within", (ROOT / "README.md").read_text())
    text = (ROOT / "docs/reference/restitution-validation.md").read_text()
    page = re.search(r"Of the (\d+) other rows (\d+) are", text)
    assert said is not None
    assert page is not None
    assert said.groups() == page.groups()
