import datetime

import pytest

from corporeal.core.types import NO_USAGE
from corporeal.vlm import token_prices
from corporeal.vlm.interpret_answers import sum_usage


def test_tokens_cost_what_the_table_says():
    assert token_prices.price_usd("openai:gpt-5.4", 1_000_000, 0) == pytest.approx(2.5)
    assert token_prices.price_usd("openai:gpt-5.4", 10_000, 2_000) == pytest.approx(0.025 + 0.030)
    assert token_prices.price_usd("openai:gpt-5.4@http://localhost/v1", 10, 10) is None
    assert token_prices.price_usd("oracle:1", 10, 10) is None


def test_the_table_is_dated_and_output_is_never_cheaper():
    assert datetime.date.fromisoformat(token_prices.prices_date()) >= datetime.date(2026, 11, 1)
    for provider, rows in token_prices._table().items():
        assert provider in ("openai", "anthropic", "google")
        assert all(0 < low <= high for low, high in rows.values())


def row(model, calls=1):
    spent = {"calls": calls, "input_tokens": 1000, "output_tokens": 100, "seconds": 2.0}
    return {"model": model, "answer": {}} | spent


def test_a_total_is_known_only_where_every_price_is():
    total = sum_usage([row("openai:gpt-5.4"), row("openai:gpt-5-mini"), {"answer": None}])
    assert total.dollars == pytest.approx(0.004 + 0.00045)
    assert (total.questions, total.calls, total.seconds) == (3, 2, 4.0)
    assert sum_usage([row("openai:gpt-5.4"), row("oracle:1")]).dollars is None
    assert sum_usage([row("oracle:1", calls=0)]).dollars == 0.0
    assert sum_usage([]) == NO_USAGE
