"""A corpus: two scenes composed from two models, each run in a process of its own, one report."""

import json
import tempfile
from pathlib import Path

import corporeal as co

SETTINGS = co.Settings(assemble=co.AssembleConfig(duration=0.1, fps=10), video=co.VideoConfig(width=160, height=120))


def main() -> float:
    """Return the largest error of a scene's momentum balance [-]."""
    with tempfile.TemporaryDirectory() as place:
        models, corpus = Path(place) / "models", Path(place) / "corpus"
        models.mkdir()
        for thing in (co.box("wood", (0.2, 0.2, 0.1), name="crate"), co.ball("rubber", 0.1)):
            co.write_glb(models / f"{thing.name}.glb", co.build_scene(thing, name=thing.name))
        pool = co.index_pool([models], Path(place) / "pool")
        asked = co.CorpusConfig(scenes=2, classes=2, count="1-2")
        sources = co.Sources(pool, co.ComposeConfig(), co.CaptureConfig(views=1, size=(64, 64)))
        hands = co.local_executor(corpus)
        co.assemble_corpus(corpus, asked, sources, hands)
        co.run_corpus(corpus, co.RunConfig(), SETTINGS, hands)
        *_, data = co.report_corpus(corpus)
        total = json.loads(data.read_text())["total"]
    print(f"{total['clean']} of {total['scenes']} scenes passed the audit")
    return total["momentum_worst"]


if __name__ == "__main__":
    main()
