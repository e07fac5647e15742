// SPDX-License-Identifier: BSD-3-Clause
// What figures and panels share: numbers, colours of the theme, options of uPlot.
"use strict";
const common = (() => {
  const root = document.documentElement;
  const numbers = JSON.parse(document.getElementById("numbers").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const plots = [];  // every uPlot of the page, for the theme and for paper

  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  const digits = (value) => (value == null ? "–" : Number(value.toPrecision(4)).toString().replace("-", "−"));
  const faint = (name, alpha) => {
    const [r, g, b] = colour(name).match(/[0-9a-f]{2}/gi).map((part) => parseInt(part, 16));
    return `rgb(${r} ${g} ${b} / ${alpha})`;
  };

  // Base64 of 32-bit floats; uPlot draws a gap at null.
  function unpack(text) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return Array.from(new Float32Array(bytes.buffer), (v) => (Number.isNaN(v) ? null : v));
  }

  // whole pixels: uPlot scales the digits before "px"
  const FONT = '12px system-ui, "DejaVu Sans", sans-serif', LABEL = '13px system-ui, "DejaVu Sans", sans-serif';
  const axis = (label, more = {}) => ({
    label, font: FONT, labelFont: LABEL, labelSize: 20, labelGap: 0, stroke: () => colour("soft"),
    grid: { stroke: () => colour("grid"), width: 1 }, ticks: { stroke: () => colour("line"), width: 1, size: 4 },
    values: (u, splits) => splits.map((v) => (v == null ? "" : digits(v))), ...more,
  });
  const xAxis = (label, more) => axis(label, { size: 26, space: 70, ...more });
  const yAxis = (label, more) => axis(label, { size: 48, space: 28, ...more });

  // Markers take the colours of the theme by name: they are elements, not strokes of a canvas.
  const legend = (colours, dashes = []) => ({
    live: true, markers: { width: 2, stroke: (u, i) => `var(--${colours[i - 1]})`, dash: (u, i) => dashes[i - 1] || "solid", fill: () => "transparent" },
  });

  // A name in the legend is a button: with the keyboard too.
  function usable(u) {
    u.root.querySelectorAll(".u-series").forEach((row, i) => {
      const name = row.querySelector("th");
      if (!i || !name) return;
      name.tabIndex = 0;
      name.setAttribute("role", "button");
      name.title = "show or hide";
      name.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault(); event.stopPropagation(); name.click();
      });
    });
  }

  // A plot as wide as its place; `shape` gives the options for a width.
  function plot(place, options, data) {
    const width = () => Math.max(place.clientWidth, 200);
    const u = new uPlot({ ...options, width: width() }, data, place);
    usable(u);
    plots.push(u);
    u.fit = () => { if (width() !== u.width) u.setSize({ width: width(), height: options.height }); };
    new ResizeObserver(u.fit).observe(place);
    return u;
  }

  // What the window shows is drawn at once; the rest once the page is there, one plot whenever the
  // browser is idle, or all of it when it is wanted, as on paper.
  const waiting = [];
  const idle = window.requestIdleCallback || ((act) => setTimeout(act, 20));
  const later = (place, draw) => { if (root.dataset.drawn) draw(); else waiting.push({ place, draw }); };
  const drawAll = () => { while (waiting.length) waiting.shift().draw(); root.dataset.drawn = "all"; };
  function drawShown() {
    const seen = ({ place }) => { const box = place.getBoundingClientRect(); return box.bottom >= 0 && box.top <= window.innerHeight; };
    for (const item of waiting.filter(seen)) { waiting.splice(waiting.indexOf(item), 1); item.draw(); }
  }
  function drawRest() {
    if (waiting.length > 1) { waiting.shift().draw(); idle(drawRest); } else drawAll();
  }
  window.addEventListener("load", () => { drawShown(); idle(drawRest); });
  // Paper has no clicks: what is folded is printed too, and folded again afterwards.
  let unfolded = [];
  window.addEventListener("beforeprint", () => {
    unfolded = [...document.querySelectorAll("details:not([open])")].filter((d) => !d.matches(".numbers-of, .all-joints"));
    unfolded.forEach((d) => { d.open = true; });
    drawAll();
  });
  window.addEventListener("afterprint", () => { unfolded.forEach((d) => { d.open = false; }); unfolded = []; });

  const redraw = () => plots.forEach((u) => u.redraw(false));

  document.getElementById("theme").addEventListener("click", () => {
    const now = root.dataset.theme || (dark.matches ? "dark" : "light");
    root.dataset.theme = now === "dark" ? "light" : "dark";
    redraw();
  });
  dark.addEventListener("change", redraw);
  // Paper is white and narrow: styles switch by themselves, canvases must be drawn again.
  const paper = window.matchMedia("print");
  paper.addEventListener("change", () => { plots.forEach((u) => u.fit()); redraw(); });

  return { numbers, colour, faint, digits, unpack, xAxis, yAxis, legend, plot, later, drawShown, drawAll };
})();
