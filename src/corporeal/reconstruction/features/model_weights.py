"""Weights of models: in a folder, or from the Hugging Face hub and its cache."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from huggingface_hub import hf_hub_download  # pyright: ignore[reportMissingImports]
from huggingface_hub.errors import HFValidationError  # pyright: ignore[reportMissingImports]

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError

CONFIG_FILE, PREPROCESSOR_FILE = "config.json", "preprocessor_config.json"
PROCESSOR_FILE = "processor_config.json"
"""Holds, in later versions of the library, what the other file held."""


@dataclass(frozen=True)
class ModelWeights:
    """A model's files: of one kind, in one place, in one revision."""

    kind: str
    """What ``config.json`` must call itself: "clip"."""
    place: str
    """A folder, or OWNER/NAME on the hub."""
    wish: str = ""
    """Of the hub's revisions: a branch, a tag or a commit; "": the newest."""

    @property
    def name(self) -> str:
        """Return which weights very exactly, wherever they are."""
        return f"{self.kind}@{self.revision}"

    @property
    def local(self) -> bool:
        """Whether the place is a folder."""
        return Path(self.place).is_dir()

    @cached_property
    def revision(self) -> str:
        """Name these very files: the hub's commit, or a digest of the folder's content."""
        if self.local:
            return store.path_digest(Path(self.place))
        return self._fetched(CONFIG_FILE, self.wish or None).parent.name

    def read(self, name: str) -> dict[str, Any]:
        """Read one of the model's JSON files.

        Raises:
            UserError: There is no such file, or it cannot be had.
        """
        self.holds([name])
        path = Path(self.place) / name if self.local else self._fetched(name, self.revision)
        return store.read_json(path)

    def check(self) -> None:
        """Reject a model of another kind.

        Raises:
            BadFileError: ``config.json`` is another kind's.
        """
        kind = self.read(CONFIG_FILE).get("model_type")
        if kind != self.kind:
            raise BadFileError(self.place, f"holds a model of kind {kind!r}, not {self.kind!r}.", "Name another.")

    def holds(self, names: Sequence[str]) -> None:
        """Reject a folder that has none of some files; ``transformers`` would make something up.

        Raises:
            BadFileError: There is none of them.
        """
        if self.local and not any((Path(self.place) / name).is_file() for name in names):
            raise BadFileError(self.place, f"there is no {' or '.join(names)}.", "Save it with save_pretrained.")

    def load(self, cls: Any) -> Any:
        """Load a model's weights with the class that ``transformers`` has for them.

        Raises:
            UserError: They cannot be had, are damaged, or do not fill the model.
        """
        self.check()
        options = {} if self.local else {"revision": self.revision}
        try:
            model, report = cls.from_pretrained(self.place, output_loading_info=True, **options)
        except Exception as error:  # of the hub, the disk, safetensors, pickle and the library
            raise UserError(self._advice(error)) from error
        if report["missing_keys"] or report["mismatched_keys"]:
            lacking = sorted(map(str, [*report["missing_keys"], *report["mismatched_keys"]]))
            raise BadFileError(
                self.place, f"lacks {len(lacking)} of the model's arrays ({lacking[0]} …).", "Fetch it again."
            )
        return model.eval()

    def tokenizer(self, cls: Any) -> Any:
        """Load what cuts words into tokens, with the class that ``transformers`` has for it.

        Raises:
            UserError: It cannot be had, or is damaged.
        """
        options = {} if self.local else {"revision": self.revision}
        try:
            return cls.from_pretrained(self.place, **options)
        except Exception as error:  # of the hub, the disk, JSON and the library
            raise UserError(self._advice(error)) from error

    def _fetched(self, name: str, revision: str | None) -> Path:
        try:
            return Path(hf_hub_download(self.place, name, revision=revision))
        except (OSError, HFValidationError) as error:
            raise UserError(self._advice(error)) from error

    def _advice(self, error: Exception) -> str:
        reason = (str(error) or type(error).__name__).strip().splitlines()[0].rstrip(".")
        if self.local:
            return f"{self.place}: its weights cannot be loaded ({reason}). Fetch it again."
        return (
            f"The weights of {self.place} cannot be had ({reason}). They come from the Hugging "
            "Face hub at their first use. On a machine with a network type: hf download "
            f"{self.place} --local-dir FOLDER; bring FOLDER here and name it: {self.kind}:FOLDER. "
            "Without any weights there is 'descriptor'."
        )


def find_weights(kind: str, spec: str, default: str) -> ModelWeights:
    """Return the weights that a person means.

    Args:
        kind: Of model, as ``config.json`` calls it.
        spec: A folder, OWNER/NAME or OWNER/NAME@REVISION; "" means ``default``.
        default: OWNER/NAME.

    Raises:
        UserError: There is no such folder, or it holds something else.
    """
    spec = spec or default
    if Path(spec).expanduser().is_dir():
        here = ModelWeights(kind, str(Path(spec).expanduser()))
        here.check()
        here.read(PREPROCESSOR_FILE)
        return here
    place, _, wish = spec.partition("@")
    if place.count("/") != 1 or place[0] in "./~" or place.endswith("/"):
        raise UserError(
            f"There is no folder {spec}. Name a folder with a model's files, or OWNER/NAME on the "
            f"Hugging Face hub, such as {default}."
        )
    return ModelWeights(kind, place, wish)


def weights_in_folder(folder: Path, kinds: Sequence[str]) -> ModelWeights:
    """Return the weights in a folder, of one of a few kinds; nothing is fetched.

    Raises:
        UserError: They are of another kind, or something of them is missing.
    """
    said = ModelWeights(kinds[0], str(folder)).read(CONFIG_FILE).get("model_type")
    made = ModelWeights(next((kind for kind in kinds if kind == said), kinds[0]), str(folder))
    made.check()
    made.holds([PREPROCESSOR_FILE, PROCESSOR_FILE])
    return made


def picture_statistics(weights: ModelWeights) -> dict[str, Any]:
    """Return ``image_mean`` and ``image_std`` that pictures are prepared by.

    Raises:
        UserError: No file of the model says them.
    """
    known: dict[str, Any] = {}
    for name in (PROCESSOR_FILE, PREPROCESSOR_FILE):
        if (Path(weights.place) / name).is_file():
            said = weights.read(name)
            known |= said.get("image_processor", said)
    if not {"image_mean", "image_std"} <= known.keys():
        what = f"neither {PREPROCESSOR_FILE} nor {PROCESSOR_FILE} states image_mean and image_std."
        raise BadFileError(weights.place, what, "Save it with save_pretrained.")
    return known
