"use strict";
// One function per figure: from the data and from how it is to look to traces and layout for Plotly.
// `look`: {width, colour: colours by their names in the style sheet, detail: whether enlarged, print: whether for paper}.

const AXES = ["roll", "pitch", "heading"];
const DASHES = ["solid", "dash", "dot"];
const CLEAR = "rgba(0,0,0,0)";

function faded(hex, alpha) {
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  return `rgba(${r},${g},${b},${alpha})`;
}

const axisColours = (colour) => [colour.blue, colour.vermillion, colour.green];
const gyroColour = (colour, gyro) => [colour.blue, colour.vermillion, colour.green, colour.purple][(gyro - 1) % 4];

/** Plotly's names of the axes of panel `i`: xaxis and yaxis for traces, xkey and ykey for the layout. */
function panel(i) {
  const n = i === 0 ? "" : String(i + 1);
  return { xaxis: `x${n}`, yaxis: `y${n}`, xkey: `xaxis${n}`, ykey: `yaxis${n}` };
}

/**
 * A layout of `rows` × `columns` panels over the time of the pass. `titles[i]` stands above panel i, `units[i]` beside it;
 * panels are counted along rows. Time is labelled in the lowest row.
 */
function panels(look, { rows, columns, titles = [], units = [], rowHeight = 220, duration }) {
  const { colour } = look;
  const height = rows * rowHeight * (look.print ? 0.72 : 1) + 96;
  const gapX = columns > 1 ? 72 / look.width : 0;
  const gapY = 44 / height;
  const w = (1 - gapX * (columns - 1)) / columns;
  const h = (1 - gapY * (rows - 1)) / rows;
  const layout = baseLayout(look, height);
  for (let i = 0; i < rows * columns; ++i) {
    const row = Math.floor(i / columns);
    const column = i % columns;
    const { xaxis, yaxis, xkey, ykey } = panel(i);
    const left = column * (w + gapX);
    const bottom = (rows - 1 - row) * (h + gapY);
    const lowest = row === rows - 1;
    layout[xkey] = {
      ...axisStyle(colour), domain: [left, left + w], anchor: yaxis, matches: i === 0 ? undefined : "x", range: [0, duration],
      dtick: timeTick(duration, look.width / columns), tick0: 0, showticklabels: lowest, hoverformat: ".2f",
      title: lowest ? axisTitle("time, min", 8) : undefined,
    };
    layout[ykey] = {
      ...axisStyle(colour), domain: [bottom, bottom + h], anchor: xaxis, nticks: 7, zeroline: true,
      title: units[i] ? axisTitle(units[i], 6) : undefined,
    };
    if (titles[i]) {
      layout.annotations.push({
        text: titles[i], xref: "paper", yref: "paper", x: left, y: bottom + h, xanchor: "left", yanchor: "bottom", yshift: 3,
        showarrow: false, font: { size: 13, color: colour.ink },
      });
    }
  }
  return layout;
}

/** Distance of the ticks in minutes; for a long pass multiples of 90 min, the correction interval of the paper (one orbit). */
function timeTick(duration, width) {
  const most = Math.max(2, width / 70);
  return [1, 2, 5, 10, 15, 30, 90, 180, 360, 720, 1440].find((tick) => duration / tick <= most) ?? duration / most;
}

/** Makes room above the panels for a legend of several rows: on a narrow screen its entries stand in columns. */
function withRoomForLegend(layout, traces) {
  const entries = traces.filter(({ showlegend, name }) => showlegend && name).map(({ name }) => 7.2 * name.length + 48);
  const room = layout.width - layout.margin.l - layout.margin.r;
  const sum = entries.reduce((a, b) => a + b, 0);
  const columns = Math.max(1, Math.floor(room / Math.max(...entries, 1)));
  const more = sum <= room ? 0 : 30 * (Math.ceil(entries.length / columns) - 1);
  return { ...layout, height: layout.height + more, margin: { ...layout.margin, t: layout.margin.t + more } };
}

const axisTitle = (text, standoff) => ({ text, standoff, font: { size: 12.5 } });

function baseLayout({ width, colour, print }, height) {
  return {
    width, height, autosize: false,
    margin: { l: 74, r: print ? 14 : 40, t: 46, b: 50 },  // on a screen with room for the buttons at the right edge
    paper_bgcolor: CLEAR, plot_bgcolor: CLEAR,
    font: { family: colour.sans, size: 12.5, color: colour.muted },
    legend: { orientation: "h", x: 0, xanchor: "left", y: 1, yref: "container", yanchor: "top", font: { color: colour.ink } },
    hoverlabel: { bgcolor: colour.sheet, bordercolor: colour.line, font: { color: colour.ink } },
    hovermode: "closest",
    modebar: { bgcolor: CLEAR, color: colour.muted, activecolor: colour.link, orientation: "v" },
    dragmode: "zoom",
    annotations: [], shapes: [],
  };
}

