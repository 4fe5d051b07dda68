"""Live simulation with interaction; pages get the newest frame only."""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.discretization.build_model import build_model
from corporeal.discretization.live_quality import LiveDemand, choose_live_quality, limit_live_steps
from corporeal.mpm.engines import DEFAULT_ENGINE, build_engine
from corporeal.mpm.problem import Problem, Snapshot
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.viewer_data import bind_scene, resolution_statement, viewer_recording
from corporeal.render.recording_format import SceneBinding, stress_bytes
from corporeal.scene.vessel_contents import SceneWithMaterials
from corporeal.simulation.simulation_result import PreparedScene
from corporeal.viewer.commands import Command
from corporeal.viewer.interaction_controller import InteractionController, drop_height
from corporeal.viewer.live_edit import AssetFinder, GrownScene, LiveEditor
from corporeal.viewer.run_store import LiveInput
from corporeal.viewer.snapshot_frames import SnapshotFrames
from corporeal.viewer.wind_faces import with_wind_faces

MAX_FPS = 30.0
"""Pictures a second, at most."""
MIN_FRAME_TIME_S = 2e-4
"""Simulated time of a picture, at least [s]."""
COST_SMOOTHING = 0.1
"""Share of the newest cost in the smoothed one."""
STRESS_SCALE_PERCENTILE = 99.5
"""Percentile of the stresses that the scale ends at."""
MAX_RECORDED_EVENTS = 100_000
"""Of a record: then it is only kept that it is not whole."""
HEADER_DTYPE = "<u4"
MAX_ENGINE_THREADS = 4
REFILL_STEP_RATIO = 0.8
"""Share of the steps below which filling once more pays."""
TIMED_STEPS = 20
"""Steps by which the cost of one is measured …"""
MAX_TIMED_S = 2.0
"""… or fewer, where they take more processor time than this [s]."""


def engine_threads() -> int:
    """Return how many threads step: a core stays for pictures, at which no step has to wait."""
    return max(1, min(MAX_ENGINE_THREADS, usable_cores() - 1))


def no_assets(name: str) -> SceneWithMaterials:
    """Find nothing."""
    raise UserError("Nothing can be added to this simulation.")


def live_editor_of(made: LiveInput, threads: int, find: AssetFinder = no_assets) -> LiveEditor:
    """Fill a scene again for what can be simulated in real time."""
    old, assembled = made.results, made.results.assembled
    scene = with_wind_faces(assembled.scene)
    demand = LiveDemand.of(old.particles, made.detail, measure_step_cost(old.prepared, made.engine))
    quality = choose_live_quality(demand, threads)
    # Contents of vessels are poured anew: fill is given the scene without them.
    particles = fill(scene, assembled.parts, assembled.field, quality=quality)
    slower = limit_live_steps(quality, demand, particles.cell, threads)
    if slower.steps_per_second < REFILL_STEP_RATIO * quality.steps_per_second:
        quality = slower
        particles = fill(scene, assembled.parts, assembled.field, quality=quality)
    # What broke in the run is whole again.
    prepared = replace(old, assemble=scene, fill=particles, simulate=None).prepared
    return LiveEditor(prepared, quality, find, made.ground)


def measure_step_cost(prepared: PreparedScene, engine: str = DEFAULT_ENGINE) -> float:
    """Measure what a step of a scene costs an engine as it is filled [CPU s of one thread]."""
    problem = build_model(prepared.scene, prepared.particles, prepared.field).problem
    timed = build_engine(problem, engine, 1)
    timed.step(timed.stable_step())
    begun, steps, spent = time.process_time(), 0, 0.0
    while steps < TIMED_STEPS and spent < MAX_TIMED_S:
        timed.step(timed.stable_step())
        steps, spent = steps + 1, time.process_time() - begun
    return spent / steps


