"""The user's Python files: laws and functions go through one loader."""

import os
import pickle

import pytest

from fecontact import InputError
from fecontact.core.user_code import user_function, user_module
from fecontact.laws import FrictionLaw
from fecontact.laws.own_files import trusting
from fecontact.laws.registry import own_law

LAW = '''
from dataclasses import dataclass
from fecontact.laws import FrictionLaw, PerNode


@dataclass(frozen=True)
class Mine(FrictionLaw):
    strength: PerNode = {default}


def count(run):
    return {default}
'''


def write(path, default, seconds):
    path.write_text(LAW.format(default=default))
    os.utime(path, (seconds, seconds))


def test_laws_and_functions_are_those_of_the_file_as_it_is(tmp_path):
    path = tmp_path / "own.py"
    write(path, 1.0, 1000)
    first = own_law(FrictionLaw, f"{path}:Mine", "here")
    assert first().strength == user_function(path, "count")(None) == 1.0
    assert own_law(FrictionLaw, f"{path}:Mine", "here") is first
    assert pickle.loads(pickle.dumps(first(3.0))) == first(3.0)
    write(path, 2.0, 2000)
    second = own_law(FrictionLaw, f"{path}:Mine", "here")
    assert second().strength == user_function(path, "count")(None) == 2.0
    assert pickle.loads(pickle.dumps(second(3.0))) == second(3.0)


def test_a_file_that_no_longer_loads_leaves_the_module_that_was_loaded(tmp_path):
    path = tmp_path / "own.py"
    write(path, 1.0, 1000)
    law = own_law(FrictionLaw, f"{path}:Mine", "here")()
    path.write_text("1 / 0\n")
    with pytest.raises(InputError, match=r"own\.py cannot be loaded \(ZeroDivisionError: division"):
        user_function(path, "count")
    assert pickle.loads(pickle.dumps(law)) == law


@pytest.mark.parametrize("load", [
    lambda path: own_law(FrictionLaw, f"{path}:Mine", "study.toml: [friction]"),
    lambda path: user_function(path, "count"),
    lambda path: user_module(path),
])
@pytest.mark.parametrize(("text", "message"), [
    (None, r"there is no file .*own\.py\.$"),
    ("def\n", r"own\.py cannot be loaded \(SyntaxError: .*\)\.$"),
    ("open('/none/data.csv')\n", r"own\.py cannot be loaded \(FileNotFoundError: .*data\.csv"),
    ("import sys\nsys.exit(0)\n", r"own\.py cannot be loaded \(SystemExit: 0\)\.$"),
])
def test_messages_are_the_same_for_all(load, text, message, tmp_path):
    if text is not None:
        (tmp_path / "own.py").write_text(text)
    with pytest.raises(InputError, match=message):
        load(tmp_path / "own.py")


def test_what_is_not_in_the_file_is_named_with_what_is(tmp_path):
    path = tmp_path / "own.py"
    write(path, 1.0, 1000)
    with pytest.raises(InputError, match=r"has no FrictionLaw of that name \(did you mean 'Mine'"):
        own_law(FrictionLaw, f"{path}:mine", "here")
    with pytest.raises(InputError, match=r"has no function 'cout' \(did you mean 'count'"):
        user_function(path, "cout")


def test_files_that_are_not_trusted_are_not_run(tmp_path):
    path = tmp_path / "own.py"
    path.write_text("raise SystemExit\n")
    with trusting(False), pytest.raises(InputError, match="not run without permission"):
        own_law(FrictionLaw, f"{path}:Mine", "here")
