"""How well the embedded recogniser does without a model: facts, truth, score, page."""
