// Charts on two layers: curves, drawn once for each size, and the cursor, drawn for each instant.

const { abs, floor, hypot, max, min, round } = Math;
// Colours are those of the element that was built last, looked up once: a page that changes between
// light and dark is built anew.
let palette = {}, styled;
const css = (name) => palette[name] ??= getComputedStyle(styled).getPropertyValue("--" + name).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");
const clamp = (x, low, high) => min(max(x, low), high);

// An element by "tag.class", with properties and children, of which strings are text.
function el(name, props = {}, ...children) {
  const [tag, className = ""] = name.split(".");
  const node = Object.assign(document.createElement(tag), { className }, props);
  node.append(...children);
  return node;
}

// Colours of prints are too dark before a dark page.
function themed(colour) {
  if (!colour) return css("ink");
  if (!dark.matches) return colour;
  const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgb(${parts.map((part) => round(part + 0.35 * (255 - part)))})`;
}

// Labels have the digits that tell them apart, large and small ones with a power of ten.
function ticks(low, high, most) {
  const rough = (high - low) / most, power = 10 ** floor(Math.log10(rough));
  const step = power * ([1, 2, 5].find((digit) => digit * power >= rough) ?? 10);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  const place = floor(Math.log10(step) + 1e-9), largest = max(abs(low), abs(high));
  const label = largest < 1e5 && place > -5 ? (value) => value.toFixed(max(0, -place))
    : (value) => abs(value) < step / 2 ? "0"
      : value.toExponential(clamp(floor(Math.log10(abs(value)) + 1e-9) - place, 0, 15)).replace("e+", "e");
  return found.map((value) => [value, label(value).replace(/^-(0(\.0*)?)$/, "$1")]);
}

// On a logarithmic axis, of common logarithms: 1, 2, 5 in each decade where there is room, else powers
// of ten.
function decades(low, high, most) {
  const digits = high - low < most / 4 ? [1, 2, 5] : [1], found = [];
  for (let k = floor(low); k <= high; k++) {
    for (const digit of digits) {
      const at = k + Math.log10(digit);
      if (at >= low && at <= high) found.push([at, k > -4 && k < 5 ? `${+(digit * 10 ** k).toPrecision(1)}` : `${digit}e${k}`]);
    }
  }
  return found.length > 1 ? found : ticks(low, high, most).map(([at]) => [at, `${+(10 ** at).toPrecision(3)}`]);
}

// Index of the last time that is not after t.
function before(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

function layer(canvas, width, height) {
  const ratio = devicePixelRatio, context = canvas.getContext("2d");
  canvas.width = round(width * ratio);
  canvas.height = round(height * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

// Lines of a diagram of the page: over the clock, or over abscissae of their own.
const linesOf = ({ lines }) => lines.map(({ x, y, solid, bars, limits, ...line }) => ({
  ...line, y: y.values, x: x?.values, solid: solid?.values, bars: bars?.map(({ values }) => values),
  limits: limits?.map(({ values }) => values) }));

// Letters of labels.
function letters(c, textAlign) {
  c.font = `11px ${css("font")}`;
  c.fillStyle = css("soft");
  c.textAlign = textAlign;
}

class Chart {
  // lines: [{name, colour, width?, x?, y, solid?, marker?, bars?, limits?}] with arrays; without x over
  // the time of the clock; bars and shaded limits have [lower, upper] ends.
  // Logarithmic axes, named in `log`, have common logarithms; `limits` fixes ends of axes, `marks` are
  // places with letters, `levels` straight lines at a value of an axis, `maps` coloured cells behind them.
  constructor(clock, { title, unit, xLabel, lines, legend = lines, height = 132, kind = "chart",
    log = "", limits = {}, marks = [], levels = [], maps = [] }) {
    Object.assign(this, { clock, lines, xLabel, height, log, marks, levels, maps, ends: limits });
    this.base = el("canvas");
    this.top = el("canvas");
    this.box = el("div.plot", {}, this.base, this.top);
    this.node = el(`figure.${kind}`, {}, el("figcaption", {},
      el("b", {}, unit ? `${title} [${unit}]` : title), ...this.legend(legend)), this.box);
    const move = (event) => this.clock.set(this.timeAt(event.offsetX, event.offsetY));
    this.top.onpointerdown = (event) => { this.top.setPointerCapture(event.pointerId); move(event); };
    this.top.onpointermove = (event) => { if (event.buttons) move(event); };
  }

  legend(lines) {
    const named = lines.filter(({ name }, k) => name && lines.findIndex((line) => line.name === name) === k);
    if (named.length < 2) return [];
    return named.map(({ name, colour, back }) => {
      const swatch = el("i");
      swatch.style.background = back || themed(colour);
      return el("span", {}, swatch, name);
    });
  }

  resize() {
    this.width = this.box.clientWidth || 300;
    this.box.style.height = `${this.height}px`;
    this.inner = { left: 52, right: this.width - 10, top: 6, bottom: this.height - 22 };
    this.context = layer(this.base, this.width, this.height);
    this.cursor = layer(this.top, this.width, this.height);
    this.draw();
    this.point();
  }

  get overTime() { return this.lines.length > 0 && !this.lines[0].x; }

  limits() {
    const [i0, i1] = this.clock.window();
    const span = (name) => {
      let low = Infinity, high = -low;
      for (const line of this.lines) {
        // What is not a number is smaller and larger than nothing.
        for (const values of [line[name], ...name === "y" ? [...line.bars ?? [], ...line.limits ?? []] : []]) {
          for (let i = i0; i <= i1; i++) {
            if (values[i] < low) low = values[i];
            if (values[i] > high) high = values[i];
          }
        }
      }
      for (const one of this.maps) [low, high] = [min(low, one[name].values[0]), max(high, one[name].values.at(-1))];
      // A curve that is constant to round-off is drawn as one.
      const flat = !(high - low > 1e-12 * max(abs(low), abs(high)));
      const room = this.maps.length ? 0 : flat ? 0.1 * abs(high) || 1 : 0.06 * (high - low);
      const [first, last] = this.ends[name] ?? [];
      return [first ?? low - room, last ?? high + room];
    };
    return { x: this.overTime ? this.clock.shown() : span("x"), y: span("y") };
  }

  draw() {
    const c = this.context, { x, y } = this.limits();
    const places = (name) => this.log.includes(name) ? decades : ticks, ys = places("y")(...y, this.height / 32);
    letters(c, "right");
    // Labels of many digits need a wider margin.
    this.inner.left = max(52, 10 + max(...ys.map(([, text]) => c.measureText(text).width)));
    const { left, right, top, bottom } = this.inner;
    this.px = (value) => left + (right - left) * (value - x[0]) / (x[1] - x[0]);
    this.py = (value) => bottom - (bottom - top) * (value - y[0]) / (y[1] - y[0]);
    this.range = { x, y };
    c.clearRect(0, 0, this.width, this.height);
    c.strokeStyle = css("grid");
    c.lineWidth = 1;
    const xs = places("x")(...x, clamp((right - left) / 70, 2, 10));
    c.beginPath();
    for (const [value] of xs) { c.moveTo(this.px(value), top); c.lineTo(this.px(value), bottom); }
    for (const [value] of ys) { c.moveTo(left, this.py(value)); c.lineTo(right, this.py(value)); }
    c.stroke();
    c.textBaseline = "middle";
    for (const [value, text] of ys) c.fillText(text, left - 6, this.py(value));
    this.bottomLabels(c, xs);
    c.save();
    c.beginPath();
    c.rect(left, top - 1, right - left, bottom - top + 2);
    c.clip();
    for (const one of this.maps) this.coloured(c, one);
    c.strokeStyle = css("mark");
    c.beginPath();
    for (const [name, value] of this.levels) {
      if (name === "x") { c.moveTo(this.px(value), top); c.lineTo(this.px(value), bottom); }
      else { c.moveTo(left, this.py(value)); c.lineTo(right, this.py(value)); }
    }
    c.stroke();
    for (const line of this.lines) {
      c.strokeStyle = c.fillStyle = themed(line.colour);
      if (line.limits) this.shaded(c, line);
      c.lineWidth = line.width || 1.2;
      c.beginPath();
      if (line.width === 0) this.barred(c, line);
      else if (line.x) this.trace(c, line); else this.envelope(c, line.y);
      c.stroke();
      if (line.solid) this.dashed(c, line);
      if (line.marker) this.dotted(c, line);
    }
    c.restore();
    c.font = `600 12px ${css("font")}`;
    c.textAlign = "left";
    for (const [at, height, text] of this.marks) this.circle(c, this.px(at), this.py(height), text);
  }

  circle(c, x, y, text) {
    c.beginPath();
    c.arc(x, y, 4.5, 0, 7);
    c.fillStyle = css("panel");
    c.strokeStyle = css("ink");
    c.lineWidth = 1.2;
    c.fill();
    c.stroke();
    c.fillStyle = css("ink");
    c.fillText(text, x + 7, y - 9);
  }

  // Cells have the number of their colour, from 1; 0 for none.
  coloured(c, { x, y, cells, shades }) {
    const columns = x.values.length - 1, across = Array.from(x.values, this.px), up = Array.from(y.values, this.py);
    cells.values.forEach((number, k) => {
      if (!number) return;
      const i = k % columns, j = (k - i) / columns;
      c.fillStyle = `rgb(${shades[number - 1]})`;
      c.fillRect(across[i], up[j + 1], across[i + 1] - across[i] + 0.4, up[j] - up[j + 1] + 0.4);
    });
  }

  bottomLabels(c, xs) {
    const y = this.inner.bottom + 13, width = c.measureText(this.xLabel).width;
    c.textAlign = "right";
    c.fillText(this.xLabel, this.width - 2, y);
    c.textAlign = "center";
    for (const [value, text] of xs) {
      if (this.px(value) + 16 < this.width - width) c.fillText(text, this.px(value), y);
    }
  }

  trace(c, { x, y, solid }) {
    const [i0, i1] = this.clock.window(), end = min(i1, x.length - 1);
    for (let i = i0; i <= end; i++) {
      if (solid && i && !solid[i - 1]) c.moveTo(this.px(x[i]), this.py(y[i]));
      else c.lineTo(this.px(x[i]), this.py(y[i]));
    }
  }

  // The range between limits, piece by piece, each from left to right.
  shaded(c, { x, limits: [low, high] }) {
    c.globalAlpha = 0.25;
    c.beginPath();
    for (let i = 1; i < x.length; i++) {
      const [a, b] = x[i - 1] < x[i] ? [i - 1, i] : [i, i - 1];
      c.moveTo(this.px(x[a]), this.py(low[a]));
      for (const [k, end] of [[b, low], [b, high], [a, high]]) c.lineTo(this.px(x[k]), this.py(end[k]));
      c.closePath();
    }
    c.fill();
    c.globalAlpha = 1;
  }

  barred(c, { x, bars }) {
    bars?.[0].forEach((low, i) => {
      c.moveTo(this.px(x[i]), this.py(low));
      c.lineTo(this.px(x[i]), this.py(bars[1][i]));
    });
  }

  dotted(c, { x, y, marker }) {
    c.beginPath();
    x.forEach((at, i) => {
      c.moveTo(this.px(at), this.py(y[i]));
      c.arc(this.px(at), this.py(y[i]), 0.6 * marker, 0, 7);
    });
    c.fill();
  }

  // Pieces that are not solid are dashed and thin.
  dashed(c, { x, y, solid }) {
    c.beginPath();
    c.setLineDash([6, 4]);
    c.lineWidth = 1.2;
    solid.forEach((whole, i) => {
      if (whole) return;
      if (!i || solid[i - 1]) c.moveTo(this.px(x[i]), this.py(y[i]));
      c.lineTo(this.px(x[i + 1]), this.py(y[i + 1]));
    });
    c.stroke();
    c.setLineDash([]);
  }

  // Of many values in a column of pixels: what comes in, the lowest, the highest, what goes out.
  envelope(c, y) {
    const [i0, i1] = this.clock.window(), times = this.clock.axis;
    for (let i = i0; i <= i1;) {
      const column = floor(this.px(times[i]));
      let low = y[i], high = low, last = i;
      while (last < i1 && floor(this.px(times[last + 1])) === column) {
        last++;
        if (y[last] < low) low = y[last];
        if (y[last] > high) high = y[last];
      }
      c.lineTo(this.px(times[i]), this.py(y[i]));
      if (last > i + 2) { c.lineTo(column, this.py(low)); c.lineTo(column + 0.5, this.py(high)); }
      if (last > i) c.lineTo(this.px(times[last]), this.py(y[last]));
      i = last + 1;
    }
  }

  timeAt(x, y) {
    if (this.overTime) {
      const [low, high] = this.range.x, { left, right } = this.inner;
      return (low + (high - low) * clamp((x - left) / (right - left), 0, 1)) * this.clock.unit;
    }
    let best = Infinity, found = 0;
    const [i0, i1] = this.clock.window();
    for (const line of this.lines) {
      for (let i = i0; i <= i1; i++) {
        const away = hypot(this.px(line.x[i]) - x, this.py(line.y[i]) - y);
        if (away < best) { best = away; found = i; }
      }
    }
    return this.clock.times[found];
  }

  point() {
    const c = this.cursor, { index, axis } = this.clock, { top, bottom } = this.inner;
    c.clearRect(0, 0, this.width, this.height);
    if (this.overTime) {
      c.fillStyle = css("accent");
      c.fillRect(this.px(this.clock.time / this.clock.unit) - 0.5, top, 1, bottom - top);
    }
    for (const line of this.lines) {
      if (!line.y) continue;
      c.fillStyle = themed(line.colour);
      c.beginPath();
      c.arc(this.px(line.x ? line.x[index] : axis[index]), this.py(line.y[index]), 3.5, 0, 7);
      c.fill();
    }
  }
}

// A chart over abscissae of its own; a click gives the number of the nearest point of its first line.
class StillChart extends Chart {
  constructor(diagram, pick = () => {}) {
    const lines = linesOf(diagram), longest = max(0, ...lines.map(({ x }) => x.length)) - 1;
    super({ window: () => [0, longest], set: pick }, { ...diagram, lines });
    for (const { shades, ends, label } of this.maps) {
      const bar = new ColourBar();
      bar.show(shades, ...ends);
      bar.node.append(label);
      this.node.append(bar.node);
    }
  }

  timeAt(x, y) {
    const [line] = this.lines, away = Array.from(line?.x ?? [], (at, i) => hypot(this.px(at) - x, this.py(line.y[i]) - y));
    return away.indexOf(min(...away));
  }

  point() {
    const c = this.cursor, { chosen } = this;
    c.clearRect(0, 0, this.width, this.height);
    if (chosen === undefined) return;
    c.fillStyle = css("accent");
    for (const { x, y } of this.lines) {
      c.beginPath();
      c.arc(this.px(x[chosen]), this.py(y[chosen]), 4, 0, 7);
      c.fill();
    }
  }
}
