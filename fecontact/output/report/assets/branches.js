// The page of branches: a diagram whose points show their orbit.

class Diagram extends Chart {
  constructor(data, which, pick) {
    const diagram = data.diagrams[which];
    const lines = linesOf(diagram).map((line) => ({ ...line, kept: data.branches[line.branch].kept }));
    const longest = max(...lines.map(({ x }) => x.length)) - 1;
    super({ window: () => [0, longest], set: pick }, { ...diagram, lines, legend: which ? [] : lines, kind: "diagram" });
  }

  // The point that was picked in this diagram or in another one.
  mark({ line, index }) {
    const own = this.lines.includes(line) ? line : this.lines.find(({ branch }) => branch === line.branch);
    this.chosen = { line: own, index };
    this.point();
  }

  // Of the points whose orbits are stored, the nearest.
  timeAt(x, y) {
    let best = Infinity, found;
    for (const line of this.lines) {
      line.kept.forEach((index, number) => {
        const away = hypot(this.px(line.x[index]) - x, this.py(line.y[index]) - y);
        if (away < best) { best = away; found = { line, index, number }; }
      });
    }
    return found;
  }

  point() {
    const c = this.cursor, { chosen } = this;
    c.clearRect(0, 0, this.width, this.height);
    if (!chosen) return;
    c.fillStyle = css("accent");
    c.beginPath();
    c.arc(this.px(chosen.line.x[chosen.index]), this.py(chosen.line.y[chosen.index]), 5, 0, 7);
    c.fill();
  }
}

async function build(host, data, dataset) {
  units = data.units;
  const { orbits } = data, samples = data.samples;
  const phases = Float64Array.from({ length: samples }, (_, k) => k / (samples - 1));
  const clock = new Clock(phases, dataset);
  const part = ({ values, columns }, number) => values.slice(number * samples * columns, (number + 1) * samples * columns);
  if (data.bodies) data.coordinates = { columns: orbits.coordinates.columns, values: [] };
  const line = (name) => ({ name: "", colour: data.branches[0].colour, [name]: phases });
  const history = new Chart(clock, { title: data.observed, unit: orbits.units[0], xLabel: "", lines: [line("y")] });
  const phase = new Chart(clock, { title: `velocity [${orbits.units[1]}] over displacement [${orbits.units[0]}]`,
    xLabel: "", lines: [{ ...line("x"), y: phases }], height: 220, kind: "phase" });
  const facts = el("div");
  const choose = (chosen) => {
    const { line, number: place } = chosen, branch = data.branches[line.branch], number = branch.first + place;
    clock.load(phases.map((value) => value * orbits.periods.values[number]));
    if (player) data.coordinates.values = part(orbits.coordinates, number);
    history.xLabel = clock.label;
    history.lines[0].y = phase.lines[0].x = part(orbits.displacement, number);
    phase.lines[0].y = part(orbits.velocity, number);
    history.lines[0].colour = phase.lines[0].colour = branch.colour;
    facts.replaceChildren(table([], [["branch", branch.name], ...data.columns.map((name, k) =>
      [name, branch.rows[place][k]]).filter(([, text]) => text)]));
    dataset.orbit = number;
    if (orbits.scales) {
      const scale = Math.log(orbits.scales[number]), slider = timing.more.querySelector("[aria-label=deformation]");
      slider.max = max(slider.max, scale + 2.3);
      slider.value = scale;
      slider.oninput();
    }
    for (const diagram of diagrams) diagram.mark(chosen);
    player?.draw();
    history.resize();
    phase.resize();
    clock.set(0);
  };
  const player = data.bodies ? new Player(data, clock) : null;
  const diagrams = data.diagrams.map((_, which) => new Diagram(data, which, choose));
  const resize = () => { history.resize(); phase.resize(); };
  if (player) data.coordinates.values = part(orbits.coordinates, 0);
  const timing = controls(data, clock, player, resize, 3);
  host.append(head(data), el("main", {},
    el("div.left", {}, ...section("Diagram", ...diagrams.map(({ node }) => node))),
    el("div", {}, el("section", {}, ...player ? [player.node, player.bar.node] : [], timing.bar, timing.more),
      ...section("Point", facts), ...section("Motion", history.node, phase.node))),
  ...cards("Study, in SI units", data.study), foot(data));
  const refresh = () => { player?.resize(); for (const diagram of diagrams) diagram.resize(); resize(); };
  clock.watchers.push(() => { player?.draw(); history.point(); phase.point(); });
  phase.lines[0].x = part(orbits.displacement, 0);
  refresh();
  const [first] = diagrams[0].lines;
  choose({ line: first, index: first.kept[0], number: 0 });
  return { close: ready(host, dataset, refresh, player, timing), clock };
}
