"use strict";
(() => {
  const token = new URLSearchParams(location.search).get("token");
  const el = (id) => document.getElementById(id);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const percent = (x) => (100 * x).toFixed(Math.abs(x) < 0.0995 ? 1 : 0) + "%";
  const joint = () => Number(el("joint").value);
  const trajectory = () => Number(el("trajectory").value);
  const short = (x) => (x == null ? "–" : Number(x.toPrecision(2)).toString());
  const on = (joints) => (joints.length === state.joints.length && joints.length > 1 ? "all joints" : `joint${joints.length > 1 ? "s" : ""} ${joints.join(", ")}`);
  const unit = () => state.units[joint() - 1];
  let state = null, curves = null, plots = [];
  let chosen = null, span = null;  // the moment that was clicked, and the stretch it stands for
  let moment = null;  // where the keyboard is
  let asked = 0;  // changes so far: an answer to an older question is not shown

  function node(tag, text, className) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (className) made.className = className;
    return made;
  }
  const say = (text) => { el("status").textContent = text; };

  async function ask(question, args = {}) {
    let answer;
    try {
      answer = await fetch("/api/" + question, {
        method: "POST", headers: { "X-Token": token, "Content-Type": "application/json" },
        body: JSON.stringify(args),
      });
    } catch {
      say("no response: is skidyn explore still running?");
      throw new Error("no answer");
    }
    const content = await answer.json().catch(() => ({ error: "skidyn explore failed; see its terminal for the reason" }));
    if (!answer.ok) { say(content.error); throw new Error(content.error); }
    return content;
  }

  // ---------------------------------------------------------------- curves
  const torqueData = () => ["time", "measured", "given", "now"].map((name) => curves.torque[name]);
  const residualData = () => ["time", "given", "now"].map((name) => curves.residual[name]);
  const ends = () => [curves.torque.time[0], curves.torque.time.at(-1)];

  function options(title, series, height, clickable) {
    const axis = { stroke: colour("--soft"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
    const hooks = { drawClear: [mark], setCursor: [read] };
    if (clickable) hooks.ready = [(u) => {
      let from = null;
      u.over.addEventListener("mousedown", (e) => { from = e.clientX; });
      u.over.addEventListener("mouseup", (e) => {
        if (from !== null && Math.abs(e.clientX - from) < 4) choose(u.posToVal(e.offsetX, "x"));
        from = null;
      });
    }];
    return {
      title: `${title} in ${unit()}`, width: el("torque").clientWidth, height, series: [{}, ...series], hooks,
      cursor: { sync: { key: "skidyn" }, drag: { x: true, y: false } }, scales: { x: { time: false } },
      axes: [{ ...axis, label: "time in s", labelSize: 20, size: 34 }, { ...axis, size: 60 }],
    };
  }
  function mark(u) {  // the stretch by which effects are ranked, and where the keyboard is
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    if (span) {
      const [a, b] = span.map((t) => u.valToPos(t, "x", true));
      ctx.fillStyle = colour("--here");
      ctx.fillRect(a, bbox.top, Math.max(b - a, 2), bbox.height);
    }
    for (const [t, dash] of [[chosen, []], [moment, [6, 4]]]) {
      if (t === null) continue;
      const x = u.valToPos(t, "x", true);
      ctx.strokeStyle = colour("--mark"); ctx.lineWidth = 2; ctx.setLineDash(dash);
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
    }
    ctx.restore();
  }
  function told(time) {  // numbers nearest to a time
    const near = (times) => times.reduce((best, t, i) => (Math.abs(t - time) < Math.abs(times[best] - time) ? i : best), 0);
    const { torque, residual } = curves, i = near(torque.time), k = near(residual.time);
    const text = `${time.toFixed(2)} s: measured ${torque.measured[i].toFixed(2)} ${unit()}`;
    const there = residual.given[k] != null && torque.given[i] != null;
    return text + (there ? `, residual as given ${residual.given[k].toFixed(2)}, now ${residual.now[k].toFixed(2)}` : "; the joint is at rest or reverses");
  }
  function read(u) { el("readout").textContent = u.cursor.left < 0 || u.cursor.left == null ? "" : told(u.posToVal(u.cursor.left, "x")); }
  function show() {  // new numbers, same axes of time
    const { min, max } = plots[0].scales.x;
    [torqueData(), residualData()].forEach((data, k) => plots[k].batch(() => {
      plots[k].setData(data, false);
      plots[k].setScale("x", { min, max });
    }));
    drawn();
  }
  function draw() {
    const line = (label, name, dash) => ({ label, stroke: colour(name), width: 1.3, dash });
    const both = [line("given", "--given", [5, 4]), line("now", "--now")];
    for (const p of plots) p.destroy();
    plots = [
      new uPlot(options("Torque", [line("measured", "--measured"), ...both], 260, false), torqueData(), el("torque")),
      new uPlot(options("Held-out residual, averaged,", both, 220, true), residualData(), el("residual")),
    ];
    for (const p of plots) p.setScale("x", { min: ends()[0], max: ends()[1] });  // the residual is shorter
    drawn();
  }
  function drawn() { document.body.dataset.drawn = `${joint()} ${trajectory()} ${state.history.length}`; }
  const redraw = () => plots.forEach((p) => p.redraw(false));

  // ---------------------------------------------------------------- errors and effects
  function errors() {
    const first = state.history[0].rmse, last = state.history.at(-1).rmse;
    el("unit").textContent = [...new Set(state.units)].join(" or ");
    el("errors").tBodies[0].replaceChildren(...state.joints.map((name, j) => {
      const share = first[j] > 0 ? last[j] / first[j] : 1, worse = share > 1.02;
      const row = node("tr"), cell = node("td"), bar = node("span", undefined, "bar"), fill = node("i"), mark = node("b");
      row.classList.toggle("worse", worse);
      mark.style.left = 100 * Math.min(1, first[j] > 0 ? state.noise[j] / first[j] : 1) + "%";
      row.classList.toggle("this", j === joint() - 1);
      fill.style.width = 100 * Math.min(1, share) + "%";
      bar.title = percent(share) + " of the error as given";
      bar.append(fill, mark); cell.append(bar);
      const now = node("td", short(last[j]) + (worse ? " ▲" : ""));
      if (worse) now.title = "worse than the model as given";
      row.append(node("td", `${name.replaceAll("_", "_\u200b")} (${j + 1})`), node("td", short(first[j])), now, node("td", short(state.noise[j])), cell);
      return row;
    }));
    el("added").replaceChildren(...state.history.slice(1).map((h, k) => {
      const item = node("li"), off = node("button", "Remove");
      off.setAttribute("aria-label", `Remove ${state.titles[k + 1]}`);
      off.addEventListener("click", () => remove(k + 1));
      item.append(node("span", `${state.titles[k + 1]} on ${on(h.joints)}`), off, node("small", "", "size"), node("small", "", "sure"));
      return item;
    }));
    if (state.history.length < 2) el("added").append(node("li", "nothing yet"));
    el("undo").disabled = state.history.length < 2;
  }
  function effect(e) {
    const item = node("li"), button = node("button"), bar = node("span", undefined, "bar"), fill = node("i");
    const share = span ? e.drop_here : e.drop;
    button.dataset.kind = e.kind;
    button.append(node("span", e.title), node("span", percent(share)));
    const which = e.trajectories.length ? ` in trajector${e.trajectories.length > 1 ? "ies" : "y"} ${e.trajectories.join(", ")}` : "";
    button.append(node("small", `on ${on(e.joints)}${which}: removes ${percent(e.drop)} of the squared residual of joint ${joint()}`
      + (span ? ` in the whole log, ${percent(e.drop_here)} in the chosen time` : "")));
    fill.style.width = 100 * Math.max(0, Math.min(1, share)) + "%";
    bar.append(fill); button.append(bar);
    button.addEventListener("click", () => add(e.kind));
    item.append(button);
    return item;
  }
  async function rank() {
    const mine = asked;
    el("effects").setAttribute("aria-busy", "true");
    let answer;
    try {
      answer = await ask("ranked", chosen === null ? { joint: joint() } : { joint: joint(), trajectory: trajectory(), time: chosen });
    } catch (error) {
      if (chosen === null || mine !== asked) throw error;
      chosen = span = null; redraw();  // nothing can be told there: back to the whole log
      return rank();
    }
    if (mine !== asked) return;
    span = answer.span;
    const place = span ? `trajectory ${trajectory()}, ${span[0].toFixed(1)} to ${span[1].toFixed(1)} s` : "whole log";
    el("where").textContent = `(joint ${joint()}, ${place})`;
    el("whole").hidden = el("chosen").hidden = !span;
    el("effects").replaceChildren(...answer.effects.map(effect));
    if (!answer.effects.length) el("effects").append(node("li", `No further effect of the catalogue reduces the held-out error of joint ${joint()} by 1% or more.`));
    el("effects").removeAttribute("aria-busy");
    redraw();
    document.body.dataset.ranked = `${joint()} ${span ? "span" : "all"} ${state.history.length}`;
  }

  // ---------------------------------------------------------------- what the user does
  async function change(question, args = {}) {
    const mine = ++asked;
    const answer = await ask(question, { ...args, joint: joint(), trajectory: trajectory() });
    if (mine !== asked) return false;
    state = answer; curves = answer.curves;
    errors(); show();
    return true;
  }
  async function add(kind) {
    const start = performance.now();
    el("effects").setAttribute("aria-busy", "true");  // a second click while the first is fitted is not taken
    try {
      if (!(await change("add", { kind }))) return;
    } finally { el("effects").removeAttribute("aria-busy"); }
    const spent = (performance.now() - start).toFixed(0);
    document.body.dataset.spent = spent;
    say(`${state.titles.at(-1)} added and refitted in ${spent} ms`);
    await rank();
    if (state.refinable && (await change("refine"))) {
      await rank();
      document.body.dataset.refined = state.history.length;
    }
    await sizes();
  }
  async function sizes() {  // what was added in numbers, once the fit is settled
    const mine = asked, answer = await ask("sizes");
    if (mine !== asked) return;
    for (const [name, texts] of [["size", answer.sizes], ["sure", answer.sure]])
      el("added").querySelectorAll(`small.${name}`).forEach((place, k) => { place.textContent = texts[k] || ""; });
  }
  async function remove(step) {
    if (await change("remove", { step })) { say("removed; the model was refitted"); await rank(); await sizes(); }
  }
  async function undo() {
    if (await change("undo")) { say("taken back"); await rank(); await sizes(); }
  }
  async function save() {
    el("save").disabled = true;
    say("saving ...");
    try {
      const { saved } = await ask("save");
      // the report diagnoses in full; the loop goes on meanwhile
      const report = ask("report");
      let done = false;
      const timer = setInterval(async () => {
        const { text, share } = await ask("progress");
        if (!done) el("saved").textContent = `saved: ${saved.join(", ")}; report: ${text}${share === null ? "" : " " + percent(share)}`;
      }, 1000);
      try { saved.push(...(await report).saved); } finally { done = true; clearInterval(timer); }
      el("saved").replaceChildren("saved: ", ...saved.flatMap((path, k) => [k ? ", " : "", link(path)]));
      say("");
    } finally { el("save").disabled = false; }
  }
  function link(path) {  // opened or downloaded from the program that wrote it
    const made = node("a", path), name = path.split(/[\\/]/).at(-1);
    made.href = `/saved/${name}?token=${token}`; made.target = "_blank"; made.rel = "noopener";
    return made;
  }
  async function choose(time) {
    chosen = moment = time; span = null; asked += 1;
    aim(time);
    await rank();
  }
  async function wholeLog() { chosen = span = null; asked += 1; redraw(); await rank(); }
  async function look() {  // at another joint or trajectory
    const mine = ++asked;
    chosen = span = moment = null;
    const answer = await ask("curves", { joint: joint(), trajectory: trajectory() });
    if (mine !== asked) return;
    curves = answer;
    errors(); draw();
    const slider = el("residual");
    const [low, high] = ends();
    const now = { "aria-valuemin": low, "aria-valuemax": high, "aria-valuenow": low, "aria-valuetext": told(low) };
    for (const [name, value] of Object.entries(now)) slider.setAttribute(name, value);
    await rank();
  }

  // ---------------------------------------------------------------- the same by keyboard
  function aim(time) {
    const [low, high] = ends();
    moment = Math.min(Math.max(time, low), high);
    const text = told(moment);
    el("residual").setAttribute("aria-valuenow", moment);
    el("residual").setAttribute("aria-valuetext", text);
    el("readout").textContent = text;
    redraw();
  }
  function zoom(factor) {
    const [low, high] = ends(), { min, max } = plots[0].scales.x;
    const half = Math.min((max - min) * factor, high - low) / 2;
    const middle = Math.min(Math.max(moment ?? (min + max) / 2, low + half), high - half);
    for (const p of plots) p.setScale("x", { min: middle - half, max: middle + half });
  }
  function key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const { min, max } = plots[0].scales.x, step = ((max - min) / 200) * (e.shiftKey ? 10 : 1), at = moment ?? min;
    const does = {
      ArrowLeft: () => aim(at - step), ArrowRight: () => aim(at + step),
      PageDown: () => aim(at - 20 * step), PageUp: () => aim(at + 20 * step),
      Home: () => aim(-Infinity), End: () => aim(Infinity),
      Enter: () => choose(at), " ": () => choose(at), Escape: wholeLog,
      "+": () => zoom(0.5), "-": () => zoom(2), 0: () => zoom(Infinity),
    }[e.key];
    if (does) { e.preventDefault(); does(); }
  }

  function doubts() {  // suspicions about the log, with the options that fix them
    const told = state.checks.map((check) => {
      const line = node("li", undefined, check.certainty);
      line.append(node("b", `${check.suspicion} (${check.certainty})`), node("span", check.evidence));
      const benefit = check.benefit ? ` (${check.benefit})` : "";
      if (check.remedy) line.append("fix it with ", node("code", check.remedy.option), benefit);
      return line;
    });
    el("doubts").querySelector("ul").replaceChildren(...told);
    el("doubts").hidden = !told.length;
  }
  async function start() {
    state = await ask("state");
    el("joint").replaceChildren(...state.joints.map((name, j) => new Option(`${name} (${j + 1})`, j + 1)));
    el("trajectory").replaceChildren(...state.trajectories.map((k) => new Option(k, k)));
    el("joint").value = state.worst;
    doubts();
    for (const id of ["joint", "trajectory"]) el(id).addEventListener("change", look);
    el("undo").addEventListener("click", undo);
    el("save").addEventListener("click", save);
    el("whole").addEventListener("click", wholeLog);
    el("residual").addEventListener("keydown", key);
    addEventListener("resize", () => plots.forEach((p) => p.setSize({ width: el("torque").clientWidth, height: p.height })));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    await look();
    if (state.history.length > 1) await sizes();
  }
  // what failed was said in the status line already
  addEventListener("unhandledrejection", (e) => { if (el("status").textContent) e.preventDefault(); });
  start();
})();
