"""How close to real time the live simulation of the viewer runs, and how many pictures it sends.

    python benchmarks/live.py [SCENE ...] [--seconds 8] [--threads N] [--memory MINUTES]

Prepares showcase scenes, fills them again at the quality of the page's tab Touch, and lets each run
as the server does, with somebody who pulls at the first object and a visitor who takes every
picture. The rate per CPU second of stepping (one engine thread) is what a core of its own would
give on a machine that does nothing else; the rate seen is lower where others work. Aim on two quiet
cores: .8 of real time and 20 pictures a second in all seven scenes.

With ``--memory`` each scene is touched for so many minutes, and the memory that the process holds
is told at the end of its first fifth and at its end. What is done is remembered, up to 100,000
entries; nothing else may grow.
"""

import argparse
import os
import threading
import time
from pathlib import Path

import numpy as np

from corporeal.pipeline.mass_posterior import ground_with_mass_posterior
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.segment import segment
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS, build_showcase_scene
from corporeal.viewer.commands import Command
from corporeal.viewer.live_simulation import LiveSimulation, engine_threads, live_editor_of
from corporeal.viewer.run_store import LiveInput

HEADS = (
    *("scene", "× real time", "simulated s per CPU s of stepping", "pictures/s", "kB"),
    *("step ms", "show ms", "CPU ms", "order ms p95", "slowed"),
)


def results_of(name):
    """Prepare a scene as a run does, up to fill."""
    scene = build_showcase_scene(name)
    inventory = describe(scene)
    parts = segment(scene, inventory)
    field = ground_with_mass_posterior(scene, parts, inventory, Settings().ground)
    return StageResults(assemble=scene, describe=inventory, segment=parts, ground=field, fill=fill(scene, parts, field))


class Visitor:
    """Somebody who takes every picture, and notes when an order is first seen in one."""

    def __init__(self, live):
        self.live, self.sent, self.sizes, self.late, self.away = live, {}, [], [], False
        self.thread = threading.Thread(target=self._look)
        self.thread.start()

    def order(self, asked):
        """Give an order, and remember when."""
        self.sent[asked.seq] = time.perf_counter()
        self.live.orders.append(asked)

    def leave(self):
        """Look no more."""
        self.away = True
        self.thread.join()

    def _look(self):
        number, done = 0, 0
        while not self.away:
            number, before = self.live.wait(number, 0.5), number
            if number > before:
                self.sizes.append(len(self.live.latest))
                seen = int.from_bytes(self.live.latest[:4], "little")
                now = time.perf_counter()
                self.late += [now - self.sent.pop(k) for k in range(done + 1, seen + 1)]
                done = max(done, seen)


def measure(name, seconds, threads):
    """Let one scene run for so many seconds of wall time; return a row."""
    live = LiveSimulation(live_editor_of(LiveInput(results_of(name), "draft"), threads), threads)
    visitor = Visitor(live)
    live.start()
    visitor.order(Command("play", 1))
    time.sleep(2.0)  # until the pace is found
    begun, start, before = time.perf_counter(), live.hands.engine.time, len(visitor.sizes)
    worked = dict(live.worked)
    spent = pull(live, visitor, begun + seconds)
    passed = time.perf_counter() - begun
    done = live.hands.engine.time - start
    step_cpu, show_cpu = (live.worked[k] - worked[k] for k in ("step", "show"))
    shown = len(visitor.sizes) - before
    pictures = shown / passed
    visitor.leave()
    live.close()
    late = sorted(visitor.late)[int(0.95 * (len(visitor.late) - 1))]
    step, show = (1e3 * sum(s[k] for s in spent) / len(spent) for k in ("step", "show"))
    size = sum(visitor.sizes) / len(visitor.sizes) / 1e3
    rates = f"{done / passed:.2f} {done / step_cpu:.2f} {pictures:.1f}"
    times = f"{step:.1f} {show:.1f} {1e3 * show_cpu / shown:.1f} {1e3 * late:.0f}"
    numbers = f"{rates} {size:.0f} {times}".split()
    stopped = f" [stopped: {live.message}]" if live.message else ""
    return (name, *numbers, live.hello()["honest"] + stopped)


def pull(live, visitor, until):
    """Pull at the first object ten times a second; return what the thread spent."""
    place = tuple(live.hands.engine.snapshot().position[0].tolist())
    visitor.order(Command("grab", 2, 0, place, place))
    number, spent = 2, []
    up = (place[0], place[1], place[2] + 0.1)
    while time.perf_counter() < until:
        number += 1
        visitor.order(Command("pull", number, to=up))
        spent.append(dict(live.spent))
        time.sleep(0.1)
    return spent


def held():
    """Memory of this process [MB]; Linux only."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def remember(name, minutes, threads):
    """Touch one scene for so many minutes; return a row of the memory that it takes."""
    live = LiveSimulation(live_editor_of(LiveInput(results_of(name), "draft"), threads), threads)
    visitor = Visitor(live)
    live.start()
    visitor.order(Command("play", 1))
    seconds = 60.0 * minutes
    begun, early = time.perf_counter(), 0.0
    place = tuple(live.hands.engine.snapshot().position[0].tolist())
    visitor.order(Command("grab", 2, 0, place, place))
    number = 2
    while (passed := time.perf_counter() - begun) < seconds:
        number += 1
        if number % 600 == 0:  # what has come to rest is begun again, as a person does
            visitor.order(Command("reset", number))
            number += 1
            visitor.order(Command("grab", number, 0, place, place))
        turn = 2.0 * np.pi * passed / 3.0
        away = 0.1 * np.array([np.cos(turn), np.sin(turn), 1.0])
        visitor.order(Command("pull", number, to=tuple((np.array(place) + away).tolist())))
        if not early and passed > seconds / 5:
            early = held()
        time.sleep(1 / 60)
    late, kept = held(), len(live.hands.touches)
    visitor.leave()
    live.close()
    rows = [name, f"{seconds:.0f}", str(number), str(len(visitor.sizes)), f"{early:.1f}"]
    return (*rows, f"{late:.1f}", f"{late - early:+.1f}", str(kept))


MEMORY = ("scene", "s", "orders", "pictures", "MB at a fifth", "MB at the end", "growth", "record")


def main():
    """Print a row a scene."""
    wanted = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    wanted.add_argument("scenes", nargs="*", metavar="SCENE")
    wanted.add_argument("--seconds", type=float, default=8.0)
    wanted.add_argument("--threads", type=int, default=engine_threads())
    wanted.add_argument("--memory", type=float, metavar="MINUTES")
    asked = wanted.parse_args()
    heads = MEMORY if asked.memory else HEADS
    print("|", " | ".join(heads), "|")
    print("|", " | ".join("---" for _ in heads), "|")
    for name in asked.scenes or SHOWCASE_SCENE_BUILDERS:
        if asked.memory:
            row = remember(name, asked.memory, asked.threads)
        else:
            row = measure(name, asked.seconds, asked.threads)
        print("|", " | ".join(row), "|", flush=True)


if __name__ == "__main__":
    main()