class SceneDisplay:
    """What a scene looks like: its surfaces bound to its particles, and what a page knows of it."""

    def __init__(self, grown: GrownScene, generation: int) -> None:
        """Bind them.

        Args:
            grown: The scene.
            generation: Another for every scene, so that pictures are not put on a wrong one.
        """
        self.prepared, self.generation = grown.prepared, generation
        self.cast: SceneBinding = bind_scene(grown.prepared)
        self.moments = SnapshotFrames(grown.posed)

    def hello(self) -> dict:
        """Describe what pictures will hold, and how honest they are."""
        return {
            "generation": self.generation,
            "honest": resolution_statement(self.prepared),
            "rigid": self.cast.rigid.tolist(),
        }

    def take(self) -> bytes:
        """Return the scene as it begins, with all that was added: a take without a recording."""
        return viewer_recording(self.prepared, self.cast)


@dataclass(frozen=True)
class RenderState:
    """What there is to show, as it was between two advances."""

    face: SceneDisplay

    now: Snapshot
    beside: Snapshot | None
    """The control; None: it does not run."""
    held: np.ndarray | None
    """Where the hand holds [m]; None: it holds nothing."""
    force: float
    """Of the hand [N]."""
    done: int
    """Number of the last order."""
    playing: bool
    rate: float
    """Simulated over real time."""


