// Amplitude spectra over frequency; a click reads a frequency.

class Spectrum extends StillChart {
  constructor(diagram) {
    super(diagram, (hertz) => { this.at = hertz; this.point(); });
  }

  timeAt(x) {
    const { left, right } = this.inner, [low, high] = this.range.x;
    return low + (high - low) * clamp((x - left) / (right - left), 0, 1);
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
