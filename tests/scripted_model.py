"""A model that answers from what a test says: task → answer, or a function of the question."""

import re
from threading import Lock

from corporeal.vlm import AnswerCost, Reply, UnansweredError

SIMPLE = {"reason": "So it looks."}


def part(name, material, built: str | None = "solid", alternatives=(), **said):
    """One part of a materials answer, certain to 0.7 unless other materials are named."""
    names = ("probability", "contents", "fill", "solidity", "reading", "reason")
    own = {k: said.pop(k) for k in names if k in said}
    way = {"material": material, "built": built, "probability": 0.7} | SIMPLE | own
    others = [{"built": built} | SIMPLE | other for other in alternatives]
    return {"part": name, "ways": [way, *others]} | said


def whole(name="thing"):
    """The object is one piece."""
    return decomposed([name])


def decomposed(*options):
    """Each option: part names."""
    return {
        "object": "a thing",
        "decompositions": [
            {"parts": [{"name": n, "look": "plain", "seen": "yes"} for n in names], "why": "So it looks."}
            for names in options
        ],
    }


def offered(question):
    """Part → quantities, as a placement question lists them."""
    blocks = re.split(r"^Part ", question.lists["ranges"], flags=re.MULTILINE)[1:]
    return {block.split(":\n", 1)[0]: re.findall(r"^- (\w+): ", block, flags=re.MULTILINE) for block in blocks}


def everywhere(fraction):
    """Put every quantity at one place."""

    def answer(question):
        return {
            "parts": [
                {"part": name, "values": [{"quantity": q, "fraction": fraction} | SIMPLE for q in quantities]}
                for name, quantities in offered(question).items()
            ]
        }

    return answer


def sizes(metres):
    """Every class has one size."""

    def answer(question):
        names = re.findall(r"^- (.+)$", question.prompt, flags=re.MULTILINE)
        return {"classes": [{"class_name": n, "metres": metres} for n in names]}

    return answer


def weighs(low=0.5, likely=1.0, high=2.0, printed=()):
    """What was said of an object's mass [kg], and read on it."""
    return {
        "printed": list(printed), "low_kg": low, "likely_kg": likely, "high_kg": high,
    } | SIMPLE  # fmt: skip


class Oracle:
    """Answers as it was told; what it was not told, it cannot answer."""

    looks = True

    def __init__(self, **answers):
        self.answers = {
            "parts": lambda q: whole(),
            "ranking": lambda q: {"ranking": []},
            "placement": everywhere(0.25),
            "extents": sizes(1.0),
            "mass": weighs(),
        } | answers
        self.asked = []
        self._one = Lock()

    def ask(self, question, answer, check=lambda said: []):
        with self._one:
            self.asked.append(question)
            said = self.answers.get(question.task)
            if isinstance(said, list):
                said = said.pop(0)
            said = said(question) if callable(said) else said
        if said is None:
            raise UnansweredError("the oracle is silent")
        said = answer.model_validate(said)
        complaints = check(said)
        if complaints:
            raise UnansweredError("; ".join(complaints))
        return Reply(said, "model", "oracle:1", AnswerCost(1, 1000, 100, 0.5))

    def tasks(self):
        """What was asked, in order."""
        return [q.task for q in self.asked]
