// The page: builds itself of the data, as text only, and runs the clock.

const UNITS = { m: [[1e-9, "nm"], [1e-6, "µm"], [1e-3, "mm"], [1, "m"]],
  s: [[1e-6, "µs"], [1e-3, "ms"], [1, "s"]],
  Pa: [[1, "Pa"], [1e3, "kPa"], [1e6, "MPa"], [1e9, "GPa"]] };

function quantity(value, unit, digits = 3) {
  const fitting = UNITS[unit].filter(([factor]) => Math.abs(value) >= factor * (1 - 1e-9));
  const [factor, symbol] = value ? fitting.at(-1) ?? UNITS[unit][0] : [1, unit];
  return `${+(value / factor).toPrecision(digits)} ${symbol}`;
}

class Clock {
  constructor(times) {
    const end = Math.max(Math.abs(times[0]), Math.abs(times.at(-1)));
    [this.unit, this.symbol] = UNITS.s.filter(([factor]) => end >= factor).at(-1) ?? UNITS.s[0];
    this.times = times;
    this.axis = times.map((time) => time / this.unit);
    this.label = `time [${this.symbol}]`;
    this.range = [times[0], times.at(-1)];
    this.watchers = [];
    this.put(times[0]);
  }

  put(time) {
    this.time = clamp(time, this.range[0], this.range[1]);
    this.index = before(this.times, this.time + 1e-12 * Math.abs(this.time));
  }

  set(time) {
    this.put(time);
    for (const watch of this.watchers) watch();
    root.dataset.time = this.time;
  }

  shown() { return this.range.map((time) => time / this.unit); }

  window() { return [before(this.times, this.range[0]), before(this.times, this.range[1])]; }

  // A part of the run about the current time; the whole by a factor of infinity.
  show(factor) {
    const [first, last] = [this.times[0], this.times.at(-1)];
    const reach = Math.min(last - first, Math.max((this.range[1] - this.range[0]) * factor,
      4 * (last - first) / this.times.length));
    const begin = clamp(this.time - 0.5 * reach, first, last - reach);
    this.range = [begin, begin + reach];
  }
}

const field = (label, node) => el("label", {}, label, node);

function table(headings, rows, className = "") {
  const line = (cells, tag) => el("tr", {}, ...cells.map((text) => el(tag, {}, text)));
  return el("div", { className: "scroll" }, el("table", { className },
    ...headings.length ? [el("thead", {}, line(headings, "th"))] : [],
    el("tbody", {}, ...rows.map((row) => line(row, "td")))));
}

function section(title, ...children) {
  return children.length ? [el("section", {}, el("h2", {}, title), ...children)] : [];
}

function head(data) {
  return el("header", {}, el("h1", {}, data.title),
    el("p", { className: data.good ? "good" : "bad" }, data.status),
    ...data.notes.map((note) => el("p", { className: "note" }, note)));
}

