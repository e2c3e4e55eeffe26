// What pages are made of: the clock, its controls, tables. All texts are put in as text only.

// Units by their base, [factor, symbol] in ascending order, as the package shows numbers.
let units;

function quantity(value, unit, digits = 3) {
  const fitting = units[unit].filter(([factor]) => abs(value) >= factor * (1 - 1e-9));
  const [factor, symbol] = value ? fitting.at(-1) ?? units[unit][0] : [1, unit];
  return `${+(value / factor).toPrecision(digits)} ${symbol}`;
}

// Colours, with texts at both ends.
class ColourBar {
  constructor() {
    this.ends = [el("span"), el("span")];
    this.bar = el("canvas.bar", { width: 64, height: 1 });
    this.node = el("p.legend", {}, this.ends[0], this.bar, this.ends[1]);
  }

  show(shades, low, high) {
    const c = this.bar.getContext("2d");
    shades.forEach((one, k) => { c.fillStyle = `rgb(${one})`; c.fillRect(k, 0, 1, 1); });
    [low, high].forEach((text, k) => { this.ends[k].textContent = text; });
  }

  hide(away) { this.node.style.display = away ? "none" : ""; }
}

class Clock {
  constructor(times, dataset) {
    this.watchers = [];
    this.dataset = dataset;
    this.load(times);
  }

  load(times) {
    const first = times[0], last = times.at(-1), end = max(abs(first), abs(last));
    [this.unit, this.symbol] = units.s.filter(([factor]) => end >= factor).at(-1) ?? units.s[0];
    this.times = times;
    this.axis = times.map((time) => time / this.unit);
    this.label = `time [${this.symbol}]`;
    this.whole = last - first || 1;
    this.range = [first, last];
    this.put(first);
  }

  put(time) {
    this.time = clamp(time, this.range[0], this.range[1]);
    this.index = before(this.times, this.time + 1e-12 * abs(this.time));
  }

  set(time) {
    this.put(time);
    for (const watch of this.watchers) watch();
    this.dataset.time = this.time;
  }

  shown() { return this.range.map((time) => time / this.unit); }

  window() { return [before(this.times, this.range[0]), before(this.times, this.range[1])]; }

  // A part of the run about the current time; the whole by a factor of infinity.
  show(factor) {
    const [first, last] = [this.times[0], this.times.at(-1)];
    const reach = min(last - first, max((this.range[1] - this.range[0]) * factor,
      4 * (last - first) / this.times.length));
    const begin = clamp(this.time - 0.5 * reach, first, last - reach);
    this.range = [begin, begin + reach];
  }
}

const field = (label, node) => el("label", {}, label, node);

function table(headings, rows, className = "plain") {
  const line = (cells, tag) => el("tr", {}, ...cells.map((text) => el(tag, {}, text)));
  return el("div.scroll", {}, el(`table.${className}`, {},
    ...headings.length ? [el("thead", {}, line(headings, "th"))] : [],
    el("tbody", {}, ...rows.map((row) => line(row, "td")))));
}

function section(title, ...children) {
  return children.length ? [el("section", {}, el("h2", {}, title), ...children)] : [];
}

function head(data) {
  return el("header", {}, el("h1", {}, data.title),
    el(data.good ? "p.good" : "p.bad", {}, data.status),
    ...data.notes.map((note) => el("p.note", {}, note)));
}

function slider(ariaLabel, min, max, value, oninput) {
  return el("input", { type: "range", step: "any", min, max, value, ariaLabel, oninput });
}

