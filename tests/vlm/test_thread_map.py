import threading
import time

import numpy as np
import pytest

from corporeal.vlm.api_clients import RetryPolicy, retry_after_seconds
from corporeal.vlm.thread_map import thread_map


def test_results_come_in_order_however_long_each_takes():
    def job(k):
        time.sleep(0.02 * (5 - k))
        return k

    seen = []
    assert thread_map([lambda k=k: job(k) for k in range(5)], 5, seen.append) == [0, 1, 2, 3, 4]
    assert seen == [1, 2, 3, 4, 5]


def test_no_more_than_so_many_at_a_time_and_all_of_them_get_done():
    now, most, one = 0, 0, threading.Lock()

    def job():
        nonlocal now, most
        with one:
            now += 1
            most = max(most, now)
        time.sleep(0.005)
        with one:
            now -= 1

    thread_map([job] * 30, 3)
    assert most == 3


def test_a_failure_stands_in_its_place():
    def fail():
        raise ValueError("no")

    first, second = thread_map([fail, lambda: 1], 2)
    assert isinstance(first, ValueError)
    assert second == 1
    assert thread_map([], 4) == []


def test_a_fatal_error_ends_it_at_once_and_drops_what_waits():
    started, let_go = [], threading.Event()

    def fail():
        raise OSError("over")

    def slow(k):
        started.append(k)
        let_go.wait(600)

    start = time.monotonic()
    with pytest.raises(OSError, match="over"):
        thread_map(
            [lambda: slow(0), fail, *(lambda k=k: slow(k) for k in range(1, 40))],
            2,
            fatal=lambda error: isinstance(error, OSError),
        )
    assert time.monotonic() - start < 300, "it waited for what had begun"
    let_go.set()
    assert len(started) <= 3


def test_waiting_doubles_up_to_a_limit_and_is_spread():
    dice = np.random.default_rng(0)
    patience = RetryPolicy(first_wait=1.0, longest_wait=6.0)
    waits = [patience.wait(k, dice) for k in (1, 2, 3, 4, 9)]
    for wait, limit in zip(waits, (1, 2, 4, 6, 6), strict=True):
        assert limit / 2 <= wait <= limit


@pytest.mark.parametrize(
    ("headers", "seconds"),
    [
        ({"retry-after": "3"}, 3.0),
        ({"retry-after-ms": "250", "retry-after": "1"}, 0.25),
        ({"retry-after": "Wed, 21 Oct 2026 07:28:00 GMT"}, None),
        ({"retry-after": "-4"}, 0.0),
        ({}, None),
    ],
)
def test_a_pause_is_read_from_the_headers(headers, seconds):
    assert retry_after_seconds(headers) == seconds