function axisStyle(colour) {
  return {
    gridcolor: colour.grid, linecolor: colour.line, zerolinecolor: colour.line, tickcolor: colour.line, showline: true,
    ticks: "outside", ticklen: 4, automargin: false, exponentformat: "power", minexponent: 4, zeroline: false,
  };
}

/** The band centre ± half between gaps, as one closed outline per stretch. */
function band(t, centre, half, { name, colour, axes, group, showlegend = false }) {
  const x = [];
  const y = [];
  let begin = 0;
  const close = (end) => {
    for (let i = begin; i < end; ++i) { x.push(t[i]); y.push(centre[i] + half[i]); }
    for (let i = end - 1; i >= begin; --i) { x.push(t[i]); y.push(centre[i] - half[i]); }
    if (end > begin) { x.push(null); y.push(null); }
    begin = end + 1;
  };
  for (let i = 0; i < t.length; ++i) if (half[i] === null || centre[i] === null) close(i);
  close(t.length);
  return {
    x, y, fill: "toself", fillcolor: colour, line: { width: 0 }, mode: "lines", hoverinfo: "skip", name, legendgroup: group,
    showlegend, xaxis: axes.xaxis, yaxis: axes.yaxis,
  };
}

const line = (x, y, axes, more) => ({
  x, y, mode: "lines", xaxis: axes.xaxis, yaxis: axes.yaxis, showlegend: false, ...more, line: { width: 1.5, ...more.line },
});

const level = (value, axes, colour, dash = "dash", width = 1.2) => ({
  type: "line", xref: `${axes.xaxis} domain`, yref: axes.yaxis, x0: 0, x1: 1, y0: value, y1: value, layer: "above",
  line: { color: colour, width, dash },
});

const moment = (t, axes, colour) => ({
  type: "line", xref: axes.xaxis, yref: `${axes.yaxis} domain`, x0: t, x1: t, y0: 0, y1: 1, line: { color: colour, width: 1, dash: "dot" },
});

const scaled = (values, factor, offset = 0) => values.map((v) => (v === null ? null : (v - offset) * factor));

/** The unit in which angles up to `size` ″ are shown, and its size in ″: as records/text.hpp. */
function angleUnit(size) {
  if (size >= 6000) return { symbol: "°", size: 3600 };
  return size >= 100 ? { symbol: "′", size: 60 } : { symbol: "″", size: 1 };
}

const angleText = (size) => `${Number((size / angleUnit(size).size).toPrecision(3))}${angleUnit(size).symbol}`;

/** Greatest |value| of the rows from time `from` on. */
function greatest(t, values, from) {
  let result = 0;
  values.forEach((v, i) => { if (v !== null && t[i] >= from) result = Math.max(result, Math.abs(v)); });
  return result;
}

