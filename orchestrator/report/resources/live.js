"use strict";
// Live models: parameters to change, and curves and trains that follow. The simulation is in master.js, in another thread.
(() => {
  const { data, make, digits, live, outline } = page, { plan, controls } = data.live;
  const MOST = 60; // controls shown at once

  // ---------------------------------------------------------------- tracks: what curves are made of (live/tracks.py)

  const known = (act) => (...values) => (values.some(Number.isNaN) ? NaN : Number(act(...values)));
  const where = (is, a, b) => (Number.isNaN(is) ? NaN : is !== 0 ? a : b);
  const OPERATIONS = {
    "+": (a, b) => a + b, "-": (a, b) => a - b, "*": (a, b) => a * b, "/": (a, b) => a / b, "**": (a, b) => a ** b,
    negative: (a) => -a, positive: (a) => a, if: where, where,
    "<": known((a, b) => a < b), "<=": known((a, b) => a <= b), ">": known((a, b) => a > b), ">=": known((a, b) => a >= b),
    "==": known((a, b) => a === b), "!=": known((a, b) => a !== b), not: known((a) => a === 0),
    and: known((...all) => all.every((a) => a !== 0)), or: known((...all) => all.some((a) => a !== 0)),
    abs: Math.abs, sign: Math.sign, floor: Math.floor, sqrt: Math.sqrt, exp: Math.exp, log: Math.log, sin: Math.sin,
    cos: Math.cos, tan: Math.tan, tanh: Math.tanh, minimum: Math.min, maximum: Math.max,
    clip: (x, low, high) => Math.min(Math.max(x, low), high),
  };
  const compiled = (track, times, values) => { // a function of the number of the point
    if (!Array.isArray(track)) { const number = Number(track); return () => number; } // NaN comes as text
    const [what, ...rest] = track;
    if (what === "time") return (k) => times[k];
    if (what === "signal") { const signal = live.get(rest[0]); return (k) => signal[k]; }
    if (what === "parameter") { const value = values.get(rest[0]) ?? NaN; return () => value; }
    const act = OPERATIONS[what], parts = rest.map((part) => compiled(part, times, values));
    if (parts.length === 2) { const [a, b] = parts; return (k) => act(a(k), b(k)); }
    return (k) => act(...parts.map((part) => part(k)));
  };
  const isMade = (track) => Array.isArray(track) && (track[0] !== "signal" || live.has(track[1])) && (!(track[0] in OPERATIONS) || track.slice(1).every((part) => !Array.isArray(part) || isMade(part)));

  // ---------------------------------------------------------------- controls

  class Control {
    constructor(told, changed) {
      this.told = told; this.value = told.value; this.changed = changed;
    }
    get node() { // made when it is first shown
      return (this.made ??= this.draw());
    }
    draw() {
      const { name, unit, description, low, high, least, most, kind, fixed } = this.told, isWhole = kind === "Integer";
      const label = make("span", { class: "what" }, make("b", {}, name), unit ? ` [${unit}]` : "", make("small", {}, `${description}${fixed ? " (fixed during a run)" : ""}`));
      this.back = make("button", { type: "button", "aria-label": `${name} as it was in the run`, title: "as it was in the run" }, "↺");
      this.back.addEventListener("click", () => this.set(this.told.value));
      if (kind === "Boolean") {
        this.box = make("input", { type: "checkbox", "aria-label": name });
        this.box.addEventListener("change", () => this.set(Number(this.box.checked)));
        this.parts = [this.box];
      } else {
        const step = isWhole ? "1" : "any";
        this.slider = make("input", { type: "range", min: String(low), max: String(high), step, "aria-label": unit ? `${name} in ${unit}` : name });
        this.number = make("input", { type: "number", step, "aria-label": `${name}, a number`, ...(least === null ? {} : { min: String(least) }), ...(most === null ? {} : { max: String(most) }) });
        const grid = isWhole ? 1 : 10 ** Math.floor(Math.log10((high - low) / 500));
        this.slider.addEventListener("input", () => this.set(Math.min(high, Math.max(low, Number((Math.round(Number(this.slider.value) / grid) * grid).toPrecision(12))))));
        this.number.addEventListener("change", () => (this.number.value !== "" && this.number.validity.valid ? this.set(Number(this.number.value)) : this.show()));
        this.parts = [this.slider, this.number];
      }
      const node = make("div", { class: "control" }, label, ...this.parts, this.back);
      this.show();
      return node;
    }
    set(value) {
      if (value === this.value) return this.show();
      this.value = value; this.show(); this.changed();
    }
    show() {
      if (!this.back) return;
      if (this.box) this.box.checked = this.value !== 0;
      else {
        if (Number(this.slider.value) !== this.value) this.slider.value = String(this.value);
        this.slider.setAttribute("aria-valuetext", digits(this.value));
        this.number.value = String(Number(this.value.toPrecision(10)));
      }
      this.back.disabled = this.value === this.told.value;
    }
    get given() {
      return this.value === this.told.value ? [] : this.told.targets.map(([instance, reference]) => [instance, this.told.kind, reference, this.value]);
    }
  }

  // ---------------------------------------------------------------- the simulation, and who follows it

  class Live {
    constructor(explorer, host) {
      this.explorer = explorer; this.host = host;
      this.controls = controls.map((told) => new Control(told, () => this.run()));
      const places = new Map(plan.signals.map((name, k) => [name, k]));
      this.names = data.signals.map((one) => one.name).filter((name) => places.has(name));
      this.wanted = this.names.map((name) => places.get(name));
      const beside = make("div", { class: "beside" }), followers = make("div"); // the controls stay in sight as long as what follows them
      host.before(beside);
      followers.append(document.getElementById("trains"), document.getElementById("signals"));
      beside.append(host, followers);
      this.bar();
      const add = explorer.add.bind(explorer);
      explorer.add = (...given) => { // what is drawn later follows too
        const panel = add(...given);
        panel.ready.then(() => this.follow(panel));
        return panel;
      };
    }
    bar() {
      this.search = make("input", { type: "search", placeholder: `find one of ${this.controls.length} parameters`, "aria-label": "find a parameter" });
      this.search.addEventListener("input", () => this.list());
      const reset = make("button", { type: "button" }, "all as in the run");
      reset.addEventListener("click", () => {
        for (const control of this.controls) { control.value = control.told.value; control.show(); }
        this.run();
      });
      this.said = make("output", { class: "said" });
      this.shown = make("div", { class: "controls" });
      this.host.append(make("p", {}, "The models of the run, compiled to WebAssembly, run in this page: change a parameter, and curves and trains follow. Pale curves, titles, marks, verdicts and tables are those of the recorded run."),
        make("div", { class: "steer", role: "group", "aria-label": "Parameters" }, make("div", { class: "bar" }, this.search, reset, this.said), this.shown));
      this.list();
    }
    list() { // those at first, those that were changed, those that are searched for
      const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
      const fits = ({ told }) => words.every((word) => `${told.name} ${told.description}`.toLowerCase().includes(word));
      const found = this.controls.filter((control) => (words.length ? fits(control) : control.told.first || control.value !== control.told.value));
      this.shown.replaceChildren(...found.slice(0, MOST).map((control) => control.node));
      if (found.length > MOST) this.shown.append(`and ${found.length - MOST} more: type on`);
      if (!found.length) this.shown.append("there is no such parameter");
    }
    async begin() {
      const modules = [];
      for (const node of document.querySelectorAll("script[data-module]")) modules.push(await page.inflated(node.textContent));
      const source = new Blob([document.getElementById("worker").textContent], { type: "text/javascript" });
      this.worker = new Worker(URL.createObjectURL(source));
      this.worker.addEventListener("message", ({ data: result }) => this.take(result));
      this.worker.addEventListener("error", (event) => this.tell(event.message, true));
      this.run({ plan, modules });
    }
    run(more = {}) { // now, or when the run under way has ended, with what is asked for then
      if (this.busy) { this.later = true; return; }
      this.busy = true; this.later = false;
      this.waiting = setTimeout(() => this.tell("computing …"), 300);
      this.worker.postMessage({ given: this.controls.flatMap((control) => control.given), wanted: this.wanted, ...more });
      this.asked = new Map(this.controls.flatMap((control) => control.told.parameters.map((name) => [name, control.value])));
    }
    async take({ columns, error, milliseconds }) {
      clearTimeout(this.waiting);
      this.values = this.asked; this.milliseconds = milliseconds;
      columns.forEach((column, k) => live.set(this.names[k], column));
      this.busy = false;
      if (this.later) this.run();
      const time = `${digits(plan.stop - plan.start)} s simulated in ${digits(Math.max(1, Math.round(milliseconds)))} ms`;
      this.tell(error || time, Boolean(error));
      if (columns.length) {
        for (const panel of this.explorer.panels) if (panel.outputs) this.follow(panel);
        for (const trains of this.explorer.trains) if (trains.space) await trains.take().then(() => trains.draw());
      }
      document.documentElement.dataset.live = String(1 + Number(document.documentElement.dataset.live ?? 0));
    }
    tell(words, isBroken = false) {
      this.said.textContent = words;
      this.said.classList.toggle("broken", isBroken);
    }
    keep(panel, line) { // what was recorded, as a pale curve
      const { figure } = panel, { x, y, colour, dash, right } = line, source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
      const glyph = figure.line({ field: "x" }, { field: "y" }, { source, line_color: colour, line_alpha: 0.35, line_width: 1.6, line_dash: dash, level: "underlay", ...(right ? { y_range_name: "right" } : {}) });
      const range = right ? figure.extra_y_ranges.right : figure.y_range;
      if (Array.isArray(range.renderers)) range.renderers = [...range.renderers, glyph];
      return { x, y, source };
    }
    pale(panel) {
      const { start, end } = panel.axis.range, pixels = Math.max(200, Math.round(panel.plot.clientWidth));
      for (const { recorded, steps, glyph } of panel.lines) if (recorded) {
        const seen = panel.told.over ? page.thinned(recorded.x, recorded.y, 4 * pixels) : outline(recorded.x, recorded.y, start, end, pixels, steps);
        recorded.source.data = glyph.visible ? seen : { x: [], y: [] };
      }
    }
    follow(panel) {
      if (!panel.isFollowing) { // its recorded curves are drawn when its others are
        const refresh = panel.refresh.bind(panel);
        panel.refresh = () => { const before = panel.drawn; refresh(); if (panel.drawn !== before) this.pale(panel); };
        panel.isFollowing = true;
      }
      if (!this.values) return;
      const [times] = this.explorer.times, all = new Map([...Object.entries(data.live.parameters), ...this.values]);
      const made = (track) => { const point = compiled(track, times, all); return Float64Array.from(times, (_, n) => point(n)); };
      panel.lines.forEach((line, k) => {
        const across = panel.told.over ? line.across : ["time"];
        if (!isMade(line.track) || !isMade(across)) { panel.outputs[k].parentElement.classList.add("recorded"); return; }
        line.recorded ??= this.keep(panel, line);
        line.x = panel.told.over ? made(across) : times; line.y = made(line.track);
      });
      panel.drawn = null;
      if (panel.seen) panel.follow();
    }
  }

  document.addEventListener("explore", ({ detail: explorer }) => new Live(explorer, document.getElementById("live")).begin());
})();
