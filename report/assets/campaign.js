// Figures of a campaign: distributions over the runs, and what they depend on.

/** Unit and size of what is drawn: angles come in ″. */
function shownUnit(unit, values) {
  if (unit !== "angle") return { symbol: unit === "" ? "" : ` ${unit}`, size: 1 };
  return angleUnit(Math.max(...values.map(Math.abs)));
}

const isWide = (values) => Math.min(...values) > 0 && Math.max(...values) > 30 * Math.min(...values);

/** Of a logarithmic axis: 1, 2 and 5 of each power of ten near the values, powers alone where there are many. */
function logarithmicTicks(values) {
  const first = Math.floor(Math.log10(Math.min(...values)));
  const last = Math.ceil(Math.log10(Math.max(...values)));
  const steps = last - first > 3 ? [1] : [1, 2, 5];
  const tickvals = Array.from({ length: last - first + 1 }, (_, i) => steps.map((step) => Number(`${step}e${first + i}`))).flat();
  return { type: "log", tickvals, ticktext: tickvals.map(String) };
}

FIGURES.ecdf = (data, look, { name }) => {
  const { colour } = look;
  const { label, unit, x, y, bounds, expected } = data.ecdf[name];
  const { symbol, size } = shownUnit(unit, x);
  const shown = scaled(x, 1 / size);
  const layout = baseLayout(look, look.print ? 260 : 320);
  layout.xaxis = { ...axisStyle(colour), ...(isWide(shown) ? logarithmicTicks(shown) : {}), title: axisTitle(`${label}${symbol === "" ? "" : `, ${symbol.trim()}`}`, 8) };
  layout.yaxis = { ...axisStyle(colour), range: [-0.02, 1.04], title: axisTitle("share of the runs", 6), tickformat: ".0%" };
  const traces = [{
    ...line(shown, y, panel(0), { name: "runs", line: { color: colour.blue, shape: "hv", width: 2 } }), showlegend: expected !== undefined,
    hovertemplate: `%{y:.1%} up to %{x:.4~g}${symbol}<extra></extra>`,
  }];
  if (expected) {
    traces.push({ ...line(expected.x, expected.y, panel(0), { name: "χ² of a consistent estimator", line: { color: colour.ink, dash: "dash" } }), showlegend: true,
      hoverinfo: "skip" });
  }
  const known = bounds.filter(({ lower, upper }) => lower !== null || upper !== null);
  const [left, right] = [Math.min(...shown), Math.max(...shown)];
  const bound = (value) => (value === null ? "no bound" : `${Number((value / size).toPrecision(4))}${symbol}`);
  known.forEach(({ share, lower, upper }) => {
    const from = lower === null ? left : lower / size;
    const to = upper === null ? right : upper / size;
    traces.push({
      x: [from, to], y: [share, share], mode: "lines+markers", showlegend: false, line: { color: colour.vermillion, width: 2 },
      marker: { symbol: "line-ns-open", size: 10, color: colour.vermillion, opacity: [lower === null ? 0 : 1, upper === null ? 0 : 1] },
      hovertemplate: `${+(100 * share).toPrecision(3)} %: ${bound(lower)} … ${bound(upper)}<extra></extra>`,
    });
  });
  return { traces, layout };
};

FIGURES.influences = (data, look) => {
  const { colour } = look;
  const { keys, measures, rho, marks } = data.influences;
  const longest = Math.max(...keys.map((key) => key.length));
  const left = Math.min(7 * longest + 20, 0.42 * look.width);
  const letters = Math.floor((left - 20) / 7);
  const right = look.print ? 70 : 110;
  // Narrower, names of measures would stand over each other; what is wider than the screen scrolls.
  const width = look.print ? look.width : Math.max(look.width, left + 22 * measures.length + right);
  const layout = { ...baseLayout({ ...look, width }, 34 * keys.length + 270), margin: { l: left, r: right, t: 14, b: 240 } };
  const short = (key) => (key.length <= letters ? key : `…${key.slice(1 - letters)}`);
  layout.xaxis = { ...axisStyle(colour), tickvals: measures.map((_, i) => i), ticktext: measures, tickangle: -45, showgrid: false, ticks: "", showline: false };
  layout.yaxis = { ...axisStyle(colour), tickvals: keys.map((_, i) => i), ticktext: keys.map(short), autorange: "reversed", showgrid: false, ticks: "", showline: false };
  const traces = [{
    type: "heatmap", z: rho, x: measures.map((_, i) => i), y: keys.map((_, i) => i), zmin: -1, zmax: 1, xgap: 1, ygap: 1,
    colorscale: [[0, colour["correlation-minus"]], [0.5, colour["correlation-zero"]], [1, colour["correlation-plus"]]],
    text: marks, texttemplate: "%{text}", textfont: { size: Math.min(11, (width - left - right) / measures.length / 3.2) },
    customdata: keys.map((key) => measures.map((measure) => `${key}, ${measure}`)),
    hovertemplate: "%{customdata}: %{z:+.2f}<extra></extra>",
    colorbar: { thickness: 12, outlinewidth: 0, tickvals: [-1, -0.5, 0, 0.5, 1], ticktext: ["−1", "−0.5", "0", "+0.5", "+1"] },
  }];
  return { traces, layout };
};

FIGURES.scatter = (data, look, { name }) => {
  const { colour } = look;
  const { key, key_unit, words, log, label, unit, rho, x, y, run } = data.scatters[Number(name)];
  const { symbol, size } = shownUnit(unit, y);
  const shown = scaled(y, 1 / size);
  const layout = baseLayout(look, look.print ? 260 : 320);
  layout.xaxis = { ...axisStyle(colour), ...(log ? logarithmicTicks(x) : {}), title: axisTitle(`${key}${key_unit ? `, ${key_unit}` : ""}`, 8) };
  if (words) Object.assign(layout.xaxis, { tickvals: words.map((_, i) => i), ticktext: words });
  // The caption has the name of the measure, which may be longer than the axis.
  const title = { angle: `error, ${symbol}`, min: "time, min" }[unit] ?? label;
  layout.yaxis = { ...axisStyle(colour), ...(isWide(shown) ? logarithmicTicks(shown) : {}), title: axisTitle(title, 6) };
  layout.annotations.push({ text: `ρ = ${rho.toFixed(2).replace("-", "−")}`, xref: "paper", yref: "paper", x: 0, y: 1, xanchor: "left", yanchor: "bottom",
    showarrow: false, font: { size: 13, color: colour.ink } });
  return {
    traces: [{ x, y: shown, customdata: run, mode: "markers", showlegend: false, marker: { color: faded(colour.blue, 0.55), size: 5 },
      hovertemplate: `run %{customdata}: %{y:.4~g}${symbol} at %{x:.4~g}${key_unit}<extra></extra>` }],
    layout,
  };
};
