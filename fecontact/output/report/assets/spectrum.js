// Amplitude spectra over frequency, with a logarithmic axis; a click reads a frequency.

class Spectrum extends Chart {
  constructor({ title, unit, lines, frequency, values, decades }) {
    const x = frequency.values, { values: all, columns: count } = values;
    const read = { window: () => [0, x.length - 1], set: (hertz) => { this.at = hertz; this.point(); } };
    super(read, { title, unit, xLabel: "frequency [Hz]", lines: lines.map((line, k) => ({ ...line, x,
      y: Float64Array.from(x, (_, i) => all[i * count + k]) })) });
    this.decades = decades;
  }

  limits() {
    const high = this.lines.reduce((sum, { y }) => max(sum, max(...y)), -300) + 0.3;
    return { x: [0, this.lines[0].x.at(-1)], y: [high - this.decades, high] };
  }

  // The axis has common logarithms and shows the numbers themselves.
  levels(low, high) {
    const found = [];
    for (let k = Math.ceil(low); k <= high; k++) found.push([k, k > -4 && k < 5 ? `${+(10 ** k).toPrecision(1)}` : `1e${k}`]);
    return found;
  }

  timeAt(x) {
    const { left, right } = this.inner;
    return this.lines[0].x.at(-1) * clamp((x - left) / (right - left), 0, 1);
  }

  point() {
    const c = this.cursor, { top, bottom } = this.inner;
    c.clearRect(0, 0, this.width, this.height);
    if (this.at === undefined) return;
    c.fillStyle = css("accent");
    c.fillRect(this.px(this.at) - 0.5, top, 1, bottom - top);
    letters(c, this.px(this.at) > 0.7 * this.width ? "right" : "left");
    c.fillText(` ${+this.at.toPrecision(4)} Hz `, this.px(this.at), top + 10);
  }
}
