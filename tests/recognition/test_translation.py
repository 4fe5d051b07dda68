"""Names in other languages say what English ones say."""

import tomllib
from pathlib import Path

import pytest

from corporeal.recognition import translation
from corporeal.recognition.lexicon import lexicon_terms, name_tokens
from corporeal.recognition.readable_names import everyday_words
from corporeal.recognition.translation import translate_words
from corporeal.recognition.typical_bulk_density import typical_bulk_density
from corporeal.recognition.typical_extents import typical_extent

TABLES = tomllib.loads(Path(translation.__file__).with_suffix(".toml").read_text("utf-8"))


@pytest.mark.parametrize(
    ("said", "english"),
    [
        ("Muelltonne", "trash can"),
        ("Mülltonne", "trash can"),
        ("Putzeimer", "putz bucket"),
        ("Regentonne", "regen barrel"),
        ("Holzstuhl", "wood chair"),
        ("Bierflasche", "beer bottle"),
        ("seau de plage", "plage bucket"),
        ("caja_de_madera", "wood box"),
        ("botella de vino", "wine bottle"),
        ("botella de vino vacía", "wine bottle empty"),
        ("bouteille de vin vide", "wine bottle empty"),
        ("gusseiserne Pfanne", "cast iron pan"),
        ("鉄のフライパン", "iron pan"),
        ("アップライトピアノ", "piano"),
        ("植木鉢", "flower pot"),
        ("bouteille en grès", "stoneware bottle"),
        ("balde rojo", "bucket red"),
        ("Стул", "chair"),
        ("ведро_02", "bucket"),
        ("木の椅子", "wood chair"),
        ("lave-vaisselle", "dishwasher"),
        ("Muscheln", "seashell"),
        ("木の本棚", "wood bookshelf"),
        ("红木箱", "wood box"),
    ],
)
def test_an_object_is_known_by_its_name_in_another_language(said, english):
    assert " ".join(name_tokens(said)) == english
    assert " ".join(translate_words(everyday_words(said).split())) == english


@pytest.mark.parametrize(
    "name", ["baseball", "without", "douglas fir", "plate of the day", "hammer head", "vessel", "carpet", "tonne"]
)
def test_english_names_stay_as_they_are(name):
    assert translate_words(name.split()) == name.split()


def test_no_word_of_ours_is_taken_for_a_foreign_one():
    """What the lexicon knows in English means there what it says."""
    known = {word for term in lexicon_terms() for word in term.phrase}
    assert {w: translate_words([w]) for w in known if translate_words([w]) != [w]} == {}


def test_no_foreign_word_means_two_objects():
    said = [w for table in TABLES.values() for words in table.values() for w in words]
    twice = {w for w in said if said.count(w) > 1}
    assert twice == set()


def test_most_objects_have_a_usual_size_or_weight():
    """A translation is there to be judged by: only a few say no more than what a thing is like."""
    unknown = {t for t in TABLES["things"] if not (typical_extent(t) or typical_bulk_density(t, 1.0))}
    assert unknown <= {"toy"}


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (typical_extent("Kühlschrank"), "refrigerator"),
        (typical_bulk_density("lavadora", 0.8), "washing machine"),
        (typical_bulk_density("silla de oficina", 0.8), "chair"),
    ],
)
def test_sizes_and_weights_are_found_by_foreign_names(found, words):
    assert found is not None
    assert found.words == words


def test_words_without_gaps_between_them_are_pieced_apart():
    assert translate_words(["木箱"]) == ["wood", "box"]
    assert translate_words(["塑料瓶"]) == ["plastic", "bottle"]
    assert translate_words(["木星"]) == ["木星"]
