// SPDX-License-Identifier: BSD-3-Clause
// Torque and residual over time: one panel per joint, zoom and cursor linked over all of them.
"use strict";
(() => {
  const { numbers, colour, faint, digits, unpack, xAxis, yAxis, legend, plot, later, drawShown, drawAll } = common;
  const host = document.getElementById("plots"), place = document.getElementById("panels");
  if (!host) return;
  const { joints, starts, end: last, shown: first } = numbers.panels;
  const end = Math.max(last, 1e-9), shown = new Set(first), reading = host.querySelector("[role=status]");
  let view = [0, end];

  const all = () => joints.flatMap((joint) => joint.drawn || []);

  function setView(low, high) {
    const span = Math.min(end, Math.max(Math.min(end, 0.02), high - low));
    const start = Math.min(Math.max(0, low), end - span);
    view = [start, start + span];
    host.dataset.view = view.map((t) => t.toFixed(4)).join(" ");
    for (const u of all()) u.setScale("x", { min: view[0], max: view[1] });
  }
  const zoom = (factor, at = (view[0] + view[1]) / 2) =>
    setView(at - (at - view[0]) * factor, at + (view[1] - at) * factor);
  const acts = { in: () => zoom(0.5), out: () => zoom(2), all: () => setView(0, end) };

  // Where the user has dragged or double-clicked in one plot, the others follow.
  function follow(u, key) {
    const { min, max } = u.scales.x;
    if (key !== "x" || min == null) return;
    if (Math.abs(min - view[0]) + Math.abs(max - view[1]) > 1e-6 * end) setView(min, max);
  }

  // Columns of a joint over the times of all its tables; null where a line must not be drawn on.
  function columns(joint) {
    const tables = joint.tables.map((table) => {
      const time = unpack(table.time), breaks = new Set(table.breaks), rows = [];
      time.forEach((_, i) => { if (breaks.has(i)) rows.push(null); rows.push(i); });
      const at = rows.map((i, k) => (i === null ? (time[rows[k - 1]] + time[rows[k + 1]]) / 2 : time[i]));
      const read = (text) => { const values = unpack(text); return rows.map((i) => (i === null ? null : values[i])); };
      return { at, columns: Object.fromEntries(Object.entries(table.columns).map(([key, text]) => [key, read(text)])) };
    });
    const difference = (a, b) => a.map((v, i) => (v == null || b[i] == null ? null : v - b[i]));
    return (series) => uPlot.join(tables.map((table, k) => [table.at, ...series.filter((s) => s.of[0] === k).map(
      ({ of: [, one, other] }) => (other ? difference(table.columns[one], table.columns[other]) : table.columns[one]))]),
      tables.map((table, k) => [0, ...series.filter((s) => s.of[0] === k).map(() => 1)]));
  }

  // Borders of trajectories behind the curves, their numbers above the upper plot.
  const borders = (named) => (u) => {
    const { ctx, bbox } = u, ratio = ctx.canvas.width / u.width;
    let before = -Infinity;
    ctx.save();
    ctx.strokeStyle = colour("border"); ctx.fillStyle = colour("soft"); ctx.lineWidth = ratio;
    ctx.font = `${11 * ratio}px system-ui, sans-serif`; ctx.textAlign = "left"; ctx.textBaseline = "bottom";
    for (const start of starts) {
      const x = u.valToPos(start.time, "x", true);
      if (x < bbox.left - 1 || x > bbox.left + bbox.width) continue;
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
      if (!named || x - before < 34 * ratio) continue;
      ctx.fillText(`#${start.trajectory}`, x + 3 * ratio, bbox.top - 1); before = x;
    }
    ctx.restore();
  };

  // What is not judged lies in the shade: rest, and a lighter one around reversals.
  const shade = (joint) => (u) => {
    const { ctx, bbox } = u;
    ctx.save();
    for (const [from, to, reason] of joint.apart || []) {
      if (to < view[0] || from > view[1]) continue;
      const left = Math.max(bbox.left, u.valToPos(from, "x", true)), right = Math.min(bbox.left + bbox.width, u.valToPos(to, "x", true));
      ctx.fillStyle = faint("soft", reason === "rest" ? 0.24 : 0.11);
      ctx.fillRect(left, bbox.top, Math.max(right - left, 1), bbox.height);
    }
    ctx.restore();
  };

  function clock(u, t) {
    if (t == null) return "–";
    const part = starts.filter((s) => s.time <= t + 1e-6).pop();
    return part ? `${digits(t - part.time)} s in trajectory ${part.trajectory}` : `${digits(t)} s`;
  }

  function draw(joint) {
    const table = columns(joint);
    joint.drawn = joint.plots.map((wanted, k) => {
      const bottom = k === joint.plots.length - 1, order = joint.tables.flatMap((_, t) => wanted.series.filter((s) => s.of[0] === t));
      const series = order.map((s) => ({
        label: s.label, stroke: () => (s.wide ? faint(s.colour, 0.4) : colour(s.colour)), width: s.wide ? 3.2 : 1.3, dash: s.dash ? [6, 4] : undefined,
        points: { show: false }, value: (u, v) => (v == null ? "–" : `${digits(v)} ${joint.unit}`),
      }));
      const part = document.createElement("div");
      joint.box.append(part);
      const u = plot(part, {
        height: wanted.height + (bottom ? 34 : 0), padding: [k ? 8 : 18, 12, bottom ? 0 : 8, 0],
        series: [{ label: "time", value: clock }, ...series], legend: legend(order.map((s) => s.colour), order.map((s) => (s.dash ? "dashed" : "solid"))),
        scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: wanted.range ? { range: () => wanted.range } : {} },
        axes: [xAxis("time in s, trajectories one after another", bottom ? {} : { label: undefined, size: 4, values: (_, s) => s.map(() => "") }),
          yAxis(wanted.label)],
        cursor: { drag: { x: true, y: false, setScale: true }, y: false, sync: {
          key: "joints", scales: ["x", null],
          // other plots follow the cursor; they follow the zoom through setView
          filters: { pub: (type) => type === "mousemove" || type === "mouseleave" },
        } },
        hooks: { drawClear: [shade(joint)], drawAxes: [borders(k === 0)], setScale: [follow] },
      }, table(order));
      if (wanted.note) {
        const note = document.createElement("p");
        note.className = "note"; note.textContent = wanted.note;
        part.append(note);
      }
      u.setScale("x", { min: view[0], max: view[1] });
      u.over.addEventListener("wheel", (event) => {
        if (!event.ctrlKey) return;  // the wheel alone scrolls the page
        event.preventDefault();
        zoom(event.deltaY > 0 ? 1.25 : 0.8, u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x"));
      }, { passive: false });
      return u;
    });
  }

  // The reading cursor steps over pixels of the upper plot; the others are linked with it.
  function step(joint, pixels) {
    const [u] = joint.drawn, { width, height } = u.over.getBoundingClientRect();
    const from = u.cursor.left >= 0 ? u.cursor.left : width / 2;
    u.setCursor({ left: Math.min(width - 1, Math.max(0, from + pixels)), top: height / 2 }, true, true);
    reading.textContent = [...joint.box.querySelectorAll(".u-series")]
      .map((row) => `${row.querySelector(".u-label").textContent} ${row.querySelector(".u-value").textContent}`).join(", ");
  }

  function build(joint) {
    joint.box = document.createElement("div");
    joint.box.className = "panel"; joint.box.tabIndex = 0;
    joint.box.setAttribute("role", "group");
    joint.box.setAttribute("aria-label", `Residual and torque of joint ${joint.name} over time`);
    joint.box.setAttribute("aria-describedby", "keys");
    const title = document.createElement("h4");
    title.textContent = joint.name;
    joint.box.append(title);
    joint.box.addEventListener("keydown", (event) => {
      const width = 0.2 * (view[1] - view[0]);
      const keys = event.shiftKey
        ? { ArrowLeft: () => step(joint, -4), ArrowRight: () => step(joint, 4), "+": acts.in }
        : { ArrowLeft: () => setView(view[0] - width, view[1] - width), ArrowRight: () => setView(view[0] + width, view[1] + width),
            "+": acts.in, "=": acts.in, "-": acts.out, 0: acts.all };
      if (event.ctrlKey || event.metaKey || !keys[event.key]) return;
      drawAll();
      event.preventDefault(); keys[event.key]();
    });
  }

  function arrange() {
    const chosen = joints.filter((_, i) => shown.has(i)), fresh = chosen.filter((joint) => !joint.box);
    fresh.forEach(build);
    place.replaceChildren(...chosen.map((joint) => joint.box));
    // a plot is as wide as its place, so that comes first
    fresh.forEach((joint) => later(joint.box, () => draw(joint)));
    drawShown();
    setView(...view);
  }

  const chooser = host.querySelector("fieldset");
  joints.forEach((joint, index) => {
    const label = document.createElement("label"), tick = document.createElement("input");
    tick.type = "checkbox"; tick.checked = shown.has(index);
    tick.addEventListener("change", () => { if (tick.checked) shown.add(index); else shown.delete(index); arrange(); });
    label.append(tick, ` ${joint.name}`);
    chooser.append(label);
  });
  for (const button of host.querySelectorAll("[data-act]"))
    button.addEventListener("click", () => acts[button.dataset.act]());
  arrange();
})();
