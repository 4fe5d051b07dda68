from pathlib import Path

from corporeal import materials

PAGE = Path(__file__).parents[2] / "docs" / "materials.md"


def test_the_page_says_what_the_library_says():
    fresh = "Write it again: python -c 'from corporeal import materials as m; print(m.markdown())'"
    assert PAGE.read_text(encoding="utf-8") == materials.markdown() + "\n", fresh
