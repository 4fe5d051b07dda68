"""Methods against life: every published rebound is dropped once by each, as a job of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.typed import typed
from corporeal.fields.specification import READERS
from corporeal.jobs.jobs import Job, Progress
from corporeal.lab.evaluation.drop_test import Drop, drop
from corporeal.lab.evaluation.dynamics.methods import Method, settings_of
from corporeal.lab.evaluation.life import Rebound, rebounds
from corporeal.pipeline.runner import Settings
from corporeal.recognition.words import safe

LIFE, DROP = "life", "drop.json"
LEEWAY = 0.03
"""How far from the published range still counts as inside [-]."""


@dataclass(frozen=True)
class Dropped:
    """One thing dropped by one method."""

    row: Rebound
    restitution: float
    """Speed after over speed before [-]."""

    @property
    def middle(self) -> float:
        """Middle of the published range [-]."""
        return 0.5 * (self.row.low + self.row.high)

    @property
    def off(self) -> float:
        """Distance from the published range [-]."""
        return self.row.off(self.restitution)


def knows_life(method: Method) -> bool:
    """Whether a method has numbers for things that it has no file of."""
    return method.name not in READERS


def drop_jobs(out: Path, methods: Sequence[Method], settings: Settings) -> list[Job]:
    """Return a job for every published rebound and every method that knows them."""
    found = []
    for row in rebounds():
        for method in filter(knows_life, methods):
            how = settings_of(method, settings, LIFE)
            job = Job(
                name=f"{LIFE}.{safe(row.name)}.{method.name}",
                function=drop_and_keep,
                folder=drop_folder(out, row, method),
                key=store.key("dynamics life", [row, how.fill, how.ground, how.simulate], []),
                arguments={"row": row, "settings": how},
            )
            found.append(job)
    return found


def drop_folder(out: Path, row: Rebound, method: Method) -> Path:
    """Return where the drop of one thing by one method is kept."""
    return out / LIFE / safe(row.name) / method.name


def drop_and_keep(folder: Path, progress: Progress, row: Rebound, settings: Settings) -> None:
    """Drop one thing, in the process of a worker."""
    progress(0.0, "dropping")
    store.write_json(folder / DROP, drop(row, settings))


def dropped(out: Path, method: Method) -> list[Dropped]:
    """Read what a method's drops came to; those that are not done are left out.

    Raises:
        BadFileError: A file is damaged.

    """
    found = []
    for row in rebounds():
        folder = drop_folder(out, row, method)
        if not (folder / store.META).exists():
            continue
        try:
            one = typed(Drop, store.read_json(folder / DROP))
        except (ValueError, TypeError, AttributeError) as error:
            what = f"is no drop that this version can read ({error})."
            raise BadFileError(folder / DROP, what, f"Remove {folder}.") from error
        found.append(Dropped(row, one.restitution))
    return found
