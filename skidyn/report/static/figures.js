// SPDX-License-Identifier: BSD-3-Clause
// Still pictures: curves with bands, errors that fall, residuals over two variables.
"use strict";
(() => {
  const { numbers, colour, faint, digits, xAxis, yAxis, legend, plot, later } = common;
  const HEIGHT = 240, PADDING = [12, 14, 0, 0];
  const still = { x: false, y: false, setScale: false };

  function padded(u, low, high) {
    const room = 0.06 * ((high - low) || Math.abs(high) || 1);
    return [low - room, high + room];
  }

  // Series with an optional band between `low` and `high`; the band has no line in the legend.
  function lines(place, figure) {
    const data = [figure.x], series = [{ label: figure.x_label.split(" in ")[0], value: (u, v) => digits(v) }];
    const bands = [], colours = [], dashes = [];
    for (const s of figure.series) {
      const points = s.style === "points", stroke = () => colour(s.colour);
      let told = (u, v) => digits(v);
      if (s.low) {
        for (const edge of [s.high, s.low]) {
          data.push(edge); colours.push(s.colour); dashes.push("");
          series.push({ label: "", class: "quiet", stroke: "transparent", points: { show: false } });
        }
        bands.push({ series: [data.length - 2, data.length - 1], fill: () => faint(s.band || s.colour, 0.16) });
        told = (u, v, _, i) => (v == null ? "–" : `${digits(v)} (${digits(s.low[i])} to ${digits(s.high[i])})`);
      }
      data.push(s.values); colours.push(s.colour); dashes.push(points ? "dotted" : s.dash ? "dashed" : "solid");
      series.push({
        label: s.label, class: s.low ? "banded" : null, stroke, width: points ? 0 : 2.2, dash: s.dash ? [6, 4] : undefined, value: told,
        paths: points ? () => null : undefined, points: { show: points, size: 5, fill: stroke, stroke, width: 0 },
      });
    }
    plot(place, {
      height: HEIGHT, padding: PADDING, series, bands, legend: legend(colours, dashes),
      scales: { x: { time: false }, y: { range: padded } },
      axes: [xAxis(figure.x_label), yAxis(figure.y_label)], cursor: { drag: still },
    }, data);
  }

  function bars(place, figure) {
    const n = figure.values.length, steps = figure.values.map((_, k) => k);
    const top = 1.16 * Math.max(...figure.values.map((v) => v || 0), figure.floor || 0, 1e-12);
    const only = (wanted) => figure.values.map((v, k) => (wanted === (k === 0) ? v : null));
    const shape = uPlot.paths.bars({ size: [0.66, 60] });
    const series = (label, name) => ({
      label, stroke: () => colour(name), fill: () => colour(name), width: 0, paths: shape, points: { show: false },
      value: (u, v) => digits(v),
    });
    const above = (u) => {
      const { ctx } = u, ratio = u.ctx.canvas.width / u.width;
      ctx.save();
      ctx.font = `${12 * ratio}px system-ui, sans-serif`; ctx.textAlign = "center";
      figure.values.forEach((v, k) => {
        if (v == null || u.bbox.width / n < 34 * ratio) return;
        // above the bar, and above the line of the noise where that lies just over it
        const top = u.valToPos(v, "y", true), line = figure.floor == null ? top : u.valToPos(figure.floor, "y", true);
        const y = line < top && top - line < 18 * ratio ? line : top;
        ctx.fillStyle = colour("ink");
        ctx.fillText(Number(v.toPrecision(2)), u.valToPos(k, "x", true), y - 5 * ratio);
      });
      if (figure.floor != null) {
        const y = u.valToPos(figure.floor, "y", true);
        ctx.strokeStyle = colour("ink"); ctx.setLineDash([5 * ratio, 4 * ratio]); ctx.lineWidth = 1.6 * ratio;
        ctx.beginPath(); ctx.moveTo(u.bbox.left, y); ctx.lineTo(u.bbox.left + u.bbox.width, y); ctx.stroke();
      }
      ctx.restore();
    };
    const names = (u, splits) => splits.map((v) => (Number.isInteger(v) && v >= 0 && v < n ? v : ""));
    plot(place, {
      height: 190, padding: PADDING, legend: { show: false }, cursor: { show: false },
      series: [{}, series("as given", "noise"), series("step", "c0")],
      scales: { x: { time: false, range: [-0.6, n - 0.4] }, y: { range: [0, top] } },
      axes: [xAxis("step", { values: names, incrs: [1, 2, 5, 10, 20], space: 20, grid: { show: false } }), yAxis(figure.y_label)],
      hooks: { draw: [above] },
    }, [steps, only(true), only(false)]);
  }

  // Tiles from blue through the neutral colour of the theme to orange: safe for the colour-blind.
  function map(place, figure) {
    const { x, y, table, largest } = figure, channels = (name) => colour(name).match(/[0-9a-f]{2}/gi).map((part) => parseInt(part, 16));
    const paint = (u) => {
      const ends = [channels("low"), channels("neutral"), channels("high")];
      u.ctx.save();
      table.forEach((row, i) => row.forEach((value, k) => {
        if (value == null) return;
        const share = Math.min(1, Math.abs(value) / largest), end = value < 0 ? ends[0] : ends[2];
        u.ctx.fillStyle = `rgb(${ends[1].map((c, m) => Math.round(c + (end[m] - c) * share)).join(" ")})`;
        const left = u.valToPos(x[k], "x", true), bottom = u.valToPos(y[i], "y", true);
        // a hair wider than the tile, so that no seams show
        u.ctx.fillRect(left, bottom, u.valToPos(x[k + 1], "x", true) - left + 1, u.valToPos(y[i + 1], "y", true) - bottom - 1);
      }));
      u.ctx.restore();
    };
    const told = document.createElement("output");
    const find = (edges, v) => edges.findIndex((edge, k) => v >= edge && v <= edges[k + 1]);
    const tell = (u) => {
      const { left, top } = u.cursor;
      const value = left < 0 ? null : table[find(y, u.posToVal(top, "y"))]?.[find(x, u.posToVal(left, "x"))];
      told.textContent = value == null ? "" : `${digits(u.posToVal(left, "x"))}, ${digits(u.posToVal(top, "y"))}: ${digits(value)}`;
    };
    plot(place, {
      height: 300, padding: PADDING, legend: { show: false }, series: [{}, { paths: () => null, points: { show: false } }],
      scales: { x: { time: false, range: [x[0], x[x.length - 1]] }, y: { range: [y[0], y[y.length - 1]] } },
      axes: [xAxis(figure.x_label, { grid: { show: false } }), yAxis(figure.y_label, { grid: { show: false } })],
      cursor: { drag: still, points: { show: false } }, hooks: { drawClear: [paint], setCursor: [tell] },
    }, [x, x.map(() => null)]);
    const scale = document.createElement("p");
    scale.className = "scale";
    scale.append(`−${Number(largest.toPrecision(2))}`, document.createElement("i"), `+${Number(largest.toPrecision(2))}`, told);
    place.append(scale);
  }

  const draw = { lines, bars, map };
  for (const place of document.querySelectorAll("[data-figure]")) {
    const figure = numbers.figures[Number(place.dataset.figure)];
    later(place, () => draw[figure.type](place, figure));
  }
})();
