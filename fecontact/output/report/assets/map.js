// State or force of the nodes of one face over time.
class ContactMap extends Chart {
  constructor(clock, contact, face, shades) {
    const states = contact.states.map((name, k) => ({ name, back: contact.colours[k] || "var(--open)" }));
    super(clock, { title: face.title, lines: [{ name: "" }], legend: states, xLabel: clock.label,
      height: clamp(60 + 9 * face.abscissa.length, 90, 220), kind: "map" });
    Object.assign(this, { contact, face, shades, what: "state" });
    const pick = el("select", { ariaLabel: "quantity", onchange: () => {
      this.what = pick.value;
      this.bar.hide(this.what === "state");
      this.draw();
    } },
      ...options(["state", "normal force", "tangential force"]));
    this.node.firstChild.append(pick);
    this.bar = new ColourBar();
    this.node.append(this.bar.node);
    this.bar.show(shades, "0", quantity(contact.largest, "N"));
    this.bar.hide(true);
  }

  // State or size of a force at a node and an instant.
  reader() {
    const { state, forces } = this.contact, { rows, values } = forces, d = forces.columns / state.columns;
    if (this.what === "state") return (node, i) => state.values[node * state.rows + i];
    if (this.what === "normal force") return (node, i) => abs(values[(node * d + d - 1) * rows + i]);
    return (node, i) => hypot(values[node * d * rows + i], d > 2 ? values[(node * d + 1) * rows + i] : 0);
  }

  painted(value) {
    if (this.what !== "state") return value === 0 ? null : this.shades[round(63 * min(1, value / this.contact.largest))];
    const colour = this.contact.colours[value];
    return colour ? [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)) : null;
  }

  draw() {
    const { face, what } = this, { left, right, top, bottom } = this.inner;
    const c = this.context, times = this.clock.times, n = face.abscissa.length;
    const x = this.clock.shown(), [i0, i1] = this.clock.window();
    this.range = { x };
    this.px = (value) => left + (right - left) * (value - x[0]) / (x[1] - x[0]);
    c.clearRect(0, 0, this.width, this.height);
    const columns = max(1, round(right - left)), rows = round(bottom - top);
    const order = face.abscissa.map((_, k) => k).sort((a, b) => face.abscissa[b] - face.abscissa[a]);
    const image = new ImageData(columns, n);
    const value = this.reader();
    for (let column = 0; column < columns; column++) {
      const edge = (k) => (x[0] + (x[1] - x[0]) * k / columns) * this.clock.unit;
      const from = clamp(before(times, edge(column + 0.5)), i0, i1);
      const until = clamp(before(times, edge(column + 1.5)), from + 1, i1 + 1);
      order.forEach((node, row) => {
        const at = face.first + node;
        let most = value(at, from);
        // A contact shorter than a column of pixels is shown too.
        for (let i = from + 1; i < until; i++) most = what === "state" ? most || value(at, i) : max(most, value(at, i));
        const colour = this.painted(most);
        if (colour) image.data.set([...colour, 255], 4 * (row * columns + column));
      });
    }
    const small = el("canvas", { width: columns, height: n });
    small.getContext("2d").putImageData(image, 0, 0);
    c.fillStyle = css("open");
    c.fillRect(left, top, columns, rows);
    c.imageSmoothingEnabled = false;
    c.drawImage(small, left, top, columns, rows);
    letters(c, "right");
    c.textBaseline = "middle";
    const millimetres = (k) => (1e3 * face.abscissa[order[k]]).toPrecision(3).replace(/\.0*$/, "");
    c.fillText(millimetres(0), left - 6, top + 8);
    if (n > 1) c.fillText(millimetres(n - 1), left - 6, bottom - 8);
    if (n > 1) c.fillText(`${face.label.slice(-1)} [mm]`, left - 6, 0.5 * (top + bottom));
    this.bottomLabels(c, ticks(...x, clamp((right - left) / 80, 2, 10)));
  }
}

// The face itself at the drawn instant, in its tangent plane.
class Footprint extends ContactMap {
  constructor(...given) {
    super(...given);
    this.height = 220;
    this.node.querySelector("b").textContent += " at the time shown";
    this.top.onpointerdown = this.top.onpointermove = null;
  }

  draw() { this.point(); }

  point() {
    const { plan: { corners, owner, edges, labels, box: [left, right, low, high] }, first } = this.face;
    const c = this.context, { width, height } = this, value = this.reader();
    const size = min((width - 20) / (right - left), (height - 28) / (high - low));
    const path = ({ values, columns }, k) => {
      c.beginPath();
      for (let i = k * columns; i < (k + 1) * columns; i += 2) {
        c.lineTo(width / 2 + size * (values[i] - (left + right) / 2),
          (height - 20) / 2 - size * (values[i + 1] - (low + high) / 2));
      }
      c.closePath();
    };
    c.clearRect(0, 0, width, height);
    c.lineWidth = 0.6;
    owner.values.forEach((node, k) => {
      const colour = this.painted(value(first + node, this.clock.index));
      c.fillStyle = c.strokeStyle = colour ? `rgb(${colour})` : css("open");
      path(corners, k);
      c.fill();
      c.stroke();
    });
    c.strokeStyle = css("ink");
    for (let k = 0; k < edges.rows; k++) {
      path(edges, k);
      c.stroke();
    }
    letters(c, "center");
    c.fillText(`${labels[0]}: ${quantity(right - left, "m")}, ${labels[1]}: ${quantity(high - low, "m")}`, width / 2, height - 6);
  }
}
