"""The shortened scripts of pages: same program, fewer letters."""

import re
import shutil
import subprocess

import pytest

from fecontact.output.report.page import SCRIPTS, script
from fecontact.output.report.shorten import shortened


def test_names_are_short_and_properties_stay():
    found = shortened("""
// A comment.
class Thing {
  #hidden;

  constructor({ first, second: other = 0.5 }) { this.#hidden = first; this.value = other; }

  total(value) { return this.#hidden + +value - -this.value; }
}
const thing = new Thing({ first: 1, second: true });
const text = `sum: ${thing.total(3)} of "first"`, made = { text, length: 3 };
export default made;
""")
    assert "comment" not in found
    assert "hidden" not in found
    assert 'of "first"`' in found  # a text
    for kept in ("first:", "second:", ".total(", ".value", "{text,", "length:3", "constructor("):
        assert kept in found
    assert not re.search(r"\bthing\b|\bother\b|\bmade\b", found)
    assert re.search(r"\+ \+\w", found)
    assert re.search(r"- -this", found)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
def test_it_computes_the_same(tmp_path):
    """Shadowed names, templates in templates, destructuring, private and inherited methods."""
    source = """
class Base {
  #factor = 2;
  scaled(values) { return values.map((value) => value * this.#factor); }
  get name() { return "base"; }
}
class Derived extends Base {
  constructor(offset) { super(); this.offset = offset; }
  scaled(values) { return super.scaled(values).map((value) => value + this.offset); }
  get name() { return `derived of ${super.name}`; }
}
const compute = ({ values, rest: [first, ...others], flag = false }, count = 0.5) => {
  const offset = flag ? -first : +first, found = [];
  for (const [index, value] of values.entries()) {
    const values = new Derived(offset).scaled([value, ...others]);
    found.push(`${index}: ${values.map((value) => `${value}`).join(" - ")}`);
  }
  return { found, count, label: new Derived(1).name, pattern: "a-b".replace(/-(b)/, "+$1") };
};
console.log(JSON.stringify([compute({ values: [1, 2], rest: [3, 4, 5] }),
  compute({ values: [-1], rest: [0, 7], flag: true }, 1e-3)]));
"""
    results = []
    for number, text in enumerate((source, shortened(source))):
        path = tmp_path / f"{number}.mjs"
        path.write_text(text)
        results.append(subprocess.run(["node", path], capture_output=True, text=True, check=True,
                                      timeout=60).stdout)
    assert results[0] == results[1]
    assert '"0: 5 - 11 - 13"' in results[0]
    assert len(shortened(source)) < 0.75 * len(source)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node")
@pytest.mark.parametrize("kind", SCRIPTS)
def test_scripts_are_modules_without_errors(kind, tmp_path):
    path = tmp_path / "script.mjs"
    path.write_text(script(kind))
    subprocess.run(["node", "--check", path], capture_output=True, check=True, timeout=60)
