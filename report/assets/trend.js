// A parameter over the calibrations of a catalogue: one panel per gyro, start-ups as bands.

FIGURES.trend = (data, look, { name }) => {
  const { colour } = look;
  const { calibrations } = data;
  const trends = data.trends.filter((trend) => trend.name === name);
  const columns = look.width < 640 ? 1 : trends.length;
  const isAngle = trends[0].from !== undefined;
  const shownUnit = isAngle ? angleUnit(Math.max(...trends.flatMap(({ value, sigma }) => trendRange(value, sigma).map(Math.abs))))
    : { symbol: "10⁻⁶ rad/s", size: 1 };
  const unit = shownUnit.symbol;
  const layout = panels(look, {
    rows: trends.length / columns, columns, rowHeight: 190, duration: calibrations.length,
    titles: trends.map(({ gyro, from }) => `Gyro ${gyro}${isAngle ? `, from ${from}` : ""}`),
    units: trends.map(({ symbol }, i) => (i % columns === 0 ? `${symbol}, ${unit}` : "")),
  });
  const traces = trends.flatMap((trend, i) => {
    const { gyro } = trend;
    const value = scaled(trend.value, 1 / shownUnit.size);
    const sigma = scaled(trend.sigma, 1 / shownUnit.size);
    const axes = panel(i);
    Object.assign(layout[axes.xkey], { range: [0.5, calibrations.length + 0.5], dtick: Math.ceil(calibrations.length / 20), tick0: 1,
      title: layout[axes.xkey].title && axisTitle("calibration, as numbered above", 8), showgrid: false });
    Object.assign(layout[axes.ykey], { range: trendRange(value, sigma), zeroline: false });
    const bands = startUpBands(calibrations, axes, look.width / columns, colour);
    layout.shapes.push(...bands.map(({ shape }) => shape));
    layout.annotations.push(...bands.map(({ label }) => label));
    return KINDS.map((kind) => {
      const shown = value.map((v, k) => (kind.holds(calibrations[k]) ? v : null));
      return {
        x: calibrations.map((_, k) => k + 1), y: shown, mode: "markers", ...axesOf(axes), name: kind.name, legendgroup: kind.name,
        showlegend: i === 0 && shown.some((v) => v !== null),
        error_y: { array: sigma, color: faded(gyroColour(colour, gyro), 0.7), thickness: 1.4, width: 3 },
        marker: { symbol: kind.symbol, size: kind.size, color: gyroColour(colour, gyro), line: { width: 1.5, color: gyroColour(colour, gyro) } },
        text: calibrations.map((c, k) => `${c.epoch}<br>start-up ${c.start_up}, pass ${c.pass}` +
          `${c.passes > 1 ? ` and ${c.passes - 1} before` : ""}<br>1σ ${Number((sigma[k] ?? 0).toPrecision(2))} ${unit}`),
        hovertemplate: `%{y:.6~g} ${unit}<br>%{text}<extra>${kind.name}</extra>`,
      };
    });
  });
  return { traces, layout };
};

const KINDS = [
  { name: "one pass", symbol: "circle", size: 7, holds: ({ trustworthy, passes }) => trustworthy && passes === 1 },
  { name: "several passes", symbol: "diamond-open", size: 11, holds: ({ trustworthy, passes }) => trustworthy && passes > 1 },
  { name: "not to be used", symbol: "x-thin", size: 8, holds: ({ trustworthy }) => !trustworthy },
];

/** Every other start-up is shaded and labelled with as much of its name as there is room for. */
function startUpBands(calibrations, { xaxis, yaxis }, width, colour) {
  const letters = (from, to) => Math.floor((0.8 * width * (to - from)) / calibrations.length / 6.5);
  const bands = [];
  calibrations.forEach(({ start_up }, k) => {
    if (bands.at(-1)?.start_up === start_up) bands.at(-1).to = k + 1.5;
    else bands.push({ start_up, from: k + 0.5, to: k + 1.5 });
  });
  return bands.map(({ start_up, from, to }, i) => ({
    shape: { type: "rect", xref: xaxis, yref: `${yaxis} domain`, x0: from, x1: to, y0: 0, y1: 1, layer: "below", line: { width: 0 },
      fillcolor: i % 2 === 0 ? colour.shade : CLEAR },
    // On a ground of its own: a line of the grid would strike it out.
    label: { text: shortened(start_up, letters(from, to)), xref: xaxis, yref: `${yaxis} domain`, x: from, y: 1, xanchor: "left", yanchor: "top",
      showarrow: false, borderpad: 2, bgcolor: i % 2 === 0 ? colour.shade : colour.sheet, font: { size: 11, color: colour.muted } },
  }));
}

/** At most so many letters, the last of them … where some are missing. */
const shortened = (text, letters) => (text.length <= letters ? text : letters > 1 ? `${text.slice(0, letters - 1)}…` : "");

/** Range of values with room for the usual sigmas and for the names above; longer error bars are cut off. */
function trendRange(value, sigma) {
  const shown = value.filter((v) => v !== null);
  const sigmas = sigma.filter((s) => s !== null).sort((a, b) => a - b);
  const margin = Math.max(0.15 * (Math.max(...shown) - Math.min(...shown)), 2 * sigmas[Math.floor(sigmas.length / 2)]);
  return [Math.min(...shown) - margin, Math.max(...shown) + 2 * margin];
}