// `lap` is how many seconds the whole takes at the middle of the slider.
function controls(data, clock, player, resize, lap = 12) {
  const play = el("button.play", { textContent: "▶", ariaLabel: "play" });
  const now = el("output"), pace = el("output");
  let last = 0;
  const timing = { on: false, toggle() {
    timing.on = !timing.on;
    play.textContent = timing.on ? "❚❚" : "▶";
    play.ariaLabel = timing.on ? "pause" : "play";
    last = performance.now();
    if (timing.on) requestAnimationFrame(frame);
  } };
  const span = () => clock.range[1] - clock.range[0];
  const scrub = slider("time", 0, 1000, 0, () => clock.set(clock.range[0] + scrub.value / 1000 * span()));
  scrub.className = "scrub";
  clock.watchers.push(() => {
    now.textContent = `${(clock.time / clock.unit).toFixed(2)} ${clock.symbol}`;
    scrub.value = 1000 * (clock.time - clock.range[0]) / span();
    pace.textContent = `${quantity(speed(), "s", 2)} per s`;
  });
  const speeds = slider("speed", -3, 2, 0, () => clock.set(clock.time));
  const speed = () => clock.whole / lap * 10 ** speeds.value;
  play.onclick = timing.toggle;
  timing.key = (event) => {
    if (/INPUT|SELECT|BUTTON/.test(event.composedPath()[0].tagName)) return;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (event.key === " ") { event.preventDefault(); timing.toggle(); }
    if (step) clock.set(clock.times[clamp(clock.index + step, 0, clock.times.length - 1)]);
  };
  const closer = (textContent, factor, title) => el("button", { textContent, title,
    onclick() { clock.show(factor); resize(); clock.set(clock.time); } });
  timing.bar = el("div.controls", {}, play, scrub, now,
    closer("+", 0.5, "zoom in"), closer("−", 2, "zoom out"));
  timing.more = el("div.controls", {}, field("speed", speeds), pace);
  if (player) addPlayer(data, player, timing.more);
  const frame = (at) => {
    if (!timing.on) return;
    const passed = clamp((at - last) / 1000, 0, 0.1);
    last = at;
    if (player?.mode >= 0) {
      player.phase += 5 * passed;
      player.draw();
    } else {
      const next = clock.time + passed * speed();
      clock.set(next > clock.range[1] ? clock.range[0] : next);
    }
    if (player) clock.dataset.frame = player.cost.toFixed(2);
    requestAnimationFrame(frame);
  };
  return timing;
}

const options = (names) => names.map((name) => el("option", {}, name));

function addPlayer(data, player, more) {
  const factor = el("output"), { paints } = data.bodies, given = Math.log(data.scale);
  const colour = el("select", { ariaLabel: "colour", onchange() { player.paint = colour.value; player.draw(); } },
    ...options(paints));
  const magnify = slider("deformation", min(0, given), max(2.3, given + 2.3), given, () => {
    player.scale = Math.exp(magnify.value);
    player.swing = player.scale / data.scale;
    factor.textContent = `${+player.scale.toPrecision(2)} ×`;
    player.draw();
  });
  magnify.oninput();
  const ticked = (name, checked) => {
    const box = el("input", { type: "checkbox", checked, onchange() { player[name] = box.checked; player.draw(); } });
    return box;
  };
  more.append(field("deformation", magnify), factor, field("colour", colour),
    ...data.contact ? [field("forces", ticked("arrows", true))] : []);
  if (player.d < 3) return;
  const view = el("select", { ariaLabel: "view", onchange() { player.look(view.value); player.draw(); } },
    ...options(Object.keys(VIEWS)));
  more.append(field("view", view), field("see-through", ticked("through")));
}

// A diagram over the time of the clock.
const overTime = (diagram, clock) => ({ ...diagram, xLabel: clock.label, lines: linesOf(diagram) });

function cards(title, sections) {
  return section(title, ...sections.length ? [el("div.cards", {}, ...sections.map(({ name, rows }) =>
    el("div", {}, ...name ? [el("h3", {}, `[${name}]`)] : [], table([], rows))))] : []);
}

function foot(data) {
  return el("footer", {}, data.versions.map((pair) => pair.join(" ")).join(" · "));
}

// What goes on while a page is there, and what ends it.
function ready(host, dataset, refresh, player, timing) {
  let width = host.clientWidth;
  const watch = new ResizeObserver(() => {
    if (host.clientWidth !== width) { width = host.clientWidth; refresh(); }
  });
  watch.observe(host);
  const keys = styled === document.documentElement ? window : styled;
  if (timing) keys.addEventListener("keydown", timing.key);
  dataset.ready = round(performance.now());
  return () => {
    watch.disconnect();
    if (timing) keys.removeEventListener("keydown", timing.key);
    if (timing?.on) timing.toggle();
    player?.close();
  };
}

// Builds a page in a host with the colours of its `root`, which notes what is shown; builds it again where
// the page changes between light and dark; returns what ends it.
async function show(host, block, root, built) {
  let close;
  const again = async () => {
    close?.();
    palette = {};
    styled = root;
    host.replaceChildren();
    try {
      const page = await build(host, await readBlock(block), root.dataset);
      close = page.close;
      built?.(page.clock);
    } catch (error) {
      host.append(el("p.missing", {}, typeof DecompressionStream === "undefined"
        ? "This browser is too old for this report; take one of 2023 or later."
        : `This report cannot be read: ${error.message}`));
    }
  };
  await again();
  dark.addEventListener("change", again);
  return () => { dark.removeEventListener("change", again); close?.(); };
}
