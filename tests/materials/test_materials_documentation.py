from pathlib import Path

from corporeal import materials
from corporeal.materials.library_lint import lint_library
from corporeal.materials.shipped_libraries import SHIPPED_LIBRARY_FILES, source_table

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "materials.md"


def test_the_page_says_what_the_library_says():
    fresh = "Write it again: python -c 'from corporeal import materials as m; print(m.markdown())'"
    assert PAGE.read_text(encoding="utf-8") == materials.library_markdown() + "\n", fresh


def test_the_page_tells_pairs_rule_and_how_to_make_ones_own():
    said = PAGE.read_text(encoding="utf-8")
    for word in ("| rubber on concrete", "√(μ_a μ_b)", 'extends = "default"', "materials check"):
        assert word in said


def test_the_example_of_a_library_of_ones_own_is_sound():
    said = PAGE.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    assert lint_library(said, source_table(), tuple(SHIPPED_LIBRARY_FILES)) == []
