"""Self-contained HTML pages: style, templates and embedded pictures."""

import base64
import html
from importlib.resources import files
from pathlib import Path
from string import Template

MIME_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".svg": "image/svg+xml", ".mp4": "video/mp4"}


def fill_page(room: str, name: str, **content: object) -> str:
    """Fill a template that lies in a package with ready HTML, in the look of all pages.

    Args:
        room: The package ("corporeal.pipeline.stages").
        name: Of the template, which names ``$style``.
        content: What takes the place of each ``$name``.
    """
    text = files(room).joinpath(name).read_text(encoding="utf-8")
    style = files("corporeal.render").joinpath("page.css").read_text(encoding="utf-8")
    return Template(text).substitute(content, style=style)


def escape_html(text: object) -> str:
    """Write text so that nothing in it is taken for HTML."""
    return html.escape(str(text))


def data_url_of_file(path: Path) -> str:
    """Return a picture or video as an address that holds it."""
    return data_url(path.read_bytes(), MIME_TYPES[path.suffix])


def data_url(data: bytes, kind: str) -> str:
    """Return an address that holds the data."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def html_figure(caption: str, address: str) -> str:
    """Show a picture with its caption."""
    image = f'<img src="{address}" alt="{escape_html(caption)}">'
    return f"<figure>{image}<figcaption>{escape_html(caption)}</figcaption></figure>"


def table_cells(*texts: str, wrap: bool = False) -> str:
    """Put ready HTML into cells of a table's row, in one line each unless it may wrap."""
    return "".join(f"<td>{t}</td>" if wrap else f'<td class="n">{t}</td>' for t in texts)
