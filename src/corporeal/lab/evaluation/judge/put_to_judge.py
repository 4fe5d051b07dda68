"""Ask a judge about films: the price first, every film in a conversation of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from corporeal.core.errors import UserError
from corporeal.lab.evaluation.judge.film_question import FilmAsked, Price, price
from corporeal.lab.evaluation.judge.judge_scenes import Films, JudgeConfig, check_judging
from corporeal.lab.evaluation.judge.subquestions import Verdict
from corporeal.lab.evaluation.judge.telling import FilmVerdict, film_verdict
from corporeal.vlm import LIVE, Reply, UnansweredError, Vlm, connect
from corporeal.vlm.by_hand import WaitingError, all_answered
from corporeal.vlm.together import together

Progress = Callable[[float, str], None]
ASK_FIRST = 5.0
"""Above this nobody is asked without ``--yes`` [US$]."""
AT_ONCE = 4
"""Questions under way at the same time."""


@dataclass(frozen=True)
class Judged:
    """What a judge said."""

    films: Films
    verdicts: list[FilmVerdict]
    unanswered: int
    """Looks to which there is no usable answer."""
    judge: str
    price: Price
    answered_by: tuple[str, ...] = field(default=())
    """As recordings name who answered."""


def put_to_judge(
    films: Films,
    config: JudgeConfig,
    say: Callable[[str], None],
    progress: Progress = lambda fraction, words: None,
    judge: Vlm | None = None,
) -> Judged:
    """Ask about all films, each in a conversation of its own, in an order that tells nothing.

    Args:
        films: From ``gather_films``.
        config: Who judges.
        say: Told the price before anybody is asked.
        progress: Told the fraction done and what is being done.
        judge: Who answers, instead of ``config.judge``.

    Raises:
        UserError: Nobody judges, it costs more than was agreed to, or answers are absent.

    """
    asking = _somebody(judge or connected(config))
    jobs = distinct(films.asked)
    reckoned = price(jobs, config.judge)
    say(price_words(reckoned, config))
    _agreed(reckoned, config)
    results = together(
        [lambda a=a: asking.ask(a.question, Verdict) for a in jobs],
        AT_ONCE,
        lambda count: progress(count / max(len(jobs), 1), f"{count} of {len(jobs)} films"),
        lambda error: not isinstance(error, WaitingError | UnansweredError),
    )
    all_answered(results, config.judge)
    replies = {_named(a): r for a, r in zip(jobs, results, strict=True) if isinstance(r, Reply)}
    looks: dict[tuple[str, str], list[Verdict]] = {}
    for asked in films.asked:
        if _named(asked) in replies:
            said = looks.setdefault((asked.scene, asked.condition), [])
            said.append(replies[_named(asked)].answer)
    verdicts = [film_verdict(*film, said) for film, said in sorted(looks.items())]
    by = tuple(sorted({reply.model for reply in replies.values()}))
    return Judged(films, verdicts, len(jobs) - len(replies), config.judge, reckoned, by)


def distinct(asked: Sequence[FilmAsked]) -> list[FilmAsked]:
    """Return each question once, in an order that tells nothing.

    A baseline that is also a control is one motion, and is asked about once.
    """
    return [a for _, a in sorted({_named(a): a for a in asked}.items())]


def _named(asked: FilmAsked) -> tuple[str, int, str]:
    return asked.question.scene, asked.look, asked.question.prompt


def connected(config: JudgeConfig) -> Vlm | None:
    """Connect to who judges; None: nobody was asked for.

    Raises:
        UserError: A setting cannot be right, the name is unknown, or its key is not set.

    """
    check_judging(config)
    return connect(config.judge, config.record)


def _somebody(model: Vlm | None) -> Vlm:
    if model is None:
        raise UserError(
            "Nobody judges. Say who: --judge openai:MODEL, ask:FOLDER or replay:FOLDER."
        )
    return model


def price_words(reckoned: Price, config: JudgeConfig) -> str:
    """Say what asking takes."""
    words = f"{reckoned.films} films to judge, about {reckoned.tokens:,} tokens"
    if not live(config.judge):
        return f"{words}; {config.judge.partition(':')[0]} costs nothing."
    if reckoned.dollars is None:
        return f"{words}; the price of {config.judge} is not known."
    return f"{words}, {reckoned.dollars:.2f} US$ at list prices, less for answers that are kept."


def live(spec: str) -> bool:
    """Whether somebody is paid for answers."""
    return spec.partition(":")[0] in LIVE


def _agreed(reckoned: Price, config: JudgeConfig) -> None:
    """Raise UserError where more would be spent than somebody agreed to."""
    if not live(config.judge) or config.yes:
        return
    if reckoned.dollars is None or reckoned.dollars > ASK_FIRST:
        raise UserError(
            f"{price_words(reckoned, config)} Add --yes to ask all the same, or judge fewer: "
            "--looks 1 --control-scenes 3."
        )
