// State or force of the nodes of one face over time.
class ContactMap extends Chart {
  constructor(clock, contact, face, shades) {
    const states = contact.states.map((name, k) => ({ name, back: contact.colours[k] || "var(--open)" }));
    super(clock, { title: face.title, lines: [{ name: "" }], legend: states, xLabel: clock.label,
      height: clamp(60 + 9 * face.abscissa.length, 90, 220), kind: "map" });
    Object.assign(this, { contact, face, shades, what: "state" });
    const pick = el("select", { ariaLabel: "quantity", onchange: () => { this.what = pick.value; this.draw(); } },
      ...["state", "normal force", "tangential force"].map((name) => el("option", {}, name)));
    this.node.firstChild.append(pick);
  }

  draw() {
    const { contact, face, what } = this, { left, right, top, bottom } = this.inner;
    const c = this.context, times = this.clock.times, n = face.abscissa.length;
    const x = this.clock.shown(), [i0, i1] = this.clock.window();
    this.range = { x };
    this.px = (value) => left + (right - left) * (value - x[0]) / (x[1] - x[0]);
    c.clearRect(0, 0, this.width, this.height);
    const columns = max(1, round(right - left)), rows = round(bottom - top);
    const order = face.abscissa.map((_, k) => k).sort((a, b) => face.abscissa[b] - face.abscissa[a]);
    const image = new ImageData(columns, n);
    const colours = contact.colours.map((colour) => colour
      ? [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)) : null);
    const source = what === "state" ? contact.state : what === "normal force" ? contact.normal
      : contact.along;
    for (let column = 0; column < columns; column++) {
      const edge = (k) => (x[0] + (x[1] - x[0]) * k / columns) * this.clock.unit;
      const from = clamp(before(times, edge(column + 0.5)), i0, i1);
      const until = clamp(before(times, edge(column + 1.5)), from + 1, i1 + 1);
      order.forEach((node, row) => {
        const at = face.first + node;
        let value = source.values[from * source.columns + at];
        for (let i = from + 1; what !== "state" && i < until; i++) {
          const next = source.values[i * source.columns + at];
          if (abs(next) > abs(value)) value = next;
        }
        const colour = what === "state" ? colours[value] : value === 0 ? null
          : this.shades[round(63 * min(1, abs(value) / contact.largest))];
        if (colour) image.data.set([...colour, 255], 4 * (row * columns + column));
      });
    }
    const small = el("canvas", { width: columns, height: n });
    small.getContext("2d").putImageData(image, 0, 0);
    c.fillStyle = css("--open");
    c.fillRect(left, top, columns, rows);
    c.imageSmoothingEnabled = false;
    c.drawImage(small, left, top, columns, rows);
    c.font = `11px ${css("--font")}`;
    c.fillStyle = css("--soft");
    c.textBaseline = "middle";
    c.textAlign = "right";
    const millimetres = (k) => (1e3 * face.abscissa[order[k]]).toPrecision(3).replace(/\.0*$/, "");
    c.fillText(millimetres(0), left - 6, top + 8);
    c.fillText(millimetres(n - 1), left - 6, bottom - 8);
    if (n > 1) c.fillText(`${face.label.slice(-1)} [mm]`, left - 6, 0.5 * (top + bottom));
    this.bottomLabels(c, ticks(...x, clamp((right - left) / 80, 2, 10)));
  }
}
