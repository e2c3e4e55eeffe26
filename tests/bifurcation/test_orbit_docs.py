"""The examples of docs/orbits.md run, and give what the text says."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_examples_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    # The system is made in the first example of the other page.
    blocks = [re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)[0]
              for page in ("bifurcation.md", "orbits.md")]
    for block in blocks:
        exec(compile(block, "orbits.md", "exec"), names)
    assert "period doubling 8.0921923" in capsys.readouterr().out
    assert (tmp_path / "diagram.png").stat().st_size > 10000
    second = names["doubled"].of_kind("period doubling")[0]
    assert second.parameter == pytest.approx(9.2619, abs=1e-3)
    assert names["times"][-1] == pytest.approx(names["orbits"].points[40].values["period"])
    assert names["states"][0] == pytest.approx(names["states"][-1], abs=1e-12)
