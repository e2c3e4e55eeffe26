// The page of a sweep: a map whose cells show their case.

class Cases extends Chart {
  constructor(data, pick) {
    const set = (index) => { this.chosen = index; this.point(); pick(index); };
    super({ window: () => [0, data.cases - 1], set }, { title: "", xLabel: "", lines: [{ x: [], y: [] }],
      height: 480, kind: "cases" });
    this.data = data;
    this.picks = ["x", "y", "colour"].map((name, k) => {
      const select = el("select", { ariaLabel: name, onchange: () => this.draw() },
        ...data.columns.map((column, at) => el("option", { value: at }, column.title)));
      select.value = data.start[k];
      this.node.firstChild.append(field(name, select));
      return select;
    });
    this.bar = new ColourBar();
    this.node.append(this.bar.node, el("p.legend", {}, data.remarks));
  }

  draw() {
    [this.along, this.up, this.shade] = this.picks.map(({ value }) => this.data.columns[value]);
    Object.assign(this.lines[0], { x: this.along.values, y: this.up.values });
    this.xLabel = this.along.title;
    super.draw();
    const known = this.shade.values.filter((v) => v === v);
    this.bar.show(this.data.shades, ...[min(...known), max(...known)].map((end) => known.length ? +end.toPrecision(4) : ""));
  }

  // Cells as large as the values lie apart, small squares where they lie anyhow.
  side(values, to, room) {
    const places = [...new Set(values.map(to))].sort((a, b) => a - b);
    let apart = room;
    places.forEach((place, k) => { if (k) apart = min(apart, place - places[k - 1]); });
    return places.length * 2 > values.length && values.length > 12 || apart < 2 ? 9 : min(apart, 120);
  }

  trace(c, { x, y }) {
    const { values } = this.shade, { shades } = this.data;
    const known = values.filter((v) => v === v), low = min(...known), span = max(...known) - low || 1;
    const w = this.side(x, this.px, this.width), h = this.side(y, this.py, this.height);
    x.forEach((_, i) => {
      const px = this.px(x[i]), py = this.py(y[i]), missing = values[i] !== values[i];
      c.fillStyle = missing ? css("open") : `rgb(${shades[round(63 * (values[i] - low) / span)]})`;
      c.fillRect(px - w / 2, py - h / 2, w + 0.5, h + 0.5);
      if (missing) {
        c.fillStyle = css("soft");
        c.textAlign = "center";
        c.fillText("×", px, py);
      }
    });
    c.beginPath();
  }

  limits() {
    const found = super.limits();
    const wide = (range, values) => {
      const room = (max(...values) - min(...values)) / (2 * max(1, new Set(values).size - 1));
      return room > (range[1] - range[0]) / 40 ? [min(...values) - room, max(...values) + room] : range;
    };
    const finite = (values) => values.filter((v) => v === v);
    return { x: wide(found.x, finite(this.along.values)), y: wide(found.y, finite(this.up.values)) };
  }

  timeAt(x, y) {
    let best = Infinity, found = 0;
    this.along.values.forEach((value, i) => {
      const away = hypot(this.px(value) - x, this.py(this.up.values[i]) - y);
      if (away < best) { best = away; found = i; }
    });
    return found;
  }

  point() {
    const c = this.cursor;
    c.clearRect(0, 0, this.width, this.height);
    if (this.chosen === undefined) return;
    c.strokeStyle = css("accent");
    c.lineWidth = 2.5;
    c.beginPath();
    c.arc(this.px(this.along.values[this.chosen]), this.py(this.up.values[this.chosen]), 8, 0, 7);
    c.stroke();
  }
}

async function build(host, data, dataset) {
  units = data.units;
  for (const column of data.columns) column.values = column.values.map((value) => value ?? NaN);
  const facts = el("div");
  const cases = new Cases(data, (index) => {
    dataset.case = index;
    facts.replaceChildren(table([], data.rows[index].map((text, k) => [data.headings[k], text])
      .filter(([, text]) => text)));
  });
  host.append(head(data), el("main", {}, el("div.left", {}, ...section("Cases", cases.node)),
    el("div", {}, ...section("Case", facts), ...section("Sweep", table([], data.facts)))),
  ...cards("Study, in SI units", data.study), foot(data));
  cases.resize();
  cases.clock.set(0);
  return { close: ready(host, dataset, () => cases.resize()) };
}
