"""What the gate says of a file's content: whatever the file is called and whoever owns it."""

import hashlib
import json
import traceback
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.types import Scene
from corporeal.io.any_model import read_model
from corporeal.io.credits import Credit, credit_in
from corporeal.io.glb_writer import encode_glb
from corporeal.io.gltf_document import Document
from corporeal.io.sources import GLTF, sources
from corporeal.pool.gate import GateConfig, Measures, Rejected, inspect
from corporeal.recognition.words import everyday, writable

RULES = "2"
"""Changes when the gate judges otherwise: older verdicts then count no more."""
VERDICTS = "verdicts.jsonl"
MODELS = "models"


@dataclass(frozen=True)
class Verdict:
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


class Verdicts:
    """All verdicts of a pool, kept on the disk as they come."""

    def __init__(self, pool: Path, gate: GateConfig) -> None:
        self.pool, self.gate = pool, gate
        self.path = pool / VERDICTS
        self.known = {v.key: v for v in _read(self.path)}

    def of(self, file: Path) -> Verdict:
        """Return what the gate says of a file; known content is not judged again."""
        if writable(str(file)) != str(file):
            return Verdict("", "its path is not plain text in UTF-8: rename it")
        if not file.is_file():
            return Verdict("", "there is no such file, though a table names it")
        try:
            key = content_key(file, self.gate)
        except OSError as problem:
            return Verdict("", f"cannot be read ({problem.strerror})")
        known = self.known.get(key)
        if known is not None and (not known.copy or (self.pool / MODELS / known.copy).exists()):
            return known
        verdict = _in_words_of_one_line(judge(file, key, self.gate, self.pool))
        self.known[key] = verdict
        with store.writing(self.path), self.path.open("a", encoding="utf-8") as log:
            # The line break comes first: a line that was cut off must not swallow this one.
            log.write("\n" + json.dumps(asdict(verdict), ensure_ascii=False))
        return verdict


def _in_words_of_one_line(verdict: Verdict) -> Verdict:
    """Return the verdict without what a hostile file may have put into names and credits."""
    kept = {k: writable(v) for k, v in asdict(verdict).items() if isinstance(v, str)}
    return replace(verdict, **kept)


def content_key(file: Path, gate: GateConfig) -> str:
    """Name the content of a file and its companions, and the gate it stands before."""
    total = hashlib.sha256(json.dumps([RULES, asdict(gate)]).encode())
    for path in sources([file]):
        total.update(path.name.encode() if path != file else file.suffix.lower().encode())
        total.update(_digest(path).encode())
    return total.hexdigest()[:32]


def judge(file: Path, key: str, gate: GateConfig, pool: Path) -> Verdict:
    """Read a file, ask the gate, and keep a copy where one is needed."""
    words = everyday(file.stem)
    try:
        scene = _scene(file)
        words = scene.objects[0].class_name
        return _accepted(file, key, inspect(scene, gate), pool)
    except Rejected as no:
        return Verdict(key, str(no), class_name=words)
    except UserError as problem:
        return Verdict(key, str(problem).removeprefix(f"{file}: "), class_name=words)
    except MemoryError:
        return Verdict(key, "does not fit into memory", class_name=words)
    except Exception as mistake:  # ours; one file must not end the work on all others
        place = traceback.extract_tb(mistake.__traceback__)[-1]
        what = f"{type(mistake).__name__} at {Path(place.filename).name}:{place.lineno}: {mistake}"
        return Verdict(key, f"a mistake of ours ({what})", class_name=words)


def _accepted(file: Path, key: str, m: Measures, pool: Path) -> Verdict:
    credit, copy, sha256 = _credit(file), "", ""
    if m.changed or file.suffix.lower() != ".glb":
        data = encode_glb(m.scene)
        copy, sha256 = f"{key}.glb", hashlib.sha256(data).hexdigest()
        store.write_bytes(pool / MODELS / copy, data)
    return Verdict(
        key=key,
        copy=copy,
        sha256=sha256 or _digest(file),
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


def _scene(file: Path) -> Scene:
    """Read a file as one object; of what is modelled as several the file's name says the class."""
    scene = read_model(file).scene
    if len(scene.objects) == 1:
        return scene
    one = replace(scene.objects[0], class_name=everyday(file.stem) or "object")
    surfaces = tuple(replace(s, object=0) for s in scene.surfaces)
    return replace(scene, objects=(one,), surfaces=surfaces)


def _credit(file: Path) -> Credit:
    return credit_in(Document(file)) if file.suffix.lower() in GLTF else Credit()


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _read(path: Path) -> Iterable[Verdict]:
    """Read the verdicts; a line that was cut off when a run was killed says nothing."""
    if not path.exists():
        return
    names = {f.name for f in fields(Verdict)}
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            kept = json.loads(line)
        except ValueError:
            continue
        if isinstance(kept, dict) and set(kept) == names:
            yield Verdict(**kept)