class LiveSimulation:
    """One live simulation. Orders come in from any thread; pictures are ``latest``.

    One thread steps, another makes pictures of the newest instant: neither waits for the other.
    """

    def __init__(self, growth: LiveEditor, threads: int, engine: str = DEFAULT_ENGINE) -> None:
        """Begin at time 0, paused.

        Args:
            growth: From ``live_editor_of``.
            threads: Of the engine.
            engine: Its name.

        Raises:
            UserError: The engine cannot solve the scene, or does not work on this machine.
        """
        self.growth, self.threads, self.engine = growth, threads, engine
        self.prepared = growth.at(()).prepared
        self.posed = growth.at(()).posed
        self.face = self.bare = SceneDisplay(growth.at(()), 0)
        self.faces = 1
        self.orders: deque[Command] = deque(maxlen=1000)
        self.news = threading.Condition()
        self.latest, self.number = b"", 0
        self.instant: RenderState | None = None
        self.taken = threading.Condition()
        self.message: str = ""
        self.playing = self.closed = self.whole = False
        self.done, self.rate, self.top = 0, 0.0, 1.0
        self.spent = {"step": 0.0, "show": 0.0}
        self.worked = {"step": 0.0, "show": 0.0}
        """CPU seconds of the two threads since the beginning, without the engine's other ones."""
        self.begin(single=False, twin=False)
        self.threads_of = (
            threading.Thread(target=self._run, name="live", daemon=True),
            threading.Thread(target=self._show, name="live pictures", daemon=True),
        )

    def hello(self) -> dict:
        """Describe what pictures will hold, how honest they are, and how heavy objects are."""
        return self.face.hello() | {"gravity": list(self.prepared.scene.gravity)}

    def ask(self, order: Command) -> None:
        """Let an order be obeyed; an object that is to be added is filled first, beside the rest."""
        if order.do != "add":
            self.orders.append(order)
            return
        threading.Thread(target=self._make_ready, args=(order,), daemon=True).start()

    def _make_ready(self, order: Command) -> None:
        try:
            self.growth.ready(order.thing, drop_height(order))
        except UserError as error:
            self.message = str(error)
        else:
            self.orders.append(order)

    def begin(self, single: bool, twin: bool) -> None:
        """Begin again at time 0.

        Args:
            single: With one velocity field for all, the control.
            twin: With that control beside, to which the same is done.
        """
        shared = replace(self.posed.problem, contact="single")
        problem = shared if single else self.posed.problem
        # An engine may refuse a shared field: then what runs goes on.
        hands, beside = self._hands(problem), self._hands(shared) if twin else None
        self.growth.forget()
        self.single, self.hands, self.twin = single, hands, beside
        self.face = self.bare
        self.pace, self.cost = MIN_FRAME_TIME_S, 3.0
        self.message, self.whole = "", True

    def _hands(self, problem: Problem) -> InteractionController:
        return InteractionController(self.posed, problem, self.threads, self.growth, self.engine)

    def start(self) -> None:
        """Let it run in its threads."""
        for thread in self.threads_of:
            thread.start()

    def close(self) -> None:
        """End the threads."""
        self.closed = True
        with self.taken:
            self.taken.notify_all()
        for thread in self.threads_of:
            if thread.is_alive():
                thread.join(10.0)

    def _run(self) -> None:
        """Obey and step; frames are handed over without waiting."""
        self._hand_over()
        while not self.closed:
            begun, worked = time.perf_counter(), time.thread_time()
            touched = self._obey()
            moved = self.playing and self._advance()
            if moved or touched:
                self._hand_over()
            self.worked["step"] += time.thread_time() - worked
            self._keep_pace(time.perf_counter() - begun, moved)
            time.sleep(max(1 / MAX_FPS - (time.perf_counter() - begun), 0.001))
            passed = time.perf_counter() - begun
            self.rate += COST_SMOOTHING * (self.pace * moved / passed - self.rate)

    def _hand_over(self) -> None:
        """Let the other thread show the present; an instant that it did not get to is lost."""
        now = self.hands.engine.snapshot()
        held = self.hands.grip(now.position)
        force = self.hands.force(now.position)
        beside = self.twin.engine.snapshot() if self.twin else None
        with self.taken:
            self.instant = RenderState(self.face, now, beside, held, force, self.done, self.playing, self.rate)
            self.taken.notify_all()

    def _show(self) -> None:
        """Make a picture of the newest instant, again and again."""
        while not self.closed:
            with self.taken:
                self.taken.wait_for(lambda: self.instant is not None or self.closed)
                instant, self.instant = self.instant, None
            if instant is not None:
                begun, worked = time.perf_counter(), time.thread_time()
                picture = self.picture(instant)
                self.worked["show"] += time.thread_time() - worked
                self.spent["show"] = time.perf_counter() - begun
                with self.news:
                    self.latest, self.number = picture, self.number + 1
                    self.news.notify_all()

    def _obey(self) -> bool:
        """Do the orders that have come; a bad one is refused and the simulation goes on."""
        some = False
        while self.orders:
            order, some = self.orders.popleft(), True
            self.done = max(self.done, order.seq)
            try:
                self._do(order)
            except UserError as error:
                self.message = str(error)
        return some

    def _do(self, order: Command) -> None:
        if order.do in ("play", "pause"):
            self.playing = order.do == "play"
        elif order.do == "reset":
            self.begin(self.single, self.twin is not None)
        elif order.do == "contact":
            self.begin(order.single and not order.twin, order.twin)
        elif order.do == "step":
            self._both(1 / MAX_FPS)
        elif order.do == "add":
            self._add(order)
        else:
            done = self.hands.obey(order)
            if self.twin and done:
                self.twin.obey(done)

    def _add(self, order: Command) -> None:
        """Drop an object, into the control beside as well: over what is highest in either."""
        every = [hands for hands in (self.hands, self.twin) if hands]
        self.message = ""
        begins = self.hands.above(order, max(hands.top(order) for hands in every))
        for hands in every:
            hands.obey(begins)
        if self.twin:
            self.twin.touches.clear()
        self.face = SceneDisplay(self.growth.at(self.hands.added), self.faces)
        self.faces += 1

    def _both(self, seconds: float) -> None:
        """Simulate so much more [s], and the control beside to the same instant."""
        self.hands.advance(seconds)
        if self.twin:
            self.twin.again(self.hands.touches[-1])
            self.twin.touches.clear()  # one record says it all

    def _advance(self) -> bool:
        try:
            self._both(self.pace)
        except UserError as error:  # it is where it was before
            self.playing, self.message = False, f"{error} Begin again with reset."
            return False
        if len(self.hands.touches) > MAX_RECORDED_EVENTS:
            self.hands.touches.clear()
            self.whole = False
        return True

    def _keep_pace(self, stepping: float, moved: bool) -> None:
        """As much simulated time a picture as the machine can do, at most real time."""
        self.spent["step"] = stepping
        if moved:
            self.cost += COST_SMOOTHING * (stepping / self.pace - self.cost)
            self.pace = float(np.clip(1 / MAX_FPS / max(self.cost, 1e-3), MIN_FRAME_TIME_S, 1 / MAX_FPS))

    def wait(self, seen: int, patience: float) -> int:
        """Wait until there is a newer picture than number ``seen``; return its number."""
        with self.news:
            self.news.wait_for(lambda: self.number > seen or self.closed, patience)
            return self.number

    def picture(self, instant: "RenderState") -> bytes:
        """One instant: a head of 48 bytes, then every object in order.

        Head: the last order's number (uint32), simulated over real time, force of the hand [N],
        end of the scale of stresses [Pa] (float32), time [s] (float64), the point that is held [m]
        (3 × float32, nan: none), playing (uint32), 1 or, with the control after it, 2 (uint32), the
        scene's generation (uint32). An object: pose (12 × float32); one that deforms, then
        residuals (3 × int16 a vertex), normals (2 × int8), stress (uint8).
        """
        shown = [now for now in (instant.now, instant.beside) if now is not None]
        face = instant.face
        frames = [face.moments.frame(now) for now in shown]
        tops = [float(np.percentile(f.stress, STRESS_SCALE_PERCENTILE)) for f in frames if f.stress is not None]
        self.top = max(self.top, *tops)
        held = np.full(3, np.nan) if instant.held is None else instant.held
        numbers = [instant.rate, instant.force, self.top]
        out = [
            np.array([instant.done], HEADER_DTYPE).tobytes(),
            np.array(numbers, "<f4").tobytes(),
            np.array([instant.now.time], "<f8").tobytes(),
            np.asarray(held, "<f4").tobytes(),
            np.array([instant.playing, len(frames), face.generation], HEADER_DTYPE).tobytes(),
        ]
        for seen in chain.from_iterable(map(face.cast.at, frames)):
            out.append(seen.pose.astype("<f4").tobytes())
            if seen.residual is not None and seen.normal is not None:
                shade = stress_bytes(seen.stress, self.top)  # type: ignore[arg-type]
                body = seen.residual.astype("<i2").tobytes() + seen.normal.tobytes()
                body += shade.tobytes()
                out += [body, b"\0" * (-len(body) % 4)]
        return b"".join(out)


