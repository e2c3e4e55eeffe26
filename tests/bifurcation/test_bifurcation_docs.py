"""The examples of docs/bifurcation.md run, and print what the text says."""

import re
from pathlib import Path

import numpy as np
import pytest

TEXT = (Path(__file__).parents[2] / "docs" / "bifurcation.md").read_text()


def test_examples_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for code in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL):
        exec(compile(code, "bifurcation.md", "exec"), names)
    first, second = (line.split() for line in capsys.readouterr().out.splitlines())
    assert [first[0], second[0]] == ["Hopf", "Hopf"]
    printed = re.search(r"at B = ([\d.]+) and\n +([\d.]+)", TEXT)
    assert [float(first[1]), float(second[1])] == pytest.approx(
        [float(x) for x in printed.groups()], abs=5e-7)
    assert first[-1] == "subcritical"
    assert names["flow"].of_kind("Hopf")[0].parameter == pytest.approx(470.0 / 19.0, rel=1e-10)
    end = names["short"].points[-1]
    assert end.kind == "first mode displaced by 1"
    assert end.values["state"][0] == pytest.approx(1.0, rel=1e-10)
    # The orbit of the second part is that of the runs.
    first = names["shown"].points[0]
    values, _ = names["runs"].observed("B", "y")
    assert first.parameter == pytest.approx(64.0, rel=1e-9)
    assert first.values["observed_section"][0] == pytest.approx(values[0, -1], rel=1e-3)
    near = min(names["orbits"].points, key=lambda at: abs(at.parameter - 64.32)).values
    decay = np.log(np.abs(near["multipliers"]).max()) / near["period"]
    assert names["pair"].mean() == pytest.approx(decay, rel=0.03)
    assert len(names["found"].attractors) == 1
    assert all((tmp_path / name).stat().st_size > 5000 for name in ("impacts.png", "basins.png"))
