// The page of a fit: measured and fitted curves, whose points can be read, and what is known of them.

const rowsOf = (title, headings, rows, kind = "many") => section(title, ...rows.length ? [table(headings, rows, kind)] : []);

async function build(host, data, dataset) {
  const facts = el("div", {}, el("p.legend", {}, "Click on a point of a chart."));
  const all = [], still = (diagram, height, pick) => {
    const chart = new StillChart({ ...diagram, height }, pick);
    all.push(chart);
    return chart;
  };
  const curves = data.curves.map(([values, residuals]) => {
    const choose = (index) => {
      for (const chart of all) { chart.chosen = pair.includes(chart) ? index : undefined; chart.point(); }
      const texts = pair.flatMap((chart) => chart.lines.map(({ name, y }) => [name || chart.name,
        (chart.log.includes("y") ? 10 ** y[index] : y[index]).toPrecision(5)]));
      const [{ x }] = pair[0].lines;
      facts.replaceChildren(table([], [["", pair[0].name],
        [pair[0].xLabel, (pair[0].log.includes("x") ? 10 ** x[index] : x[index]).toPrecision(5)], ...texts]));
      dataset.point = index;
    };
    const pair = [still(values, 260, choose), still(residuals, 110, choose)];
    [values, residuals].forEach(({ title, unit }, k) => { pair[k].name = unit ? `${title} [${unit}]` : title; });
    return pair;
  });
  const nodes = (some) => some.map((one) => one.node), grid = (some, height) => some.length
    ? [el("div.grid", {}, ...nodes(some.map((one) => still(one, height))))] : [];
  host.append(head(data),
    ...rowsOf("Parameters, in SI units", data.headings, data.parameters, "modes"),
    el("main", {}, el("div", {}, ...section("Data and model", ...nodes(curves.flat()))),
      el("div", {}, ...section("Point", facts), ...section("Fit", table([], data.facts)),
        ...rowsOf("Correlation", ["", ...data.names], data.correlation),
        ...rowsOf("Singular values", ["deviation, in parts of the ranges", "combination of parameters"], data.combinations))),
    ...section("Profile likelihood", ...grid(data.profiles, 190)),
    ...section("Posterior distribution", ...data.sampled.length ? [table([], data.sampled)] : [],
      ...grid(data.marginals, 150), ...grid(data.pairs, 230)),
    ...rowsOf("Starts", data.startHeadings, data.starts),
    ...rowsOf("Derivatives", ["data", "parameter", "derivative"], data.derivatives),
    ...cards("Study, in SI units", data.study), foot(data));
  const resize = () => { for (const chart of all) chart.resize(); };
  resize();
  return { close: ready(host, dataset, resize) };
}
