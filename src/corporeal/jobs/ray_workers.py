"""Jobs on a Ray cluster, or on a temporary local one.

Each job is a task in a process of its own, as on this machine. The corpus must lie where every machine sees it under
the same path. Ray's own retries are off: what a dead worker means is decided in one place, for every kind of worker.
"""

import logging
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from corporeal.core.errors import UserError
from corporeal.jobs.job import Job, JobEvent
from corporeal.jobs.worker_process import PackedJob, attempt_job, pack_job

RAY_ENVIRONMENT = {
    "RAY_USAGE_STATS_ENABLED": "0",  # it would report to its makers
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_DEDUP_LOGS": "0",
}
CLUSTER_ANSWER_TIMEOUT_S = 5.0
"""How long a cluster may take to answer [s]."""
STOP_TIMEOUT_S = 30.0
"""How long a job may take to keep what it has when it is stopped [s]."""


class RayWorkerPool:
    """Up to ``slots`` tasks at the same time."""

    def __init__(self, ray: Any, slots: int, threads: int, gpus: float) -> None:
        self.ray, self.slots, self.threads = ray, slots, threads
        self.task = ray.remote(num_cpus=threads, num_gpus=gpus, max_retries=0, max_calls=1)(_task)
        self.job: dict[Any, Job] = {}

    def start(self, job: Job) -> None:
        """Submit a job."""
        self.job[self.task.remote(pack_job(job), self.threads)] = job

    def wait(self, seconds: float) -> list[JobEvent]:
        """Return tasks that ended."""
        ready, _ = self.ray.wait(list(self.job), timeout=seconds)
        return [self._end(ref) for ref in ready]

    def _end(self, ref: Any) -> JobEvent:
        job = self.job.pop(ref)
        try:
            wrong = self.ray.get(ref)
        except self.ray.exceptions.RayError as error:
            return JobEvent(job, "died", words=f"Its process died: {_first_line(error)}")
        return JobEvent(job, "finished", 1.0) if wrong is None else JobEvent(job, "failed", words=wrong)

    def stop(self) -> None:
        """Cancel every task, which interrupts it, and give it a while."""
        for ref in self.job:
            self.ray.cancel(ref, force=False)
        until = time.monotonic() + STOP_TIMEOUT_S
        while self.job and time.monotonic() < until:
            self.wait(1.0)
        for ref in self.job:
            self.ray.cancel(ref, force=True)
        self.job.clear()


def _task(packed: PackedJob, threads: int) -> str | None:
    os.environ["OMP_NUM_THREADS"] = str(threads)
    return attempt_job(packed, lambda fraction, words: None)


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0][:300]


def _check_address(address: str) -> None:
    """Reject an address without a server: Ray itself would retry for minutes."""
    host, _, port = address.rpartition("/")[2].partition(":")
    if not host or not port.isdecimal():
        return  # "auto", or none
    try:
        socket.create_connection((host, int(port)), timeout=CLUSTER_ANSWER_TIMEOUT_S).close()
    except (OSError, OverflowError) as error:
        raise UserError(f"Cannot use Ray at {address}: {error}. Start it there with: ray start --head.") from error


@contextmanager
def ray_worker_pool(slots: int, threads: int, gpus: float, address: str) -> Iterator[RayWorkerPool]:
    """Join a cluster, or start one of this machine alone.

    Args:
        slots: How many jobs at the same time.
        threads: Processors of each.
        gpus: Share of a GPU that each takes.
        address: Of a running cluster; empty: start one here, and end it again.

    Raises:
        UserError: Ray is not installed, or there is no such cluster.
    """
    os.environ.update(RAY_ENVIRONMENT)
    try:
        import ray
    except ModuleNotFoundError:
        raise UserError('--on ray needs Ray. Install it with: pip install "corporeal[cluster]".') from None
    _check_address(address)
    folder = None if address else tempfile.mkdtemp(prefix="ray-")
    options: dict[str, Any] = {"address": address} if address else {
        "address": "local",
        "num_cpus": slots * threads,
        "include_dashboard": False,
        "_temp_dir": folder,
    }  # fmt: skip
    try:
        try:
            ray.init(log_to_driver=False, logging_level=logging.ERROR, **options)
        except (ConnectionError, ValueError, RuntimeError) as error:
            where = address or "this machine"
            raise UserError(f"Cannot use Ray at {where}: {_first_line(error)}") from error
        workers = RayWorkerPool(ray, slots, threads, gpus)
        try:
            yield workers
        finally:
            workers.stop()
    finally:
        ray.shutdown()
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
