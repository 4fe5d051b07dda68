"""The benchmarks of photographs answer what they cannot do in a sentence, not in a traceback."""

import made_sets
import pytest
import real_photographs
import real_speed

SET = ("block/images", "block/sparse/0")


@pytest.mark.parametrize(
    ("benchmark", "words", "said"),
    [
        (real_photographs, ["nowhere"], "holds no set"),
        (real_photographs, [".", "--only", "blok"], "no set blok. It has block."),
        (real_photographs, [".", "--training", "drat"], "invalid choice: 'drat'"),
        (real_speed, ["nowhere"], "no folder images"),
        (real_speed, ["block"], "--photographs: block has 0"),
        (real_speed, ["block", "--training", "drat"], "invalid choice: 'drat'"),
        (made_sets, ["nowhere.glb", "out"], "there is no such file"),
        (made_sets, ["nowhere.glb", "out", "--pictures", "0"], "--pictures: 3 are the fewest"),
    ],
)
def test_a_wrong_word_gets_a_sentence(tmp_path, monkeypatch, capsys, benchmark, words, said):
    for name in SET:
        (tmp_path / name).mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["benchmark", *words])
    with pytest.raises(SystemExit) as ended:
        benchmark.main()
    assert ended.value.code == 2
    assert said in capsys.readouterr().err
