"""Questions to a judge about videos, each in a separate conversation, after a cost estimate."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.vlm import LIVE_CLIENTS, Reply, UnansweredError, VlmClient, connect_vlm
from corporeal.vlm.human_client import PendingQuestionsError, refuse_pending
from corporeal.vlm.thread_map import thread_map
from video_judge.detectability import VideoVerdict, video_verdict
from video_judge.judge_scenes import JudgeConfig, JudgedVideos, check_judging
from video_judge.subquestions import Verdict
from video_judge.video_question import JudgingCost, VideoQuestion, estimate_cost

CONFIRM_ABOVE_USD = 5.0
"""Above this cost ``--yes`` is required [US$]."""
MAX_PARALLEL_QUESTIONS = 4
"""Questions under way at the same time."""


@dataclass(frozen=True)
class JudgeVerdicts:
    """Answers of a judge."""

    videos: JudgedVideos
    verdicts: list[VideoVerdict]
    unanswered: int
    """Looks to which there is no usable answer."""
    judge: str
    price: JudgingCost
    answered_by: tuple[str, ...] = field(default=())
    """As recordings name who answered."""


def query_judge(
    videos: JudgedVideos,
    config: JudgeConfig,
    say: Callable[[str], None],
    progress: Progress = no_progress,
    judge: VlmClient | None = None,
) -> JudgeVerdicts:
    """Ask about all videos, each in a conversation of its own, in an order that tells nothing.

    Args:
        videos: From ``gather_videos``.
        config: Settings of the judge.
        say: Called with the price before the first question.
        progress: Called with the fraction done and a description.
        judge: Who answers, instead of ``config.judge``.

    Raises:
        UserError: There is no judge, it costs more than allowed, or answers are absent.

    """
    asking = _somebody(judge or connect_judge(config))
    jobs = distinct_questions(videos.asked)
    reckoned = estimate_cost(jobs, config.judge)
    say(price_words(reckoned, config))
    _agreed(reckoned, config)
    results = thread_map(
        [lambda a=a: asking.ask(a.question, Verdict) for a in jobs],
        MAX_PARALLEL_QUESTIONS,
        lambda count: progress(count / max(len(jobs), 1), f"{count} of {len(jobs)} videos"),
        lambda error: not isinstance(error, PendingQuestionsError | UnansweredError),
    )
    refuse_pending(results, config.judge)
    replies = {_named(a): r for a, r in zip(jobs, results, strict=True) if isinstance(r, Reply)}
    looks: dict[tuple[str, str], list[Verdict]] = {}
    for asked in videos.asked:
        if _named(asked) in replies:
            said = looks.setdefault((asked.scene, asked.condition), [])
            said.append(replies[_named(asked)].answer)
    verdicts = [video_verdict(*video, said) for video, said in sorted(looks.items())]
    by = tuple(sorted({reply.model for reply in replies.values()}))
    return JudgeVerdicts(videos, verdicts, len(jobs) - len(replies), config.judge, reckoned, by)


def distinct_questions(asked: Sequence[VideoQuestion]) -> list[VideoQuestion]:
    """Return each question once, in an order that tells nothing.

    A baseline that is also a control is one motion, and is asked about once.
    """
    return [a for _, a in sorted({_named(a): a for a in asked}.items())]


def _named(asked: VideoQuestion) -> tuple[str, int, str]:
    return asked.question.scene, asked.look, asked.question.prompt


def connect_judge(config: JudgeConfig) -> VlmClient | None:
    """Connect to the judge; None: none was asked for.

    Raises:
        UserError: A setting cannot be right, the name is unknown, or its key is not set.

    """
    check_judging(config)
    return connect_vlm(config.judge, config.record)


def _somebody(model: VlmClient | None) -> VlmClient:
    if model is None:
        raise UserError("No judge. Choose one: --judge openai:MODEL, ask:FOLDER or replay:FOLDER.")
    return model


def price_words(reckoned: JudgingCost, config: JudgeConfig) -> str:
    """Describe what asking takes."""
    words = f"{reckoned.videos} videos to judge, about {reckoned.tokens:,} tokens"
    if not is_paid(config.judge):
        return f"{words}; {config.judge.partition(':')[0]} costs nothing."
    if reckoned.dollars is None:
        return f"{words}; the price of {config.judge} is not known."
    return f"{words}, {reckoned.dollars:.2f} US$ at list prices, less for answers that are kept."


def is_paid(spec: str) -> bool:
    """Whether answers are paid."""
    return spec.partition(":")[0] in LIVE_CLIENTS


def _agreed(reckoned: JudgingCost, config: JudgeConfig) -> None:
    """Raise UserError where the cost exceeds the limit."""
    if not is_paid(config.judge) or config.yes:
        return
    if reckoned.dollars is None or reckoned.dollars > CONFIRM_ABOVE_USD:
        raise UserError(
            f"{price_words(reckoned, config)} Add --yes to confirm, or judge fewer: --looks 1 --control-scenes 3."
        )