class LiveSession:
    """The one live simulation of a server, of whichever run was asked for last."""

    def __init__(self, read: Callable[[str], LiveInput], find: AssetFinder = no_assets) -> None:
        """Hold none yet."""
        self.read, self.find, self.lock = read, find, threading.Lock()
        self.name = ""
        self.live: LiveSimulation | None = None
        self.visitors = 0
        self.hand: object | None = None

    def enter(self, name: str) -> LiveSimulation:
        """Come in to watch a run; starts it where it does not run, and ends another one.

        Raises:
            UserError: There is no such run, or it cannot be simulated.
        """
        with self.lock:
            if self.live is None or self.name != name:
                self._clear()
                made, threads = self.read(name), engine_threads()
                scene = live_editor_of(made, threads, self.find)
                self.live = LiveSimulation(scene, threads, made.engine)
                self.name = name
                self.live.start()
                self.visitors = 0
            self.visitors += 1
            return self.live

    def leave(self, live: LiveSimulation, visitor: object) -> None:
        """Go; the last one turns the light off."""
        with self.lock:
            if self.hand is visitor:
                self.hand = None
            if live is self.live:
                self.visitors -= 1
                if self.visitors <= 0:
                    self._clear()

    def takes(self, visitor: object) -> bool:
        """Whether a visitor has the hand: whoever comes first, until he goes."""
        with self.lock:
            self.hand = self.hand or visitor
            return self.hand is visitor

    def close(self) -> None:
        """End what runs."""
        with self.lock:
            self._clear()

    def _clear(self) -> None:
        if self.live is not None:
            self.live.close()
        self.live, self.name, self.hand = None, "", None