const FIGURES = {
  coefficient(data, look, { name }) {
    const { colour } = look;
    const states = Object.values(data.parameters).filter((p) => p.name === name);
    const columns = look.width < 640 ? 1 : states.length;
    const symbol = states[0].symbol;
    const unit = "10⁻⁶ rad/s";
    const layout = panels(look, {
      rows: states.length / columns, columns, rowHeight: 230, duration: data.duration_min,
      titles: states.map((p) => `Gyro ${p.gyro}`),
      units: states.map((_, i) => (i % columns === 0 ? `${symbol}${look.detail ? " − " + reference(states[0]) : ""}, ${unit}` : "")),
    });
    const traces = states.flatMap((p, i) => {
      const axes = panel(i);
      const c = gyroColour(colour, p.gyro);
      const zero = look.detail ? p.truth ?? p.final : 0;
      const value = scaled(p.y[0], 1, zero);
      const sigma = p.y[1];
      if (look.detail) {
        const late = lateFrom(p, data);
        const half = 1.15 * Math.max(greatest(p.t, value, late), 3 * p.final_sigma, ...at(p.t, scaled(sigma, 3), late));
        layout[axes.ykey].range = [-half, half];
      } else {
        layout[axes.ykey].range = valueRange(p, value, sigma);
      }
      if (p.truth !== undefined) layout.shapes.push(level(p.truth - zero, axes, colour.ink));
      const first = i === 0;
      return [
        band(p.t, value, scaled(sigma, 3), { name: "3σ", colour: faded(c, 0.2), axes, group: "3", showlegend: first }),
        band(p.t, value, sigma, { name: "1σ", colour: faded(c, 0.38), axes, group: "1", showlegend: first }),
        line(p.t, value, axes, { name: "estimate", legendgroup: "e", showlegend: first, line: { color: c },
          hovertemplate: `%{x:.1f} min: %{y:.6~g} ${unit}<extra>${symbol}, gyro ${p.gyro}</extra>` }),
      ];
    });
    if (states[0].truth !== undefined) traces.push(legendOnly("truth", { color: colour.ink, dash: "dash", width: 1.2 }));
    return { traces, layout };
  },

  alignment(data, look) {
    const { colour } = look;
    const gyros = [...new Set(Object.values(data.parameters).map((p) => p.gyro))];
    const columns = look.width < 640 ? 1 : gyros.length;
    const cells = columns > 1
      ? ["value", "detail"].flatMap((kind) => gyros.map((gyro) => ({ kind, gyro })))
      : gyros.flatMap((gyro) => ["value", "detail"].map((kind) => ({ kind, gyro })));
    const against = reference(Object.values(data.parameters)[0]);
    const alignments = Object.values(data.parameters).filter((p) => p.name.startsWith("align_"));
    const zeroOf = (p, kind) => (kind === "detail" ? p.truth ?? p.final : 0);
    const reachOf = (p) => {
      const late = lateFrom(p, data);
      return Math.max(greatest(p.t, scaled(p.y[0], 1, zeroOf(p, "detail")), late), 3 * p.final_sigma, ...at(p.t, p.y[1], late));
    };
    const unit = {
      value: angleUnit(Math.max(...alignments.map((p) => Math.max(...valueRange(p, p.y[0], p.y[1]).map(Math.abs))))),
      detail: angleUnit(Math.max(...alignments.map(reachOf))),
    };
    const layout = panels(look, {
      rows: cells.length / columns, columns, rowHeight: 240, duration: data.duration_min,
      titles: cells.map(({ kind, gyro }) => (kind === "value" ? `Gyro ${gyro}` : `Gyro ${gyro}, distance from ${against}`)),
      units: cells.map(({ kind }, i) => (i % columns > 0 ? "" : `${kind === "value" ? "Λ" : "distance"}, ${unit[kind].symbol}`)),
    });
    const traces = cells.flatMap(({ kind, gyro }, i) => {
      const axes = panel(i);
      const states = alignments.filter((p) => p.gyro === gyro);
      const factor = 1 / unit[kind].size;
      const drawn = states.flatMap((p, axis) => {
        const c = axisColours(colour)[axis];
        const value = scaled(p.y[0], factor, zeroOf(p, kind));
        if (kind === "value" && p.truth !== undefined) layout.shapes.push(level(p.truth * factor, axes, c, "dash", 1));
        return [
          band(p.t, value, scaled(p.y[1], factor), { colour: faded(c, 0.18), axes, group: p.name }),
          line(p.t, value, axes, { name: `${p.symbol} (${AXES[axis]})`, legendgroup: p.name, showlegend: i === 0,
            line: { color: c, dash: DASHES[axis], width: 1.8 },
            hovertemplate: `%{x:.1f} min: %{y:.5~g}${unit[kind].symbol}<extra>${p.symbol}, gyro ${gyro}</extra>` }),
        ];
      });
      if (kind === "detail") {
        const reach = 1.1 * factor * Math.max(...states.map(reachOf));
        layout[axes.ykey].range = [-reach, reach];
      } else {
        layout[axes.ykey].range = scaled(spread(states.map((p) => valueRange(p, p.y[0], p.y[1]))), factor);
      }
      return drawn;
    });
    if (against === "truth") traces.push(legendOnly("truth", { color: colour.ink, dash: "dash", width: 1 }));
    return { traces, layout };
  },

  navigation(data, look) {
    const { colour } = look;
    const corrections = data.corrections ?? [];
    const views = corrections.length > 1 ? ["", ", enlarged"] : [""];
    // Enlarged: the scale is that of the error after the calibrated parameters have been taken over, from the second correction on.
    const beginOf = (view) => (view ? corrections[1] + 0.1 : 0);
    const unit = Object.fromEntries(views.map((view) =>
      [view, angleUnit(Math.max(...data.navigation.map(({ t, y }) => greatest(t, y[0], beginOf(view)))))]));
    const columns = look.width < 640 ? 1 : views.length;
    const cells = columns > 1
      ? AXES.flatMap((_, axis) => views.map((view) => ({ axis, view })))
      : views.flatMap((view) => AXES.map((_, axis) => ({ axis, view })));
    const layout = panels(look, {
      rows: cells.length / columns, columns, rowHeight: 150, duration: data.duration_min,
      titles: cells.map(({ axis, view }) => AXES[axis][0].toUpperCase() + AXES[axis].slice(1) + view),
      units: cells.map(({ view }) => `error, ${unit[view].symbol}`),
    });
    const traces = cells.map(({ axis, view }, i) => {
      const { t, y } = data.navigation[axis];
      const shown = scaled(y[0], 1 / unit[view].size);
      if (view) {
        const half = 1.15 * greatest(t, shown, beginOf(view)) || 1;
        layout[panel(i).ykey].range = [-half, half];
      }
      return line(t, shown, panel(i), { name: AXES[axis], line: { color: axisColours(colour)[axis], width: 1.3 },
        hovertemplate: `%{x:.1f} min: %{y:.3~g}${unit[view].symbol}<extra>${AXES[axis]}</extra>` });
    });
    if (corrections.length <= 60) {
      cells.forEach((_, i) => corrections.forEach((t) => layout.shapes.push(moment(t, panel(i), colour.muted))));
      traces.push(legendOnly("astro-correction", { color: colour.muted, dash: "dot", width: 1 }));
    }
    return { traces, layout };
  },

  attitude(data, look) {
    const { colour } = look;
    const late = 0.2 * data.duration_min;
    const reachOf = ({ t, y }) => Math.max(greatest(t, y[0], late), y[1] ? 3 * greatest(t, y[1], late) : 0);
    const unit = angleUnit(Math.max(...data.attitude.map(reachOf)));
    const layout = panels(look, {
      rows: 3, columns: 1, rowHeight: 150, duration: data.duration_min,
      titles: AXES.map((name) => name[0].toUpperCase() + name.slice(1)), units: AXES.map(() => `error, ${unit.symbol}`),
    });
    const traces = data.attitude.flatMap((errors, i) => {
      const axes = panel(i);
      const c = axisColours(colour)[i];
      const { t } = errors;
      const y = errors.y.map((values) => scaled(values, 1 / unit.size));
      const bound = y[1] ? scaled(y[1], 3) : [];
      const half = (1.15 * reachOf(errors)) / unit.size;
      layout[axes.ykey].range = [-half, half];
      const error = line(t, y[0], axes, { name: AXES[i], line: { color: c, width: 1 },
        hovertemplate: `%{x:.1f} min: %{y:.3~g}${unit.symbol}<extra>${AXES[i]}</extra>` });
      if (!y[1]) return [error];
      const edge = { color: colour.ink, width: 1.2, dash: "dash" };
      return [
        error,
        line(t, bound, axes, { hoverinfo: "skip", name: "± 3σ", showlegend: i === 0, line: edge }),
        line(t, scaled(bound, -1), axes, { hoverinfo: "skip", line: edge }),
      ];
    });
    return { traces, layout };
  },

  open_loops(data, look) {
    const { colour } = look;
    const { loops, limit } = data.open_loops;
    const layout = baseLayout(look, look.print ? 300 : 420);
    const longest = Math.max(...loops.map(({ calibrated }) => calibrated.t.at(-1)));
    layout.xaxis = { ...axisStyle(colour), title: axisTitle("time since the correction, min", 8), range: [0, longest],
      dtick: timeTick(longest, look.width), tick0: 0, hoverformat: ".1f" };
    layout.yaxis = { ...axisStyle(colour), type: "log", title: axisTitle("total error, ″", 6), dtick: 1 };
    layout.shapes.push(level(limit, panel(0), colour.ink, "dot", 1.4));
    layout.annotations.push({ text: angleText(limit), xref: "paper", yref: "y", x: 1, y: Math.log10(limit),
      xanchor: "right", yanchor: "bottom", showarrow: false, font: { color: colour.ink } });
    const drawn = ({ t, y }, corrected, kind, style) => line(t, y[0], panel(0), { line: style,
      hovertemplate: `%{x:.1f} min after: %{y:.3~g}″<extra>corrected at ${Math.round(corrected)} min, ${kind}</extra>` });
    const traces = loops.flatMap(({ corrected, known_before, calibrated }, i) => [
      drawn(known_before, corrected, "known before", { color: faded(colour.vermillion, 0.8), dash: "dash", width: 1 }),
      // At the first correction nothing is calibrated yet. Later corrections have a stronger colour.
      ...(i === 0 ? [] : [drawn(calibrated, corrected, "calibrated",
        { color: faded(colour.blue, 0.35 + (0.65 * i) / (loops.length - 1)), width: 1.6 })]),
    ]);
    traces.push(legendOnly("known before", { color: colour.vermillion, dash: "dash", width: 1.2 }),
      legendOnly("calibrated", { color: colour.blue, width: 1.6 }), legendOnly("limit", { color: colour.ink, dash: "dot", width: 1.4 }));
    return { traces, layout };
  },

  forecast(data, look) {
    const { colour } = look;
    const { predicted, limit, loops, need } = data.forecast;
    const layout = baseLayout(look, look.print ? 300 : 420);
    const longest = predicted.t.at(-1);
    layout.xaxis = { ...axisStyle(colour), title: axisTitle("time since the correction, min", 8), range: [0, longest],
      dtick: timeTick(longest, look.width), tick0: 0, hoverformat: ".0f" };
    layout.yaxis = { ...axisStyle(colour), type: "log", title: axisTitle("total error, ″", 6), dtick: 1 };
    layout.shapes.push(level(limit, panel(0), colour.ink, "dot", 1.4));
    if (need) {
      layout.shapes.push({ type: "line", xref: "x", yref: "y", x0: 0, x1: need.interval, y0: need.limit, y1: need.limit,
        line: { color: colour.vermillion, width: 3 } });
    }
    const shares = ["68 %", "95 %", "99.7 %"];
    const traces = shares.map((share, i) => line(predicted.t, predicted.y[i], panel(0), { name: `predicted, ${share}`,
      showlegend: true, line: { color: colour.blue, width: 1.2 + 0.5 * i, dash: ["dot", "dash", "solid"][i] },
      hovertemplate: `%{x:.0f} min after: %{y:.3~g}″<extra>${share} of the errors are below</extra>` }));
    for (const { corrected, flown, predicted: bound } of loops) {
      const of = `corrected at ${Math.round(corrected)} min`;
      traces.push(line(flown.t, flown.y[0], panel(0), { line: { color: faded(colour.vermillion, 0.7), width: 1 },
        hovertemplate: `%{x:.0f} min after: %{y:.3~g}″<extra>${of}, flown</extra>` }));
      traces.push(line(bound.t, bound.y[0], panel(0), { line: { color: faded(colour.vermillion, 0.5), width: 1, dash: "dash" },
        hovertemplate: `%{x:.0f} min after: %{y:.3~g}″<extra>${of}, 99.7 % as predicted then</extra>` }));
    }
    if (loops.length > 0) {
      traces.push(legendOnly("flown in the pass", { color: colour.vermillion, width: 1 }),
        legendOnly("99.7 %, as predicted at each correction", { color: colour.vermillion, width: 1, dash: "dash" }));
    }
    traces.push(legendOnly("limit", { color: colour.ink, dash: "dot", width: 1.4 }));
    if (need) {
      traces.push(legendOnly("needed", { color: colour.vermillion, width: 3 }));
    }
    return { traces, layout };
  },

  innovations(data, look) {
    const { colour } = look;
    const columns = look.width < 640 ? 1 : 2;
    const names = ["Gyro 1, first across", "Gyro 1, second across", "Gyro 2, first across", "Gyro 2, second across"];
    const late = Math.min(10, 0.05 * data.duration_min);
    const reachOf = ({ used }) => Math.max(greatest(used.t, used.y[0], late), 3 * greatest(used.t, used.y[1], late), 1e-3);
    const unit = angleUnit(Math.max(...data.innovations.map(reachOf)));
    const inUnit = ({ t, y }) => ({ t, y: y.map((values) => scaled(values, 1 / unit.size)) });
    const layout = panels(look, {
      rows: 4 / columns, columns, rowHeight: columns > 1 ? 210 : 170, duration: data.duration_min, titles: names,
      units: names.map((_, i) => (i % columns === 0 ? `innovation, ${unit.symbol}` : "")),
    });
    const traces = data.innovations.flatMap((innovation, i) => {
      const used = inUnit(innovation.used);
      const rejected = inUnit(innovation.rejected);
      const axes = panel(i);
      const c = gyroColour(colour, i < 2 ? 1 : 2);
      const bound = scaled(used.y[1], 3);
      const half = (1.25 * reachOf(innovation)) / unit.size;
      layout[axes.ykey].range = [-half, half];
      const edge = { color: colour.ink, width: 1.2, dash: "dash" };
      return [
        // Drawn as a line: decimation keeps only the least and greatest values, which as points would look like two clouds.
        line(used.t, used.y[0], axes, { name: "used", legendgroup: "u", showlegend: i === 0, line: { color: c, width: 0.8 },
          hovertemplate: `%{x:.2f} min: %{y:.3~g}${unit.symbol}<extra></extra>` }),
        line(used.t, bound, axes, { hoverinfo: "skip", name: "± 3σ", legendgroup: "s", showlegend: i === 0, line: edge }),
        line(used.t, scaled(bound, -1), axes, { hoverinfo: "skip", legendgroup: "s", line: edge }),
        rejectedMarks(rejected.t, rejected.y[0], axes, colour, -0.96 * half, 0.96 * half, unit.symbol, i === 0),
      ];
    });
    return { traces, layout };
  },

  histogram(data, look) {
    const { colour } = look;
    const h = data.histogram;
    const layout = baseLayout(look, look.print ? 250 : 320);
    layout.xaxis = { ...axisStyle(colour), title: axisTitle("innovation / σ", 8), range: [-5, 5], dtick: 1, zeroline: true };
    layout.yaxis = { ...axisStyle(colour), title: axisTitle("density", 6), rangemode: "tozero" };
    layout.bargap = 0.06;
    const traces = [
      { type: "bar", x: h.x, y: h.density, width: h.x.map(() => 0.94 * h.width), name: "innovations", showlegend: true,
        marker: { color: faded(colour.blue, 0.55), line: { color: colour.blue, width: 1 } },
        hovertemplate: "%{x:.3f}: %{y:.3f}<extra></extra>" },
      line(h.x, h.normal, panel(0), { name: "normal density", showlegend: true, hoverinfo: "skip",
        line: { color: colour.ink, width: 2, dash: "dash", shape: "spline" } }),
    ];
    if (h.outside > 0) {
      layout.annotations.push({ text: `${h.outside} beyond ± 5`, xref: "paper", yref: "paper", x: 1, y: 1, xanchor: "right",
        yanchor: "top", showarrow: false, font: { color: colour.muted } });
    }
    return { traces, layout };
  },

  nis(data, look) {
    const { colour } = look;
    const n = data.nis;
    const layout = panels(look, {
      rows: 2, columns: 1, rowHeight: 210, duration: data.duration_min,
      titles: ["Each fix", `Mean over ${n.window} fixes`], units: ["NIS", "mean NIS"],
    });
    const [one, mean] = [panel(0), panel(1)];
    const top = 10 * Math.max(n.gate, n.high);
    layout.yaxis = { ...layout.yaxis, type: "log", range: [-2, Math.log10(top)], nticks: undefined,
      tickvals: [0.01, 0.1, 1, 10, 100, 1000], ticktext: ["0.01", "0.1", "1", "10", "100", "1000"] };
    const reach = 1.2 * Math.max(greatest(n.mean.t, n.mean.y[0].map((v) => v === null ? null : v - n.expected), 0), n.mean_high - n.expected);
    layout.yaxis2.range = [Math.max(0, n.expected - reach), n.expected + reach];
    layout.shapes.push(
      level(n.low, one, colour.ink), level(n.high, one, colour.ink), level(n.gate, one, colour.purple, "dot", 1.6),
      level(n.expected, mean, colour.ink, "dash"),
      { type: "rect", xref: "x2 domain", yref: "y2", x0: 0, x1: 1, y0: n.mean_low, y1: n.mean_high, layer: "below",
        line: { width: 0 }, fillcolor: faded(colour.muted, 0.22) },
    );
    const traces = [
      line(n.used.t, n.used.y[0], one, { name: "used", showlegend: true, line: { color: colour.blue, width: 0.8 },
        hovertemplate: "%{x:.2f} min: %{y:.3~g}<extra></extra>" }),
      rejectedMarks(n.rejected.t, n.rejected.y[0], one, colour, 0, 0.8 * top, "", true),
      line(n.mean.t, n.mean.y[0], mean, { name: "moving mean", showlegend: true, line: { color: colour.vermillion },
        hovertemplate: "%{x:.1f} min: %{y:.3f}<extra></extra>" }),
      legendOnly("95 % bounds", { color: colour.ink, dash: "dash", width: 1.2 }),
      legendOnly("gate", { color: colour.purple, dash: "dot", width: 1.6 }),
    ];
    if (n.reopened.length > 0) {
      for (const t of n.reopened) layout.shapes.push(moment(t, one, colour.green), moment(t, mean, colour.green));
      traces.push(legendOnly("directions reopened", { color: colour.green, dash: "dot", width: 1 }));
    }
    return { traces, layout };
  },

  drift_models(data, look) {
    const { colour } = look;
    const models = data.drift_models;
    const layout = baseLayout(look, 300);
    const x = models.map((m) => m.coefficients);
    const unit = angleUnit(Math.max(...models.map((m) => m.error)));
    const errorOf = (m) => m.error / unit.size;
    layout.xaxis = { ...axisStyle(colour), title: axisTitle("coefficients of each gyro", 8), tickvals: x, ticktext: models.map((m) => `${m.coefficients}<br>${m.name}`) };
    layout.yaxis = { ...axisStyle(colour), title: axisTitle(`forecast error, ${unit.symbol}`, 6), rangemode: "tozero" };
    layout.margin = { ...layout.margin, b: 66 };
    const hovertemplate = `%{customdata[0]}: %{y:.3~g}${unit.symbol}, ln likelihood %{customdata[1]:+.1f}<extra></extra>`;
    const marker = (used) => ({ size: used ? 13 : 8, color: used ? colour.vermillion : colour.blue });
    const traces = [
      { ...line(x, models.map(errorOf), panel(0), { line: { color: colour.blue } }), hoverinfo: "skip" },
      ...[false, true].map((used) => {
        const own = models.filter((m) => m.used === used);
        return { x: own.map((m) => m.coefficients), y: own.map(errorOf), mode: "markers", marker: marker(used), name: used ? "used" : "compared",
          showlegend: own.length > 0, customdata: own.map((m) => [m.name, m.gain]), hovertemplate };
      }),
    ];
    return { traces, layout };
  },

  correlation(data, look) {
    const { colour } = look;
    const { names, values } = data.correlation;
    const width = Math.min(look.width, look.print ? 560 : 800);
    const upright = (width - 132) / names.length < 24;
    const margin = { l: 62, r: 70, t: 14, b: upright ? 64 : 50 };
    const layout = { ...baseLayout({ ...look, width }, width - margin.l - margin.r + margin.t + margin.b), margin };
    const place = names.map((_, i) => i);
    const font = { size: Math.max(8, Math.min(13, (width - 130) / names.length / 1.7)) };
    const labels = names.map(({ symbol }) => symbol);
    const axis = { ...axisStyle(colour), tickvals: place, ticktext: labels, tickfont: font, showgrid: false, ticks: "", showline: false };
    layout.xaxis = { ...axis, tickangle: upright ? -90 : 0 };
    layout.yaxis = { ...axis, autorange: "reversed" };
    const full = names.map(({ gyro, symbol }) => `${symbol} of gyro ${gyro}`);
    names.forEach(({ gyro }, i) => {
      if (i > 0 && gyro !== names[i - 1].gyro) {
        const edge = { type: "line", line: { color: colour.ink, width: 1 } };
        layout.shapes.push(
          { ...edge, xref: "x", yref: "y", x0: i - 0.5, x1: i - 0.5, y0: -0.5, y1: names.length - 0.5 },
          { ...edge, xref: "x", yref: "y", y0: i - 0.5, y1: i - 0.5, x0: -0.5, x1: names.length - 0.5 });
      }
    });
    for (const gyro of new Set(names.map((n) => n.gyro))) {
      const own = place.filter((i) => names[i].gyro === gyro);
      const middle = (own[0] + own[own.length - 1]) / 2;
      const label = { text: `Gyro ${gyro}`, showarrow: false, font: { color: colour.ink, size: 12.5 } };
      layout.annotations.push(
        { ...label, xref: "x", x: middle, yref: "paper", y: 0, yanchor: "top", yshift: upright ? -38 : -24 },
        { ...label, yref: "y", y: middle, xref: "paper", x: 0, xanchor: "right", xshift: -38, textangle: -90 });
    }
    const traces = [{
      type: "heatmap", z: values, x: place, y: place, zmin: -1, zmax: 1, xgap: 1, ygap: 1,
      colorscale: [[0, colour["correlation-minus"]], [0.5, colour["correlation-zero"]], [1, colour["correlation-plus"]]],
      customdata: full.map((row) => full.map((column) => `${row}, ${column}`)),
      hovertemplate: "%{customdata}: %{z:+.3f}<extra></extra>",
      colorbar: { thickness: 12, outlinewidth: 0, tickvals: [-1, -0.5, 0, 0.5, 1], ticktext: ["−1", "−0.5", "0", "+0.5", "+1"], len: 0.6 },
    }];
    return { traces, layout };
  },

  angle(data, look) {
    const { colour } = look;
    const { t, y } = data.angle;
    const layout = panels(look, { rows: 1, columns: 1, rowHeight: 240, duration: data.duration_min, units: ["z₁, 10⁻⁶"] });
    const middle = t.map((_, i) => (y[0][i] === null ? null : (y[0][i] + y[1][i]) / 2));
    const half = t.map((_, i) => (y[0][i] === null ? null : (y[1][i] - y[0][i]) / 2));
    const late = Math.min(10, 0.05 * data.duration_min);
    const reach = 1.2 * Math.max(greatest(t, y[0], late), greatest(t, y[1], late));
    layout.yaxis.range = [-reach, reach];
    const axes = panel(0);
    return {
      traces: [
        band(t, middle, half, { name: "least to greatest", colour: faded(colour.blue, 0.45), axes, showlegend: true }),
        line(t, middle, axes, { name: "middle", showlegend: true, line: { color: colour.blue, width: 1 },
          hovertemplate: "%{x:.1f} min: %{y:.3~g} · 10⁻⁶<extra></extra>" }),
      ],
      layout,
    };
  },

  telemetry(data, look) {
    const { colour } = look;
    const { width, bins, gyro, fixes } = data.telemetry;
    const layout = panels(look, {
      rows: 2, columns: 1, rowHeight: 120, duration: data.duration_min, titles: ["Gyro samples", "Star-tracker fixes"], units: ["%", "%"],
    });
    layout.barmode = "stack";
    layout.bargap = 0;
    const x = Array.from({ length: bins }, (_, i) => (i + 0.5) * width);
    const bars = (y, i, name, fill, shape, showlegend) => ({
      type: "bar", x, y, width, name, legendgroup: name, showlegend, ...axesOf(panel(i)),
      marker: { color: fill, line: { width: 0 }, pattern: { shape, fillmode: "overlay", fgcolor: colour.sheet, size: 5, solidity: 0.3 } },
      hovertemplate: `%{x:.0f} min: %{y:.3~g} %<extra>${name}</extra>`,
    });
    for (const key of ["yaxis", "yaxis2"]) Object.assign(layout[key], { range: [0, 105], tickvals: [0, 50, 100] });
    return {
      traces: [
        bars(gyro[0], 0, "used", faded(colour.blue, 0.75), "", true),
        bars(gyro[1], 0, "rejected for another reason", colour.purple, "x", fixes[2].every((v) => v === 0)),
        bars(fixes[0], 1, "used", faded(colour.blue, 0.75), "", false),
        bars(fixes[1], 1, "rejected by the gate", colour.vermillion, "/", true),
        bars(fixes[2], 1, "rejected for another reason", colour.purple, "x", !fixes[2].every((v) => v === 0)),
      ],
      layout,
    };
  },
};

