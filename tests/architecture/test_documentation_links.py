"""Every relative link of the documentation leads somewhere, and every page can be found."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

import corporeal

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]
FENCE = re.compile(r"^( *)(`{3,}).*?^\1\2 *$", re.MULTILINE | re.DOTALL)
CODE = re.compile(r"`[^`\n]*`")
LINK = re.compile(r"!?\[(?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)")
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
ELSEWHERE = ("http://", "https://", "mailto:")


def prose(text: str) -> str:
    """Return a page without its blocks of code, where brackets mean something else."""
    return FENCE.sub("", text)


def links(text: str) -> list[str]:
    """Return the targets of all links and pictures of a page."""
    return LINK.findall(CODE.sub("`code`", prose(text)))


def anchors(text: str) -> set[str]:
    """Return what a page's headings are called in links, by the rule of GitHub and of the site."""
    found: dict[str, int] = {}
    for heading in HEADING.findall(prose(text)):
        shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        plain = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        count = found[plain] = found.get(plain, -1) + 1
        found.update({f"{plain}-{count}": 0} if count else {})
    return set(found)


def broken(page: Path, text: str) -> Iterator[str]:
    """Say of every relative link of a page that leads nowhere what is missing."""
    for link in links(text):
        if link.startswith(ELSEWHERE):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists():
            yield f"{link}: there is nothing of this name"
        elif anchor and anchor not in anchors(target.read_text() if name else text):
            yield f"{link}: no heading is called so"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(page):
    assert list(broken(page, page.read_text())) == []


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda p: str(p.relative_to(DOCS)))
def test_no_link_of_the_site_leaves_it(page):
    """What lies outside docs/ is not on the site: name it in words."""
    for link in links(page.read_text()):
        if not link.startswith((*ELSEWHERE, "#")):
            target = (page.parent / link.partition("#")[0]).resolve()
            assert target.is_relative_to(DOCS), link


def test_broken_links_are_noticed():
    page = DOCS / "getting-started" / "quickstart.md"
    text = "# One\n\n[a](gone.md) [b](quickstart.md#nowhere) [c](#one) [d](#two) `[e](gone.md)`\n"
    assert [said.partition(":")[0] for said in broken(page, text)] == ["gone.md", "quickstart.md#nowhere", "#two"]


def test_headings_are_called_in_links_as_on_github():
    text = "# What `run` does: E, ν\n## Again\n## Again\n```\n# no heading\n```\n"
    assert anchors(text) == {"what-run-does-e-ν", "again", "again-1"}


def test_every_page_is_in_the_navigation():
    """docs/hooks.py makes pages of files beside docs, and appends the decision records."""
    listed = set(pages_of(navigation())) - {"index.md", "changelog.md", "contributing.md"}
    present = {page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")}
    records = {page for page in present if page.startswith("decisions/")}
    assert listed == present - records, "List each page under nav in mkdocs.yml."


def test_every_public_name_is_on_one_page_of_the_reference():
    shown = [
        name
        for page in sorted(DOCS.glob("reference/api/*.md"))
        for name in re.findall(r"^::: corporeal\.(\w+)$", page.read_text(), re.MULTILINE)
    ]
    public = set(corporeal.__all__) - {"__version__"}
    modules = {name for name in shown if (Path(corporeal.__file__).parent / f"{name}.py").is_file()}
    assert len(shown) == len(set(shown))
    assert set(shown) - modules == public, "Add each public name to a page of docs/reference/api."


def navigation() -> list:
    """Return the navigation that mkdocs.yml declares."""

    class Plain(yaml.SafeLoader):
        """Reads past the one Python object in the file."""

    Plain.add_multi_constructor("tag:yaml.org,2002:python/", lambda loader, suffix, node: suffix)
    return yaml.load((ROOT / "mkdocs.yml").read_text(), Plain)["nav"]


def pages_of(entry: str | list | dict) -> Iterator[str]:
    """Yield the pages below an entry of the navigation."""
    if isinstance(entry, str):
        yield entry
    else:
        for below in entry.values() if isinstance(entry, dict) else entry:
            yield from pages_of(below)
