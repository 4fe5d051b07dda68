"""MkDocs hooks: README and changelog are pages of the site; decision records end the navigation."""

from pathlib import Path

from mkdocs.structure.files import File

PAGES = {"index.md": "README.md", "changelog.md": "CHANGELOG.md", "contributing.md": "CONTRIBUTING.md"}
"""Page of the site → the file beside ``docs`` that it is."""


def on_config(config):
    """Append the decision records to the navigation, their index first."""
    docs = Path(config.docs_dir)
    records = sorted(docs.glob("decisions/*.md"), key=lambda page: (page.stem != "index", page.stem))
    config.nav.append({"Decisions": [record.relative_to(docs).as_posix() for record in records]})
    return config


def on_files(files, config):
    """Add the pages that lie beside ``docs``, with links as seen from inside it."""
    for page, source in PAGES.items():
        text = (Path(config.docs_dir).parent / source).read_text(encoding="utf-8")
        files.append(
            File.generated(
                config, page, content=text.replace("](docs/", "](").replace("](CONTRIBUTING", "](contributing")
            )
        )
    return files
