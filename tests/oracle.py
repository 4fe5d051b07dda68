"""A model that answers from what a test says: task → answer, or a function of the question."""

import re
from threading import Lock

from corporeal.vlm import Reply, Spent, UnansweredError

SIMPLE = {"reason": "So it looks."}


def part(name, material, structure="solid", **said):
    """One part of a materials answer."""
    return {"part": name, "material": material, "probability": 0.7, "structure": structure} | (
        SIMPLE | said
    )


def whole(name="thing"):
    """The object is one piece."""
    return decomposed([name])


def decomposed(*options):
    """Each option: part names."""
    return {
        "object": "a thing",
        "decompositions": [
            {
                "parts": [{"name": n, "look": "plain", "visible": True} for n in names],
                "why": "So it looks.",
            }
            for names in options
        ],
    }


def offered(question):
    """Part → quantities, as a placement question lists them."""
    blocks = re.split(r"^Part ", question.lists["ranges"], flags=re.MULTILINE)[1:]
    return {
        block.split(":\n", 1)[0]: re.findall(r"^- (\w+): ", block, flags=re.MULTILINE)
        for block in blocks
    }


def everywhere(fraction):
    """Put every quantity at one place."""

    def answer(question):
        return {
            "parts": [
                {
                    "part": name,
                    "values": [{"quantity": q, "fraction": fraction} | SIMPLE for q in quantities],
                }
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


class Oracle:
    """Answers as it was told; what it was not told, it cannot answer."""

    looks = True

    def __init__(self, **answers):
        self.answers = {
            "parts": lambda q: whole(),
            "ranking": lambda q: {"ranking": []},
            "placement": everywhere(0.25),
            "extents": sizes(1.0),
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
        return Reply(said, "model", "oracle:1", Spent(1, 1000, 100, 0.5))

    def tasks(self):
        """What was asked, in order."""
        return [q.task for q in self.asked]