function controls(data, clock, player, resize) {
  const playing = { on: false, speed: (clock.times.at(-1) - clock.times[0]) / 12 || 1, last: 0 };
  const play = el("button", { className: "play", textContent: "▶", ariaLabel: "play" });
  const scrub = el("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, className: "scrub",
    ariaLabel: "time" });
  const now = el("output");
  const tell = () => {
    const [low, high] = clock.range;
    now.textContent = `${(clock.time / clock.unit).toFixed(2)} ${clock.symbol}`;
    scrub.value = 1000 * (clock.time - low) / (high - low || 1);
  };
  scrub.oninput = () => clock.set(clock.range[0] + scrub.value / 1000 * (clock.range[1] - clock.range[0]));
  clock.watchers.push(tell);
  const speed = el("input", { type: "range", min: -3, max: 2, step: 0.05, value: 0, ariaLabel: "speed" });
  const pace = el("output");
  const setSpeed = () => {
    playing.speed = (clock.times.at(-1) - clock.times[0]) / 12 * 10 ** speed.value;
    pace.textContent = `${quantity(playing.speed, "s", 2)} a second`;
  };
  speed.oninput = setSpeed;
  setSpeed();
  const toggle = () => {
    playing.on = !playing.on;
    play.textContent = playing.on ? "❚❚" : "▶";
    play.ariaLabel = playing.on ? "pause" : "play";
  };
  play.onclick = toggle;
  addEventListener("keydown", (event) => {
    if (/INPUT|SELECT|BUTTON/.test(event.target.tagName)) return;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (event.key === " ") { event.preventDefault(); toggle(); }
    if (step) clock.set(clock.times[clamp(clock.index + step, 0, clock.times.length - 1)]);
  });
  const closer = (text, factor, name) => {
    const button = el("button", { textContent: text, ariaLabel: name, title: name });
    button.onclick = () => { clock.show(factor); resize(); clock.set(clock.time); };
    return button;
  };
  const bar = el("div", { className: "controls" }, play, scrub, now, closer("+", 0.5, "shorter part of the time"),
    closer("−", 2, "longer part of the time"));
  const more = el("div", { className: "controls" }, field("speed", speed), pace);
  if (player) addPlayer(data, player, more);
  const frame = (at) => {
    const passed = Math.min(0.1, (at - playing.last) / 1000);
    playing.last = at;
    if (playing.on && player?.mode >= 0) {
      player.phase = (player.phase ?? 0) + 5 * passed;
      player.draw();
    } else if (playing.on) {
      const next = clock.time + passed * playing.speed;
      clock.set(next > clock.range[1] ? clock.range[0] : next);
    }
    if (playing.on && player) root.dataset.frame = player.cost.toFixed(2);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
  return { bar, more, toggle, playing };
}

function addPlayer(data, player, more) {
  const choose = (names, label, change) => {
    const select = el("select", { ariaLabel: label }, ...names.map((name, k) => el("option", { value: k }, name)));
    select.onchange = () => { change(+select.value); player.draw(); };
    return select;
  };
  const paints = player.paints;
  const magnify = el("input", { type: "range", min: 0, max: 1, step: 0.002, ariaLabel: "magnification" });
  const factor = el("output");
  const top = Math.log(Math.max(10 * data.scale, 10));
  magnify.value = Math.log(data.scale) / top;
  magnify.oninput = () => {
    player.scale = Math.exp(top * magnify.value);
    player.swing = player.scale / data.scale;
    factor.textContent = `${+player.scale.toPrecision(2)} ×`;
    player.draw();
  };
  magnify.oninput();
  const arrows = el("input", { type: "checkbox", checked: true });
  arrows.onchange = () => { player.arrows = arrows.checked; player.draw(); };
  more.append(field("deformation", magnify), factor,
    field("colour", choose(paints, "colour", (k) => { player.paint = paints[k]; })),
    ...data.contact ? [field("forces", arrows)] : []);
}

function modesTable(data, player, timing) {
  const rows = data.bodies.modes.map((mode, k) => {
    const row = el("tr", {}, ...[mode.name, mode.hz ? +mode.hz.toPrecision(6) : "0",
      mode.hz ? `${+(100 * mode.damping).toPrecision(3)} %` : "", mode.kind].map((text) => el("td", {}, text)));
    const button = el("button", { textContent: "shake", data: { mode: k } });
    button.onclick = () => {
      const same = player.mode === k;
      player.mode = same ? -1 : k;
      player.phase = 0;
      root.dataset.mode = player.mode;
      for (const one of row.parentNode.querySelectorAll("button")) one.textContent = "shake";
      if (!same) button.textContent = "stop";
      if (timing.playing.on === same) timing.toggle();
      player.draw();
      player.node.scrollIntoView({ block: "nearest", behavior: "smooth" });
    };
    row.append(el("td", {}, button));
    return row;
  });
  const made = table(["mode", "frequency [Hz]", "damping", "", ""], [], "modes");
  made.querySelector("tbody").append(...rows);
  return made;
}

