// The page of a comparison of runs.

async function build(host, data, dataset) {
  units = data.units;
  const clock = data.time ? new Clock(data.time.values, dataset) : null;
  const charts = clock ? data.charts.map((one) => new Chart(clock, { ...overTime(one, clock), height: 180 })) : [];
  const spectra = data.spectra.map((one) => new Spectrum(one));
  const all = [...charts, ...spectra], nodes = (some) => some.map((one) => one.node);
  const resize = () => { for (const one of all) one.resize(); };
  const timing = clock && controls(data, clock, null, resize);
  host.append(head(data),
    ...section("Key numbers", ...data.numbers.length ? [table(["", ...data.names], data.numbers, "many")] : []),
    ...section("Parameters that differ", ...data.parameters.length
      ? [table(["", ...data.names], data.parameters, "many")] : [el("p", {}, data.same)]),
    el("main", {}, el("div", {}, ...section("Histories", ...nodes(charts), ...timing ? [timing.bar] : [])),
      el("div", {}, ...section("Spectra", ...nodes(spectra)))), foot(data));
  clock?.watchers.push(() => { for (const one of charts) one.point(); });
  resize();
  clock?.set(clock.time);
  return { close: ready(host, dataset, resize, null, timing) };
}
