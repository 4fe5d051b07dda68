"""Drop tests of all methods against published rebounds, as jobs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.core.progress import Progress
from corporeal.fields.field_specification import FIELD_READERS
from corporeal.jobs.job import Job
from corporeal.lab.evaluation.drop_test import DropResult, simulate_drop
from corporeal.lab.evaluation.dynamics.compared_methods import Method, method_settings
from corporeal.lab.evaluation.rebound_data import MeasuredRebound, measured_rebounds
from corporeal.pipeline.run_pipeline import Settings
from corporeal.recognition.readable_names import safe_name

REBOUNDS_FOLDER, DROP_FILE = "life", "drop.json"
RANGE_TOLERANCE = 0.03
"""How far from the published range still counts as inside [-]."""


@dataclass(frozen=True)
class MethodDrop:
    """One object dropped by one method."""

    row: MeasuredRebound
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


def has_rebound_data(method: Method) -> bool:
    """Whether a method has numbers for objects that it has no file of."""
    return method.name not in FIELD_READERS


def drop_jobs(out: Path, methods: Sequence[Method], settings: Settings) -> list[Job]:
    """Return a job for every published rebound and every method that knows them."""
    found = []
    for row in measured_rebounds():
        for method in filter(has_rebound_data, methods):
            how = method_settings(method, settings, REBOUNDS_FOLDER)
            job = Job(
                name=f"{REBOUNDS_FOLDER}.{safe_name(row.name)}.{method.name}",
                function=drop_and_save,
                folder=drop_folder(out, row, method),
                key=store.result_key("dynamics life", [row, how.fill, how.ground, how.simulate], []),
                arguments={"row": row, "settings": how},
            )
            found.append(job)
    return found


def drop_folder(out: Path, row: MeasuredRebound, method: Method) -> Path:
    """Return where the drop of one object by one method is kept."""
    return out / REBOUNDS_FOLDER / safe_name(row.name) / method.name


def drop_and_save(folder: Path, progress: Progress, row: MeasuredRebound, settings: Settings) -> None:
    """Drop one object, in the process of a worker."""
    progress(0.0, "dropping")
    store.write_json(folder / DROP_FILE, simulate_drop(row, settings))


def read_drops(out: Path, method: Method) -> list[MethodDrop]:
    """Read what a method's drops came to; those that are not done are left out.

    Raises:
        BadFileError: A file is damaged.
    """
    found = []
    for row in measured_rebounds():
        folder = drop_folder(out, row, method)
        if not (folder / store.META_FILE).exists():
            continue
        try:
            one = from_plain(DropResult, store.read_json(folder / DROP_FILE))
        except (ValueError, TypeError, AttributeError) as error:
            what = f"is not a drop of this version ({error})."
            raise BadFileError(folder / DROP_FILE, what, f"Remove {folder}.") from error
        found.append(MethodDrop(row, one.restitution))
    return found