function states(contact) {
  return el("p", { className: "legend" }, "contact nodes: ", ...contact.states.map((name, k) => {
    const dot = el("i");
    dot.style.background = contact.colours[k] || "transparent";
    return el("span", {}, dot, name);
  }), ...contact.slides?.length ? [`sliding: ${contact.slides.join(", ")}`] : []);
}

function columns({ values, lines, title, unit }, clock) {
  const { values: all, columns: count, rows } = values;
  return { title, unit, xLabel: clock.label, lines: lines.map((line, k) => ({ ...line,
    y: Float64Array.from({ length: rows }, (_, i) => all[i * count + k]) })) };
}

async function build(host) {
  const data = await readBlock(document.getElementById("payload").textContent);
  const clock = new Clock(data.time.values);
  const player = data.bodies ? new Player(data, clock) : null;
  const charts = data.charts.map((one) => new Chart(clock, { ...columns(one, clock), kind: "history" }));
  const phases = data.phases.map(({ title, x, y }) => {
    const [one, other] = [x, y].map(([chart, line]) => ({ unit: data.charts[chart].unit, ...charts[chart].lines[line] }));
    return new Chart(clock, { title: `velocity [${other.unit}], ${title}`, xLabel: `displacement [${one.unit}]`,
      height: 220, kind: "phase", lines: [{ name: "", colour: other.colour, x: one.y, y: other.y }] });
  });
  const maps = data.contact ? data.contact.faces.map((face) => new ContactMap(clock, data.contact, face,
    data.maps?.von_mises ?? Array.from({ length: 64 }, (_, k) => [255 - 3 * k, 255 - 3 * k, 255]))) : [];
  const energies = data.energies.map((one) => new Chart(clock, { ...columns(one, clock), kind: "energy" }));
  const all = [...charts, ...phases, ...maps, ...energies];
  const resize = () => { for (const one of all) one.resize(); };
  const timing = controls(data, clock, player, resize);
  const nodes = (some) => some.map((one) => one.node);
  host.append(head(data), el("main", {},
    el("section", { className: "motion" }, ...player ? [player.node] : [el("p", {},
      "The modal basis of this run holds no shapes over the body, so that there is nothing to draw.")],
    timing.bar, timing.more, ...player && data.contact ? [states(data.contact)] : []),
    ...section("Contact", ...nodes(maps)),
    el("div", { className: "two" },
      el("div", {}, ...section("Histories", ...nodes(charts))),
      el("div", {}, ...section("Phase portraits", el("div", { className: "grid" }, ...nodes(phases))),
        ...section("Energies", ...nodes(energies),
          el("p", { className: "legend" }, `error of the balance: ${data.balance.toExponential(1)} of the largest term`)))),
    ...player ? section("Modes", modesTable(data, player, timing)) : [],
    el("div", { className: "two" }, ...section("Run", table([], data.facts)),
      ...section("System", table([], data.system))),
    ...data.study.length ? section("Study", el("div", { className: "grid" },
      ...data.study.map(({ name, rows }) => el("div", {}, ...name ? [el("h3", {}, `[${name}]`)] : [],
        table([], rows))))) : []),
    el("footer", {}, data.versions.map((pair) => pair.join(" ")).join(" · ")));
  const refresh = () => { player?.resize(); resize(); };
  clock.watchers.push(() => { if (player && player.mode < 0) player.draw(); },
    () => { for (const one of all) one.point(); });
  refresh();
  clock.set(clock.time);
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; refresh(); } });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
  root.dataset.ready = 1;
}

build(document.body).catch((error) => {
  document.body.append(el("p", { className: "missing" }, typeof DecompressionStream === "undefined"
    ? "This browser is too old to read this report; use one of 2023 or later."
    : `This report cannot be read: ${error.message}`));
});
