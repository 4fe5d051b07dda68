"""Prices of tokens."""

import tomllib
from functools import cache
from importlib.resources import files

TOKENS_PER_LISTED_PRICE = 1e6


def price_usd(model: str, input_tokens: int, output_tokens: int) -> float | None:
    """Return the list price of an exchange [US$]; None: the table does not know the model.

    Args:
        model: As a person types it: "openai:gpt-5.4".
        input_tokens: Of the prompt, pictures included.
        output_tokens: Of the answer, with what the model thought before it.
    """
    provider, _, name = model.partition(":")
    price = _table().get(provider, {}).get(name)
    if price is None:
        return None
    return (input_tokens * price[0] + output_tokens * price[1]) / TOKENS_PER_LISTED_PRICE


def prices_date() -> str:
    """Return the day on which the prices were read."""
    return str(_read()["date"])


def _table() -> dict[str, dict[str, list[float]]]:
    return {name: row for name, row in _read().items() if isinstance(row, dict)}


@cache
def _read() -> dict:
    text = files("corporeal.vlm").joinpath("token_prices.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
