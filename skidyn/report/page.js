// SPDX-License-Identifier: BSD-3-Clause
// Torque over time on canvas: one panel per joint, zoom linked, values under the pointer.
"use strict";
(() => {
  const host = document.getElementById("plots");
  const plots = JSON.parse(document.getElementById("numbers").textContent);
  const panels = document.getElementById("panels");
  const unpack = (text) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    return new Float32Array(bytes.buffer);
  };
  const joints = plots.joints;
  const end = Math.max(plots.end, 1e-9);
  let view = [0, end];
  const shown = new Set(plots.shown);
  const LEFT = 58, RIGHT = 10, TOP = 8, GAP = 26, BOTTOM = 36;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const digits = (value) => Number(value.toPrecision(4)).toString();

  // First index whose time is not before t.
  const search = (time, t) => {
    let low = 0, high = time.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (time[middle] < t) low = middle + 1; else high = middle;
    }
    return low;
  };

  const ticks = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].find((m) => m * power >= raw * 0.999) * power;
    const values = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) values.push(k * step);
    return values;
  };

  function extent(series, from, to) {
    let low = Infinity, high = -Infinity;
    for (const values of series)
      for (let i = from; i < to; i++) {
        if (values[i] < low) low = values[i];
        if (values[i] > high) high = values[i];
      }
    if (!(high > low)) { const m = Number.isFinite(low) ? low : 0; low = m - 1; high = m + 1; }
    const pad = 0.06 * (high - low);
    return [low - pad, high + pad];
  }

  // All points on one column of pixels are one stroke from the lowest to the highest.
  function flush(context, column) {
    if (!column) return;
    context.lineTo(column.px, column.low);
    if (column.high !== column.low) { context.lineTo(column.px, column.high); context.lineTo(column.px, column.last); }
  }

  // One set of axes with lines; the upper holds torque, the lower the residual.
  function axes(context, box, range, joint, lines, from, to, label) {
    const x = (t) => box.left + (t - view[0]) / (view[1] - view[0]) * box.width;
    const y = (v) => box.bottom - (v - range[0]) / (range[1] - range[0]) * (box.bottom - box.top);
    context.font = "11.5px system-ui, sans-serif";
    context.textBaseline = "middle"; context.textAlign = "right"; context.lineWidth = 1;
    for (const v of ticks(range[0], range[1], Math.max(2, (box.bottom - box.top) / 24))) {
      context.strokeStyle = colour(Math.abs(v) < 1e-12 ? "--soft" : "--grid");
      context.beginPath(); context.moveTo(box.left, y(v)); context.lineTo(box.left + box.width, y(v)); context.stroke();
      context.fillStyle = colour("--soft"); context.fillText(digits(v), box.left - 6, y(v));
    }
    context.save();
    context.translate(11, (box.top + box.bottom) / 2); context.rotate(-Math.PI / 2);
    context.textAlign = "center"; context.fillStyle = colour("--ink");
    context.fillText(label, 0, 0); context.restore();
    context.save();
    context.beginPath(); context.rect(box.left, box.top, box.width, box.bottom - box.top); context.clip();
    context.strokeStyle = colour("--line");
    for (const start of plots.starts) {
      if (start.time <= 0) continue;
      context.beginPath(); context.moveTo(x(start.time), box.top); context.lineTo(x(start.time), box.bottom); context.stroke();
    }
    for (const line of lines) {
      context.strokeStyle = colour(line.colour); context.lineWidth = line.width; context.setLineDash(line.dash);
      context.beginPath();
      let column = null;
      for (let i = from; i < to; i++) {
        const px = x(joint.time[i]), py = y(line.values(i)), here = Math.floor(px);
        if (i === from || joint.breaks.has(i)) {
          flush(context, column);
          context.moveTo(px, py);
          column = { at: here, px, low: py, high: py, last: py };
        } else if (here === column.at) {
          column.low = Math.min(column.low, py); column.high = Math.max(column.high, py); column.last = py;
        } else {
          flush(context, column);
          column = { at: here, px, low: py, high: py, last: py };
        }
      }
      flush(context, column);
      context.stroke(); context.setLineDash([]);
    }
    context.restore();
    return x;
  }

  function draw(joint) {
    const canvas = joint.panel.canvas, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const split = TOP + 0.56 * (height - TOP - BOTTOM - GAP);
    const upper = { left: LEFT, width: width - LEFT - RIGHT, top: TOP, bottom: split };
    const lower = { ...upper, top: split + GAP, bottom: height - BOTTOM };
    const from = Math.max(0, search(joint.time, view[0]) - 1);
    const to = Math.min(joint.time.length, search(joint.time, view[1]) + 1);
    const torque = extent([joint.measured, joint.before], from, to);
    const residual = extent(plots.added ? joint.errors : [joint.errors[0]], from, to);
    const line = (values, name, w, dash = []) => ({ values: (i) => values[i], colour: name, width: w, dash });
    const models = [line(joint.before, "--before", 1.4, [6, 3])];
    const errors = [line(joint.errors[0], "--before", 1.1)];
    if (plots.added) {
      models.push(line(joint.after, "--after", 1.4));
      errors.push(line(joint.errors[1], "--after", 1.1));
    }
    axes(context, upper, torque, joint, [line(joint.measured, "--measured", 1.6), ...models], from, to, `torque in ${joint.unit}`);
    const x = axes(context, lower, residual, joint, errors, from, to, "residual");
    context.textAlign = "center"; context.fillStyle = colour("--soft"); context.textBaseline = "top";
    for (const t of ticks(view[0], view[1], Math.max(2, width / 110))) context.fillText(digits(t), x(t), lower.bottom + 5);
    context.fillStyle = colour("--ink");
    context.fillText("time in s, trajectories one after another", LEFT + upper.width / 2, lower.bottom + 19);
    context.fillStyle = colour("--soft"); context.textAlign = "left"; context.textBaseline = "top";
    let last = -Infinity;
    for (const start of plots.starts) {
      const at = x(start.time) + 3;
      if (at < LEFT || at > width - 40 || at - last < 34) continue;
      context.fillText(`#${start.trajectory}`, at, split + 6); last = at;
    }
    if (joint.panel.drag) {
      const [a, b] = joint.panel.drag;
      context.globalAlpha = 0.15; context.fillStyle = colour("--after");
      context.fillRect(Math.min(a, b), TOP, Math.abs(b - a), height - TOP - BOTTOM); context.globalAlpha = 1;
    }
    if (joint.panel.cursor !== null) {
      context.strokeStyle = colour("--soft");
      context.beginPath(); context.moveTo(x(joint.panel.cursor), TOP); context.lineTo(x(joint.panel.cursor), lower.bottom); context.stroke();
    }
  }

  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; drawAll(); });
  }
  function drawAll() {
    host.dataset.view = view.map((t) => t.toFixed(4)).join(" ");
    for (const index of shown) if (joints[index].panel) draw(joints[index]);
  }
  function setView(low, high) {
    const least = Math.min(end, 0.02), span = Math.min(end, Math.max(least, high - low));
    const start = Math.min(Math.max(0, low), end - span);
    view = [start, start + span]; redraw();
  }
  const zoom = (factor, at = (view[0] + view[1]) / 2) =>
    setView(at - (at - view[0]) * factor, at + (view[1] - at) * factor);
  const acts = { in: () => zoom(0.5), out: () => zoom(2), all: () => setView(0, end) };

  function hover(joint, px) {
    const { canvas, tip } = joint.panel, width = canvas.clientWidth - LEFT - RIGHT;
    const t = view[0] + Math.min(1, Math.max(0, (px - LEFT) / width)) * (view[1] - view[0]);
    let i = Math.min(joint.time.length - 1, search(joint.time, t));
    if (i > 0 && t - joint.time[i - 1] < joint.time[i] - t) i -= 1;
    const part = plots.starts.filter((s) => s.time <= joint.time[i] + 1e-6).pop();
    const rows = [
      `${digits(joint.time[i] - part.time)} s in trajectory ${part.trajectory}`,
      `measured  ${digits(joint.measured[i])} ${joint.unit}`,
      `as given  ${digits(joint.before[i])}  (residual ${digits(joint.measured[i] - joint.before[i])})`,
    ];
    if (plots.added) rows.push(`findings  ${digits(joint.after[i])}  (residual ${digits(joint.measured[i] - joint.after[i])})`);
    tip.textContent = rows.join("\n"); tip.hidden = false;
    tip.style.top = "2rem";
    const right = px > canvas.clientWidth / 2;
    tip.style.left = right ? "" : `${px + 14}px`;
    tip.style.right = right ? `${canvas.clientWidth - px + 14}px` : "";
    for (const index of shown) if (joints[index].panel) joints[index].panel.cursor = joint.time[i];
    redraw();
  }

  function build(joint, index) {
    const box = document.createElement("div"), title = document.createElement("h4");
    const canvas = document.createElement("canvas"), tip = document.createElement("div");
    box.className = "panel"; tip.className = "tip"; tip.hidden = true;
    title.textContent = `${index + 1} ${joint.name}`;
    canvas.tabIndex = 0; canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Measured and modelled torque of joint ${index + 1} over time, with the residual`);
    box.append(title, canvas, tip);
    for (const key of ["time", "measured", "before", "after"]) joint[key] = unpack(joint[key]);
    joint.breaks = new Set(joint.breaks);
    joint.errors = ["before", "after"].map((key) => joint.measured.map((m, i) => m - joint[key][i]));
    joint.panel = { box, canvas, tip, drag: null, cursor: null };
    const position = (event) => event.clientX - canvas.getBoundingClientRect().left;
    const timeAt = (px) => view[0] + (px - LEFT) / (canvas.clientWidth - LEFT - RIGHT) * (view[1] - view[0]);
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      joint.panel.drag = [position(event), position(event)]; canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (joint.panel.drag) { joint.panel.drag[1] = position(event); redraw(); }
      hover(joint, position(event));
    });
    canvas.addEventListener("pointerup", () => {
      if (!joint.panel.drag) return;
      const [a, b] = joint.panel.drag.map(timeAt), far = Math.abs(joint.panel.drag[1] - joint.panel.drag[0]) > 6;
      joint.panel.drag = null;
      if (far) setView(Math.min(a, b), Math.max(a, b)); else redraw();
    });
    canvas.addEventListener("pointercancel", () => { joint.panel.drag = null; redraw(); });
    canvas.addEventListener("pointerleave", () => {
      tip.hidden = true; for (const other of joints) if (other.panel) other.panel.cursor = null;
      redraw();
    });
    canvas.addEventListener("dblclick", acts.all);
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;  // the wheel alone scrolls the page
      event.preventDefault(); zoom(event.deltaY > 0 ? 1.25 : 0.8, timeAt(position(event)));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = 0.2 * (view[1] - view[0]);
      const keys = {
        ArrowLeft: () => setView(view[0] - step, view[1] - step),
        ArrowRight: () => setView(view[0] + step, view[1] + step),
        "+": acts.in, "=": acts.in, "-": acts.out, 0: acts.all,
      };
      if (event.ctrlKey || event.metaKey || !keys[event.key]) return;
      event.preventDefault(); keys[event.key]();
    });
  }

  function arrange() {
    panels.replaceChildren(...joints.filter((_, i) => shown.has(i)).map((joint) => {
      if (!joint.panel) build(joint, joints.indexOf(joint));
      return joint.panel.box;
    }));
    redraw();
  }

  const chooser = host.querySelector("fieldset");
  joints.forEach((joint, index) => {
    const label = document.createElement("label"), tick = document.createElement("input");
    tick.type = "checkbox"; tick.checked = shown.has(index);
    tick.addEventListener("change", () => { if (tick.checked) shown.add(index); else shown.delete(index); arrange(); });
    label.append(tick, ` ${index + 1} ${joint.name}`);
    chooser.append(label);
  });
  for (const button of host.querySelectorAll("[data-act]"))
    button.addEventListener("click", () => acts[button.dataset.act]());

  const root = document.documentElement, dark = window.matchMedia("(prefers-color-scheme: dark)");
  document.getElementById("theme").addEventListener("click", () => {
    const now = root.dataset.theme || (dark.matches ? "dark" : "light");
    root.dataset.theme = now === "dark" ? "light" : "dark";
    redraw();
  });
  dark.addEventListener("change", redraw);
  window.addEventListener("resize", redraw);
  // Paper is white: styles switch by themselves, canvases must be drawn again, and at once.
  window.addEventListener("beforeprint", drawAll);
  window.matchMedia("print").addEventListener("change", drawAll);
  window.addEventListener("afterprint", redraw);
  arrange();
})();
