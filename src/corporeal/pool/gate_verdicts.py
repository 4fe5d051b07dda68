"""Verdicts of the quality gate on the content of files."""

import hashlib
import json
import traceback
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.types import Scene
from corporeal.io.gltf.glb_writer import encode_glb
from corporeal.io.gltf.gltf_credits import Credit, credit_of_document
from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.io.input_files import list_input_files
from corporeal.io.load_model import load_model
from corporeal.io.registry import GLTF_READER, reader_of
from corporeal.pool.quality_gate import GateConfig, GatedModel, ModelRejectedError, inspect_model
from corporeal.recognition.readable_names import everyday_words, single_line_text

GATE_RULES_VERSION = "2"
"""Changes when the gate judges otherwise: older verdicts then count no more."""
VERDICTS_FILE = "verdicts.jsonl"
MODELS_FOLDER = "models"


@dataclass(frozen=True)
class GateVerdict:
    """One judgement."""

    key: str
    """Names the content and the gate."""
    reason: str = ""
    """Why it stays outside; empty: it may enter."""
    copy: str = ""
    """Name of its cleaned copy among the pool's models; empty: the file itself will do."""
    sha256: str = ""
    """Of the bytes of the file or its copy."""
    mesh: str = ""
    """Names the shape."""
    look: str = ""
    """Names colours and pictures."""
    class_name: str = ""
    """What the file itself says it is."""
    licence: str = ""
    attribution: str = ""
    extent: float = 0.0
    triangles: int = 0
    open_edges: float = 0.0
    texture: int = 0


class GateVerdicts:
    """All verdicts of a pool, kept on the disk as they come."""

    def __init__(self, pool: Path, gate: GateConfig) -> None:
        self.pool, self.gate = pool, gate
        self.path = pool / VERDICTS_FILE
        self.known = {v.key: v for v in _read_verdicts(self.path)}

    def of(self, file: Path) -> GateVerdict:
        """Return what the gate says of a file; known content is not judged again."""
        if single_line_text(str(file)) != str(file):
            return GateVerdict("", "its path is not plain text in UTF-8: rename it")
        if not file.is_file():
            return GateVerdict("", "there is no such file, though a table names it")
        try:
            key = content_key(file, self.gate)
        except OSError as problem:
            return GateVerdict("", f"cannot be read ({problem.strerror})")
        known = self.known.get(key)
        if known is not None and (not known.copy or (self.pool / MODELS_FOLDER / known.copy).exists()):
            return known
        verdict = _in_words_of_one_line(judge_file(file, key, self.gate, self.pool))
        self.known[key] = verdict
        with store.disk_errors(self.path), self.path.open("a", encoding="utf-8") as log:
            # The line break comes first: a line that was cut off must not swallow this one.
            log.write("\n" + json.dumps(asdict(verdict), ensure_ascii=False))
        return verdict


def _in_words_of_one_line(verdict: GateVerdict) -> GateVerdict:
    """Return the verdict without what a hostile file may have put into names and credits."""
    kept = {k: single_line_text(v) for k, v in asdict(verdict).items() if isinstance(v, str)}
    return replace(verdict, **kept)


def content_key(file: Path, gate: GateConfig) -> str:
    """Name the content of a file and its companions, and the settings of the gate."""
    total = hashlib.sha256(json.dumps([GATE_RULES_VERSION, asdict(gate)]).encode())
    for path in list_input_files([file]):
        total.update(path.name.encode() if path != file else file.suffix.lower().encode())
        total.update(_file_digest(path).encode())
    return total.hexdigest()[:32]


def judge_file(file: Path, key: str, gate: GateConfig, pool: Path) -> GateVerdict:
    """Read a file, ask the gate, and keep a copy where one is needed."""
    words = everyday_words(file.stem)
    try:
        scene = _scene_of_file(file)
        words = scene.objects[0].class_name
        return _accepted_verdict(file, key, inspect_model(scene, gate), pool)
    except ModelRejectedError as no:
        return GateVerdict(key, str(no), class_name=words)
    except UserError as problem:
        return GateVerdict(key, str(problem).removeprefix(f"{file}: "), class_name=words)
    except MemoryError:
        return GateVerdict(key, "does not fit into memory", class_name=words)
    except Exception as mistake:  # ours; one file must not end the work on all others
        place = traceback.extract_tb(mistake.__traceback__)[-1]
        what = f"{type(mistake).__name__} at {Path(place.filename).name}:{place.lineno}: {mistake}"
        return GateVerdict(key, f"internal error ({what})", class_name=words)


def _accepted_verdict(file: Path, key: str, m: GatedModel, pool: Path) -> GateVerdict:
    credit, copy, sha256 = _credit_of_file(file), "", ""
    if m.changed or file.suffix.lower() != ".glb":
        data = encode_glb(m.scene)
        copy, sha256 = f"{key}.glb", hashlib.sha256(data).hexdigest()
        store.write_bytes(pool / MODELS_FOLDER / copy, data)
    return GateVerdict(
        key=key,
        copy=copy,
        sha256=sha256 or _file_digest(file),
        mesh=m.mesh,
        look=m.look,
        class_name=m.scene.objects[0].class_name,
        licence=credit.licence,
        attribution=credit.attribution,
        extent=m.extent,
        triangles=m.triangles,
        open_edges=round(m.open_edges, 6),
        texture=m.texture,
    )


def _scene_of_file(file: Path) -> Scene:
    """Read a file as one object; of what is modelled as several the file's name says the class."""
    scene = load_model(file).scene
    if len(scene.objects) == 1:
        return scene
    one = replace(scene.objects[0], class_name=everyday_words(file.stem) or "object")
    surfaces = tuple(replace(s, object=0) for s in scene.surfaces)
    return replace(scene, objects=(one,), surfaces=surfaces)


def _credit_of_file(file: Path) -> Credit:
    if reader_of(file) is not GLTF_READER:
        return Credit()
    return credit_of_document(GltfDocument(file))


def _file_digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _read_verdicts(path: Path) -> Iterable[GateVerdict]:
    """Read the verdicts; a line that was cut off when a run was killed says nothing."""
    if not path.exists():
        return
    names = {f.name for f in fields(GateVerdict)}
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            kept = json.loads(line)
        except ValueError:
            continue
        if isinstance(kept, dict) and set(kept) == names:
            yield GateVerdict(**kept)
