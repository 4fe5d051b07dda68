"""Author and licence of a model as stated in its file."""

import re
from dataclasses import dataclass

from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.recognition.readable_names import single_line_text

MAX_STATED_CREDIT_CHARACTERS = 500
"""Of what is kept of a credit [characters]."""
LICENCE_PATTERN = re.compile(
    r"\b(?:CC0(?:[- ]1\.0)?|CC[- ]BY(?:[- ](?:NC|SA|ND))*(?:[- ]\d\.\d)?|Apache-2\.0|MIT(?:-0)?)\b", re.IGNORECASE
)
"""Licences that are recognised within a sentence."""


@dataclass(frozen=True)
class Credit:
    """Empty: nothing is stated."""

    licence: str = ""
    attribution: str = ""

    @property
    def words(self) -> str:
        """Both in one line."""
        licence = () if self.licence in self.attribution else (self.licence,)
        return "; ".join(w for w in (*licence, self.attribution) if w)


def credit_of_document(document: GltfDocument) -> Credit:
    """Return what ``asset.copyright`` and, as Sketchfab writes them, ``asset.extras`` say."""
    asset = document.root.child("asset")
    if asset is None:
        return Credit()
    copyright = single_line_text(asset.text("copyright"))
    extras = asset.value.get("extras")
    words = {k.lower(): v for k, v in extras.items()} if isinstance(extras, dict) else {}
    licence = _text(words, "license", "licence")
    found = LICENCE_PATTERN.search(copyright)
    return Credit(
        licence=(licence or (found.group() if found else ""))[:MAX_STATED_CREDIT_CHARACTERS],
        attribution=(copyright or _by(words))[:MAX_STATED_CREDIT_CHARACTERS],
    )


def _by(words: dict) -> str:
    title, author, source = (_text(words, k) for k in ("title", "author", "source"))
    named = f"{title} by {author}" if title and author else title or author
    return f"{named} ({source})" if named and source else named or source


def _text(words: dict, *keys: str) -> str:
    values = (words.get(k) for k in keys)
    return next((single_line_text(v) for v in values if isinstance(v, str) and v.strip()), "")
