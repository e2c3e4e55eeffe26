// The page of a run.

function modesTable(data, player, timing) {
  const rows = data.bodies.modes.map((texts, k) => {
    const button = el("button", { textContent: "shake" });
    button.onclick = () => {
      const stop = player.mode === k;
      for (const row of rows) row.at(-1).textContent = "shake";
      button.textContent = stop ? "shake" : "stop";
      player.mode = stop ? -1 : k;
      player.phase = 0;
      if (timing.on === stop) timing.toggle();
      player.draw();
      player.node.scrollIntoView({ block: "nearest", behavior: "smooth" });
    };
    return [...texts, button];
  });
  return table(["mode", "frequency [Hz]", "damping", "", ""], rows, "modes");
}

function states(contact) {
  return el("p.legend", {}, "contact nodes: ", ...contact.states.map((name, k) => {
    const dot = el("i");
    dot.style.background = contact.colours[k] || "transparent";
    return el("span", {}, dot, name);
  }), ...contact.slides?.length ? [`sliding: ${contact.slides.join(", ")}`] : [],
  `longest arrow: ${quantity(contact.largest, "N")}`);
}

async function build(host, data, dataset) {
  units = data.units;
  const clock = new Clock(data.time.values, dataset);
  const player = data.bodies ? new Player(data, clock) : null;
  const charts = data.charts.map((one) => new Chart(clock, overTime(one, clock)));
  const phases = data.phases.map(({ title, x, y }) => {
    const [one, other] = [x, y].map(([chart, line]) => ({ unit: data.charts[chart].unit, ...charts[chart].lines[line] }));
    return new Chart(clock, { title: `${title}: velocity [${other.unit}] over displacement [${one.unit}]`, xLabel: "",
      height: 220, kind: "phase", lines: [{ name: "", colour: other.colour, x: one.y, y: other.y }] });
  });
  const maps = data.contact ? data.contact.faces.flatMap((face) => (face.plan ? [Footprint, ContactMap] : [ContactMap])
    .map((kind) => new kind(clock, data.contact, face, data.maps["von Mises stress"]))) : [];
  const spectra = data.spectra.map((one) => one.maps.length ? new StillChart(one) : new Spectrum(one));
  const energies = data.energies.map((one) => new Chart(clock, overTime(one, clock)));
  const all = [...charts, ...spectra, ...phases, ...maps, ...energies];
  const resize = () => { for (const one of all) one.resize(); };
  const timing = controls(data, clock, player, resize);
  const nodes = (some) => some.map((one) => one.node);
  host.append(head(data), el("main", {},
    el("div.left", {}, el("section", {}, ...player ? [player.node, player.bar.node] : [],
    timing.bar, timing.more, ...player && data.contact ? [states(data.contact)] : []),
    ...section("Contact", ...nodes(maps))),
    el("div", {}, ...section("Histories", ...nodes(charts)),
      ...section("Spectra", ...nodes(spectra)),
      ...section("Phase portraits", ...phases.length ? [el("div.grid", {}, ...nodes(phases))] : []),
      ...section("Energies", ...nodes(energies), ...energies.length ? [el("p.legend", {}, data.balance)] : []),
      ...player ? section("Modes", modesTable(data, player, timing)) : [])),
  el("div.two", {}, ...section("Run", table([], data.facts), ...data.numbers.length ? [el("h3", {}, data.numbersOf), table([], data.numbers)] : []),
    ...section("System", table([], data.system))),
  ...cards("Study, in SI units", data.study), foot(data));
  const refresh = () => { player?.resize(); resize(); };
  clock.watchers.push(() => { if (player && player.mode < 0) player.draw(); },
    () => { for (const one of all) one.point(); });
  refresh();
  clock.set(clock.time);
  const close = ready(host, dataset, refresh, player, timing);
  data.rest().then(() => {
    data.whole = true;
    dataset.whole = round(performance.now());
    for (const one of maps) one.resize();
    clock.set(clock.time);
  });
  return { close, clock };
}