const axesOf = ({ xaxis, yaxis }) => ({ xaxis, yaxis });
const reference = (parameter) => (parameter.truth === undefined ? "final value" : "truth");

/** Time from which on an enlarged figure is scaled to the data: the parameter has converged and its sigma is nearly the final one. */
function lateFrom(p, data) {
  const known = p.y[1].findIndex((sigma) => sigma !== null && sigma <= 2.5 * p.final_sigma);
  return Math.min(Math.max(p.converged ?? 0, p.t[Math.max(known, 0)]), 0.8 * data.duration_min);
}

/** The first value from time `from` on, as a list of none or one. */
function at(t, values, from) {
  const i = t.findIndex((time, k) => time >= from && values[k] !== null);
  return i < 0 ? [] : [values[i]];
}

/** Range of values to show: the course of the estimate, its final band and the truth; the prior's band is often too wide. */
function valueRange(p, value, sigma) {
  const shown = value.filter((v) => v !== null);
  const low = Math.min(...shown, p.final - 3 * p.final_sigma, p.truth ?? p.final);
  const high = Math.max(...shown, p.final + 3 * p.final_sigma, p.truth ?? p.final);
  const start = sigma.find((v) => v !== null) ?? 0;
  const margin = Math.max(0.15 * (high - low), Math.min(start, 0.5 * (high - low)));
  return [low - margin, high + margin];
}

const spread = (ranges) => [Math.min(...ranges.map((r) => r[0])), Math.max(...ranges.map((r) => r[1]))];

const legendOnly = (name, style) => ({ x: [null], y: [null], mode: "lines", name, showlegend: true, hoverinfo: "skip", line: style });

/** Crosses; values outside the panel are drawn at its edge as triangles, which show the value on hovering. */
function rejectedMarks(t, values, axes, colour, low, high, unit, showlegend) {
  const shown = values.map((v) => Math.min(high, Math.max(low, v)));
  return {
    x: t, y: shown, customdata: values, mode: "markers", name: "rejected", legendgroup: "r", showlegend: showlegend && t.length > 0,
    marker: { color: colour.purple, size: 6, line: { width: 1.5, color: colour.purple },
      symbol: values.map((v) => (v > high ? "triangle-up" : v < low ? "triangle-down" : "x-thin")) },
    hovertemplate: `%{x:.2f} min: %{customdata:.4~g}${unit}, rejected<extra></extra>`, ...axesOf(axes),
  };
}
