"use strict";
(() => {
  const token = new URLSearchParams(location.search).get("token");
  const el = (id) => document.getElementById(id);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let state = null, plots = [], span = null;

  async function ask(question, words = {}) {
    const answer = await fetch("/api/" + question, {
      method: "POST", headers: { "X-Token": token, "Content-Type": "application/json" },
      body: JSON.stringify(words),
    });
    const content = await answer.json();
    if (!answer.ok) { el("status").textContent = content.error; throw new Error(content.error); }
    return content;
  }
  const joint = () => Number(el("joint").value);
  const trajectory = () => Number(el("trajectory").value);
  const percent = (x) => (100 * x).toFixed(0) + " %";
  const words = (kind) => kind.replaceAll("_", " ");
  function node(tag, text, className) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  }

  function options(title, series, height, unit, clicked) {
    const axis = { stroke: colour("--soft"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
    return {
      title: `${title} in ${unit}`, width: el("torque").clientWidth, height, series: [{}, ...series],
      cursor: { sync: { key: "skidyn" }, drag: { x: true, y: false } },
      scales: { x: { time: false } }, axes: [{ ...axis, label: "time in s" }, { ...axis, size: 60 }],
      hooks: clicked ? { ready: [(u) => {
        let from = null;
        u.over.addEventListener("mousedown", (e) => { from = e.clientX; });
        u.over.addEventListener("mouseup", (e) => {
          if (from !== null && Math.abs(e.clientX - from) < 4) clicked(u.posToVal(e.offsetX, "x"));
          from = null;
        });
      }] } : {},
    };
  }

  async function draw() {
    const c = await ask("curves", { joint: joint(), trajectory: trajectory() });
    const unit = state.units[joint() - 1];
    const line = (label, name, dash) => ({ label, stroke: colour(name), width: 1.3, dash });
    for (const p of plots) p.destroy();
    const minus = (a, b) => a.map((x, i) => x - b[i]);
    const torque = [c.time, c.measured, c.given, c.now];
    const residual = [c.time, minus(c.measured, c.given), minus(c.measured, c.now)];
    plots = [
      new uPlot(options("Torque", [line("measured", "--measured"), line("given", "--given", [5, 4]), line("now", "--now")], 260, unit), torque, el("torque")),
      new uPlot(options("Residual", [line("given", "--given", [5, 4]), line("now", "--now")], 220, unit, fails), residual, el("residual")),
    ];
    document.body.dataset.drawn = `${joint()} ${trajectory()} ${state.history.length}`;
  }

  async function rank() {
    el("where").textContent = `joint ${joint()}` + (span ? `, ${span[0].toFixed(1)} to ${span[1].toFixed(1)} s` : "");
    const { effects } = await ask("ranked", { joint: joint(), trajectory: span ? trajectory() : null, span });
    el("effects").replaceChildren(...effects.map((e) => {
      const item = node("li"), button = node("button");
      button.dataset.kind = e.kind;
      const share = span ? e.drop_here : e.drop;
      button.append(node("span", e.title), node("span", percent(share)));
      button.append(node("small", `joint ${e.joints.join(", ")}: takes ${percent(e.drop)} of the held-out squared error` + (span ? `, ${percent(e.drop_here)} of the error here` : "")));
      const bar = node("span", undefined, "bar"), fill = node("i");
      fill.style.width = 100 * Math.max(0, Math.min(1, share)) + "%";
      bar.append(fill); button.append(bar);
      button.addEventListener("click", () => add(e.kind));
      item.append(button);
      return item;
    }));
    if (!effects.length) el("effects").append(node("li", "Nothing of the catalogue lowers the held-out error of this joint."));
    document.body.dataset.ranked = `${joint()} ${span ? "span" : "all"} ${state.history.length}`;
  }

  function errors() {
    const first = state.history[0].rmse, last = state.history[state.history.length - 1].rmse;
    el("errors").tBodies[0].replaceChildren(...state.joints.map((name, j) => {
      const row = node("tr");
      row.append(node("td", `${j + 1} ${name}`), node("td", first[j].toPrecision(3)), node("td", last[j].toPrecision(3)));
      const cell = node("td"), bar = node("span", undefined, "bar"), fill = node("i");
      fill.style.width = 100 * (first[j] > 0 ? Math.min(1, last[j] / first[j]) : 1) + "%";
      bar.title = percent(first[j] > 0 ? last[j] / first[j] : 1) + " of the error as given";
      bar.append(fill); cell.append(bar); row.append(cell);
      return row;
    }));
    el("added").replaceChildren(...state.history.slice(1).map((h) => node("li", `${words(h.added)} on joint ${h.joints.join(", ")}`)));
    el("undo").disabled = state.history.length < 2;
  }

  async function add(kind) {
    const start = performance.now();
    state = await ask("add", { kind, joint: joint() });
    errors();
    await draw();
    const spent = performance.now() - start;
    el("status").textContent = `${words(kind)} added, fitted again in ${spent.toFixed(0)} ms`;
    document.body.dataset.spent = spent.toFixed(0);
    await rank();
  }
  async function undo() {
    state = await ask("undo");
    errors(); await draw(); await rank();
    el("status").textContent = "taken back";
  }
  async function save() {
    el("status").textContent = "saving ...";
    const { saved } = await ask("save");
    el("status").textContent = "saved: " + saved.join(", ");
  }
  function fails(time) { span = [time - 0.5, time + 0.5]; rank(); }
  async function chosen() { span = null; await draw(); await rank(); }

  async function start() {
    state = await ask("state");
    el("joint").replaceChildren(...state.joints.map((name, j) => new Option(`${j + 1} ${name}`, j + 1)));
    el("trajectory").replaceChildren(...state.trajectories.map((k) => new Option(k, k)));
    for (const id of ["joint", "trajectory"]) el(id).addEventListener("change", chosen);
    el("undo").addEventListener("click", undo);
    el("save").addEventListener("click", save);
    addEventListener("resize", () => plots.forEach((p) => p.setSize({ width: el("torque").clientWidth, height: p.height })));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    errors();
    await chosen();
  }
  start();
})();
