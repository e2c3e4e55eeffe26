"""The example of docs/analysis.md runs as it stands."""

import re
from pathlib import Path


def test_example_of_the_documentation(tmp_path, monkeypatch, capsys):
    text = (Path(__file__).parents[1] / "docs" / "analysis.md").read_text()
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(compile(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1], "analysis.md", "exec"),
         names)
    assert "Peak(frequency_hz=10.2368" in capsys.readouterr().out
    found, impacts = names["found"], names["impacts"]
    assert (found.periods, found.settled) == (1, True)
    assert len(impacts) == 60
    assert abs(impacts.restitution - 0.945).max() < 1e-3
    assert {path.name for path in tmp_path.iterdir()} == {
        "spectrum.png", "poincare.png", "receptance.png", "run.csv"}
    # On its spring the mass alone has sqrt(c / m) = 5.22 Hz.
    response = names["response"]
    highest = response.frequency_hz[response.magnitude[:, 0, 0].argmax()]
    assert abs(highest - 5.223) < 0.06
