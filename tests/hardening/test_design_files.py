"""Design files of any content make a sound design, or one sentence."""

import pytest
from broken import DESIGN_FILES, SWEEP_FILES, TAKEN, cases, fault_of_sentence

from lobefem.app.sweep_file import load
from lobefem.errors import InputError
from lobefem.io.design import Design

pytestmark = pytest.mark.serial


@cases(0.6, 60, content=DESIGN_FILES)
def test_any_file_makes_a_design_or_one_sentence(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(content)
    sentence = ""
    try:
        design = Design.load(path)
    except InputError as error:
        sentence = f"lobefem: {error}\n"
    if sentence:
        assert fault_of_sentence(sentence) == "", sentence
        return
    written = design.to_toml()
    path.write_text(written, encoding="utf-8")
    assert Design.load(path) == design
    assert Design.load(path).to_toml() == written


@cases(0.1, 30, content=SWEEP_FILES)
def test_any_file_makes_a_sweep_or_one_sentence(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "sweep.toml"
    path.write_bytes(content)
    known = {name: {option.lstrip("-") for option in taken} for name, taken in TAKEN.items()}
    sentence, study = "", None
    try:
        study = load(path, known)
    except InputError as error:
        sentence = f"lobefem: {error}\n"
    if study is None:
        assert fault_of_sentence(sentence) == "", sentence
        return
    assert study.points
    assert all(point.design or point.fault for point in study.points)
