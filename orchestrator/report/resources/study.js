"use strict";
// The page of a study or a search: a map of its runs, their distributions, and each of them by itself.
(() => {
  const { data, make, digits, column, style, dark, VERDICTS } = page, told = data.study;
  const LISTED = 100, BEGUN = 8; // runs of the list, axes at the beginning

  class Study {
    constructor() { this.count = told.count; this.selected = -1; this.ascending = true; this.requirement = told.requirement; }
    async load() {
      this.columns = await Promise.all(told.columns.map(async (one) => {
        const values = await column(one.column), words = data.columns[one.column].words;
        let low = Infinity, high = -Infinity;
        for (const value of values) { if (value < low) low = value; if (value > high && Number.isFinite(value)) high = value; }
        return { ...one, values, words, low: Number.isFinite(low) ? low : 0, high: high >= low ? high : 1, known: high >= low, limits: null };
      }));
      this.by = new Map(this.columns.map((one) => [one.name, one]));
      this.runs = this.by.get("run").values;
      const role = (name) => this.columns.filter((one) => one.role === name);
      this.varied = role("varied"); this.margins = role("margin"); this.metrics = role("metric"); this.verdicts = role("verdict");
      this.drawable = [...this.varied, ...this.margins, ...this.metrics];
      const telling = [...this.varied, ...[...this.margins, ...this.metrics].filter((one) => one.known && one.high > one.low && !one.words)];
      const tells = (one) => ["pass", "fail"].every((kind) => one.words?.includes(kind));
      this.requirement ||= this.verdicts.find(tells)?.label ?? "";
      this.chosen = telling.slice(0, Math.max(BEGUN, this.varied.length));
      this.sorted = this.margins[0] ?? this.by.get("run");
    }
    kind(row) { // how a run came out: the verdict looked at, or the worst of all
      const kinds = this.verdicts.filter((one) => !this.requirement || one.label === this.requirement).map((one) => one.words?.[one.values[row]] ?? "");
      return ["fail", "inconclusive", "pass"].find((kind) => kinds.includes(kind)) ?? "";
    }
    colour(kind) { return style(VERDICTS[kind] ?? "--soft"); }
    text(one, row) { return one.words ? one.words[one.values[row]] ?? "" : digits(one.values[row]); }
    sift() {
      const limited = this.columns.filter((one) => one.limits);
      this.keeps = new Uint8Array(this.count).fill(1);
      for (const { values, limits: [low, high] } of limited) for (let row = 0; row < this.count; row++) if (!(values[row] >= low && values[row] <= high)) this.keeps[row] = 0;
      this.kept = [...Array(this.count).keys()].filter((row) => this.keeps[row]);
    }
    limit(one, limits) { one.limits = limits; this.changed(); }
    changed() { this.sift(); for (const part of this.parts) part.draw(); }
    select(row, shows = false) {
      if (row < 0 || row >= this.count) return;
      this.selected = row;
      for (const part of this.parts) if (part.mark) part.mark(); else part.draw();
      this.detail.show(row, shows);
    }
    number(run) { return this.runs.indexOf(run); }
  }

  const choice = (label, options, value, act) => {
    const select = make("select", { "aria-label": label }, ...options.map(([key, text]) => make("option", { value: key }, text)));
    select.value = value; select.addEventListener("change", () => act(select.value));
    return make("label", {}, `${label} `, select);
  };
  const namesOf = (columns) => columns.map((one) => [one.name, one.role === "margin" ? `margin of ${one.label}` : one.label]);

  // ---------------------------------------------------------------- which runs, and which axes

  class Limits {
    constructor(host, study) {
      this.study = study; this.said = make("output", { "aria-label": "runs shown" });
      const all = make("button", { type: "button" }, "all runs");
      all.addEventListener("click", () => { for (const one of study.columns) one.limits = null; study.changed(); });
      const about = study.verdicts.length ? [choice("Colour by", [["", "all requirements"], ...study.verdicts.map((one) => [one.label, one.label])], study.requirement, (value) => { study.requirement = value; study.changed(); })] : [];
      const number = make("input", { type: "number", min: "0", "aria-label": "number of a run", placeholder: "run" });
      number.addEventListener("change", () => study.select(study.number(Number(number.value)), true));
      host.append(make("div", { class: "bar stays", role: "group", "aria-label": "Runs" }, ...about, this.said, all, make("label", {}, "show run ", number)));
      this.list = make("div", { class: "chooser" });
      host.append(make("details", {}, make("summary", {}, "Axes and limits"), make("p", { class: "hint" }, "What is ticked has an axis below. Runs outside a limit are left out everywhere."), this.list));
      for (const one of study.drawable) this.list.append(this.row(one));
    }
    row(one) {
      const { study } = this, box = make("input", { type: "checkbox" }), label = namesOf([one])[0][1];
      box.checked = study.chosen.includes(one);
      box.addEventListener("change", () => { study.chosen = study.drawable.filter((each) => (each === one ? box.checked : study.chosen.includes(each))); study.changed(); });
      one.ends = ["least", "greatest"].map((what, k) => {
        const input = make("input", { type: "number", step: "any", class: "end", "aria-label": `${what} ${label}`, placeholder: what });
        input.addEventListener("change", () => {
          const [low, high] = one.ends.map((each) => (each.value === "" ? NaN : Number(each.value)));
          study.limit(one, Number.isNaN(low) && Number.isNaN(high) ? null : [Number.isNaN(low) ? -Infinity : low, Number.isNaN(high) ? Infinity : high]);
        });
        return input;
      });
      return make("div", { class: "limit" }, make("label", {}, box, ` ${label}`), ...(one.words ? [] : one.ends));
    }
    draw() {
      const { study } = this, counts = {};
      for (const row of study.kept) { const kind = study.kind(row) || "not judged"; counts[kind] = (counts[kind] ?? 0) + 1; }
      this.said.textContent = `${study.kept.length} of ${study.count} runs: ${Object.entries(counts).map(([kind, count]) => `${count} ${kind}`).join(", ")}`;
      for (const one of study.drawable) one.ends?.forEach((input, k) => { const end = one.limits?.[k]; input.value = Number.isFinite(end) ? String(Number(end.toPrecision(6))) : ""; });
    }
  }

  // ---------------------------------------------------------------- the map

  class Chart { // a drawing of the library's with an axis for each of two columns
    constructor(host, title, label) {
      this.plot = make("div", { class: "plot" }); this.bar = make("div", { class: "bar" }, make("h3", {}, title));
      this.node = make("section", { class: "panel", tabindex: "0", "aria-label": label }, this.bar, this.plot);
      host.append(this.node);
    }
    async figure(how) {
      const made = Bokeh.Plotting.figure({ height: 360, sizing_mode: "stretch_width", toolbar_location: null, lod_threshold: null, output_backend: "webgl", min_border_left: 62, ...how });
      return made;
    }
    words(axis, one) { // texts stand at their numbers
      if (!one.words) return;
      axis.ticker = new Bokeh.FixedTicker({ ticks: one.words.map((_, k) => k) });
      axis.major_label_overrides = new Map(one.words.map((word, k) => [k, /\$\$|\\\(|\\\[/.test(word) ? " " : word]));
    }
  }
  const inert = (text) => (/^\$\$|\\\(|\\\[/.test(text) ? "" : text) || null; // what the library would take for mathematics

  class Scatter extends Chart {
    constructor(host, study) {
      super(host, `Where it holds: ● pass, ✕ fail${told.best.length ? ", ◇ found" : ""}`, "map of the runs; arrow keys go from run to run");
      this.study = study;
      const all = [study.by.get("run"), ...study.drawable], known = told.axes.filter((name) => study.by.has(name));
      this.x = study.by.get(known[0]) ?? all[0]; this.y = study.by.get(known[1]) ?? all[1] ?? all[0];
      for (const way of ["x", "y"]) this.bar.append(choice(way === "x" ? "across" : "up", namesOf(all), this[way].name, (name) => { this[way] = study.by.get(name); this.fresh = true; this.draw(); }));
      this.tip = make("p", { class: "hint" }, "Click a point, or press an arrow key, to see its run below.");
      this.node.append(this.tip);
      this.plot.addEventListener("click", (event) => { const row = this.under(event); if (row >= 0) study.select(row); });
      this.plot.addEventListener("pointermove", (event) => { const row = this.under(event); if (row >= 0) this.tell(row); });
      this.node.addEventListener("keydown", (event) => {
        const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
        if (!way || event.target.matches("select, input")) return;
        event.preventDefault();
        const order = [...study.kept].sort((a, b) => this.x.values[a] - this.x.values[b]), now = order.indexOf(study.selected);
        study.select(order[Math.min(order.length - 1, Math.max(0, now < 0 ? 0 : now + way))]);
      });
      dark.addEventListener("change", () => { this.fresh = true; this.draw(); });
    }
    tell(row) { this.tip.textContent = `run ${this.study.runs[row]}: ${this.x.label} ${this.study.text(this.x, row)}, ${this.y.label} ${this.study.text(this.y, row)}${this.study.kind(row) ? `, ${this.study.kind(row)}` : ""}`; }
    async make() {
      const { study } = this, made = await this.figure({ tools: "pan,wheel_zoom,reset", x_axis_label: inert(this.x.label), y_axis_label: inert(this.y.label) });
      made.toolbar.active_scroll = null;
      this.words(made.below[0], this.x); this.words(made.left[0], this.y);
      this.sources = new Map();
      for (const [kind, marker, size] of [["", "circle", 5], ["inconclusive", "triangle", 6], ["pass", "circle", 6], ["fail", "x", 8], ["best", "diamond", 13], ["selected", "circle", 15]]) {
        const source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } }), ring = kind === "selected" || kind === "best", colour = ring ? style(kind === "best" ? "--accent" : "--ink") : study.colour(kind);
        made.scatter({ field: "x" }, { field: "y" }, { source, marker, size, line_color: colour, fill_color: ring ? null : colour, fill_alpha: 0.6, line_width: kind === "fail" || ring ? 2 : 0.5 });
        this.sources.set(kind, source);
      }
      page.shades(made); this.made = made;
      this.plot.replaceChildren();
      this.fill();
      this.view = await Bokeh.Plotting.show(made, this.plot);
    }
    draw() {
      if (!this.made || this.fresh) { this.fresh = false; this.ready = (this.ready ?? Promise.resolve()).then(() => this.make()); } else this.fill();
    }
    fill() {
      const points = new Map([...this.sources.keys()].map((kind) => [kind, { x: [], y: [] }]));
      for (const row of this.study.kept) { const own = points.get(this.study.kind(row)); own.x.push(this.x.values[row]); own.y.push(this.y.values[row]); }
      const best = new Set(told.best), own = points.get("best");
      for (const row of this.study.kept) if (best.has(this.study.runs[row])) { own.x.push(this.x.values[row]); own.y.push(this.y.values[row]); }
      for (const [kind, own] of points) if (kind !== "selected") this.sources.get(kind).data = own;
      this.mark();
    }
    mark() {
      const row = this.study.selected;
      if (this.sources) this.sources.get("selected").data = row < 0 ? { x: [], y: [] } : { x: [this.x.values[row]], y: [this.y.values[row]] };
      if (row >= 0) this.tell(row);
    }
    under(event) { // the run nearest to the pointer, within 12 pixels
      const frame = this.view?.frame, box = this.plot.getBoundingClientRect();
      if (!frame) return -1;
      const [px, py] = [event.clientX - box.left, event.clientY - box.top];
      let best = -1, least = 12 * 12;
      for (const row of this.study.kept) {
        const away = (frame.x_scale.compute(this.x.values[row]) - px) ** 2 + (frame.y_scale.compute(this.y.values[row]) - py) ** 2;
        if (away < least) { least = away; best = row; }
      }
      return best;
    }
  }

  // ---------------------------------------------------------------- distributions

  class Histogram extends Chart {
    constructor(host, study) {
      super(host, "How it is distributed, by verdict", "distribution over the runs");
      this.study = study; this.one = study.margins.find((one) => one.high > one.low) ?? study.metrics.find((one) => one.high > one.low) ?? study.drawable[0] ?? study.by.get("run");
      this.bar.append(choice("of", namesOf([...study.margins, ...study.metrics, ...study.varied]), this.one.name, (name) => { this.one = study.by.get(name); this.fresh = true; this.draw(); }));
      this.said = make("p", { class: "hint" }); this.node.append(this.said);
      dark.addEventListener("change", () => { this.fresh = true; this.draw(); });
    }
    draw() {
      if (!this.made || this.fresh) { this.fresh = false; this.ready = (this.ready ?? Promise.resolve()).then(() => this.make()); } else this.fill();
    }
    mark() {}
    async make() {
      const made = await this.figure({ tools: "", height: 240, x_axis_label: inert(this.one.label), y_axis_label: "runs" });
      this.words(made.below[0], this.one);
      this.sources = new Map(["", "inconclusive", "pass", "fail"].map((kind) => {
        const source = new Bokeh.ColumnDataSource({ data: { left: [], right: [], bottom: [], top: [] } });
        made.quad({ left: { field: "left" }, right: { field: "right" }, bottom: { field: "bottom" }, top: { field: "top" }, source, fill_color: this.study.colour(kind), fill_alpha: 0.65, line_color: style("--page") });
        return [kind, source];
      }));
      page.shades(made); this.made = made;
      this.plot.replaceChildren(); this.fill();
      await Bokeh.Plotting.show(made, this.plot);
    }
    fill() {
      const { one, study } = this, rows = study.kept.filter((row) => Number.isFinite(one.values[row]));
      let low = Infinity, high = -Infinity;
      for (const row of rows) { if (one.values[row] < low) low = one.values[row]; if (one.values[row] > high) high = one.values[row]; }
      const bins = one.words ? one.words.length : Math.max(1, Math.min(60, Math.ceil(2 * Math.cbrt(rows.length)))), width = one.words ? 1 : (high - low) / bins || 1;
      const first = one.words ? -0.5 : high > low ? low : low - 0.5, foot = new Array(bins).fill(0);
      for (const [kind, source] of this.sources) {
        const counts = new Array(bins).fill(0);
        for (const row of rows) if (study.kind(row) === kind) counts[Math.min(bins - 1, Math.max(0, Math.floor((one.values[row] - first) / width)))]++;
        const bottom = [...foot];
        counts.forEach((count, k) => (foot[k] += count));
        source.data = { left: counts.map((_, k) => first + k * width), right: counts.map((_, k) => first + (k + 1) * width), bottom, top: [...foot] };
      }
      const sorted = rows.map((row) => one.values[row]).sort((a, b) => a - b), at = (share) => digits(sorted[Math.floor(share * (sorted.length - 1))]);
      this.said.textContent = rows.length && !one.words ? `${rows.length} runs: least ${at(0)}, 5 % ${at(0.05)}, median ${at(0.5)}, 95 % ${at(0.95)}, greatest ${at(1)}` : `${rows.length} runs`;
    }
  }

  // ---------------------------------------------------------------- the list, and one run

  class List {
    constructor(host, study) {
      this.study = study; this.body = make("tbody"); this.said = make("caption");
      this.shown = [study.by.get("run"), study.by.get("status"), ...study.varied, ...study.verdicts, ...study.margins, ...study.metrics].slice(0, 24);
      this.heads = this.shown.map((one) => {
        const button = make("button", { type: "button" }, namesOf([one])[0][1]), cell = make("th", { scope: "col" }, button);
        button.addEventListener("click", () => { study.ascending = study.sorted === one ? !study.ascending : true; study.sorted = one; this.draw(); });
        return cell;
      });
      const list = make("table", {}, this.said, make("thead", {}, make("tr", {}, ...this.heads)), this.body);
      host.append(make("details", {}, make("summary", {}, "List of runs"), make("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "List of runs" }, list)));
    }
    mark() { for (const row of this.body.rows) row.toggleAttribute("data-shown", Number(row.dataset.row) === this.study.selected); }
    draw() {
      const { study } = this, one = study.sorted, sign = study.ascending ? 1 : -1;
      const key = (row) => (one.words ? study.text(one, row) : one.values[row]);
      const rows = [...study.kept].sort((a, b) => { const [p, q] = [key(a), key(b)]; return one.words ? sign * p.localeCompare(q) : Number.isNaN(p) || Number.isNaN(q) ? Number.isNaN(p) - Number.isNaN(q) : sign * (p - q); });
      this.heads.forEach((cell, k) => (this.shown[k] === one ? cell.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending") : cell.removeAttribute("aria-sort")));
      this.said.textContent = `${Math.min(LISTED, rows.length)} of ${rows.length} runs, by ${namesOf([one])[0][1]}`;
      this.body.replaceChildren(...rows.slice(0, LISTED).map((row) => make("tr", { "data-row": String(row) }, ...this.shown.map((each) => make("td", {}, each.role === "run" ? this.button(row) : study.text(each, row))))));
      this.mark();
    }
    button(row) {
      const button = make("button", { type: "button" }, String(this.study.runs[row]));
      button.addEventListener("click", () => this.study.select(row, true));
      return button;
    }
  }

  class Detail {
    constructor(host, study) {
      this.study = study; this.node = make("div", { tabindex: "-1", "aria-live": "polite" }, make("p", {}, "Choose a run: by a point of the map, a line, a number, or in the list."));
      this.curves = make("div"); host.append(this.node, this.curves);
    }
    async show(row, goes) {
      const { study } = this, run = study.runs[row], command = told.commands[row] ?? `${told.replay}${run}`, again = told.commands.length ? "run it" : "run it again, to the bit";
      const pairs = (title, columns) => (columns.length ? [make("h3", {}, title), make("dl", { class: "many" }, ...columns.map((one) => make("div", {}, make("dt", {}, one.label), make("dd", {}, study.text(one, row) || "–"))))] : []);
      const verdicts = study.verdicts.map((one) => { const kind = study.text(one, row); return make("li", {}, make("span", { class: kind === "pass" ? "holds" : kind === "fail" ? "broken" : "open" }, kind || "not judged"), ` ${one.label}`); });
      const error = told.errors[run] ? [make("p", { class: "broken" }, told.errors[run])] : [];
      this.node.replaceChildren(make("h3", {}, `Run ${run}: ${study.text(study.by.get("status"), row)}`), ...error, make("p", {}, `${again}: `, make("code", {}, command)), make("ul", { class: "told" }, ...verdicts),
        ...pairs("What it changes", study.varied), ...pairs("Margins", study.margins), ...pairs("Metrics", study.metrics.filter((one) => one.known)));
      if (goes) { this.node.scrollIntoView({ behavior: page.still.matches ? "auto" : "smooth", block: "start" }); this.node.focus({ preventScroll: true }); }
      await this.draw(run);
    }
    async draw(run) { // what was recorded of it over time
      const own = told.series.runs[run];
      this.curves.replaceChildren();
      if (!told.series.signals.length) return;
      if (!own) { this.curves.append(make("p", {}, "What was recorded of this run is in series.parquet: the page has no room for all.")); return; }
      const [time, ...columns] = own, times = await column(time);
      const explorer = new Explorer([{ name: `run ${run}`, bands: [], requirements: [], points: times.length }], this.curves, [times]);
      told.series.signals.forEach((name, k) => { if (columns[k] !== undefined) explorer.add({ title: name, label: "", lines: [{ label: name, run: 0, column: columns[k], unit: "", look: [k, 0] }], stays: true }); });
      explorer.at(explorer.now);
    }
  }

  const begin = async () => {
    Bokeh.set_log_level?.("error");
    const study = new Study(), host = document.getElementById("map");
    await study.load();
    if (!study.count) { host.append("There is no run."); return; }
    const limits = new Limits(host, study), scatter = new Scatter(host, study);
    host.append(make("h3", {}, "Each run a line across the axes"), make("p", { class: "hint" }, "Drag along an axis to keep the runs between; click it to let them all back, or a line to see its run."));
    const parallel = new Parallel(host, study), histogram = new Histogram(host, study), list = new List(host, study);
    study.parts = [limits, scatter, parallel, histogram, list];
    study.detail = new Detail(document.getElementById("run"), study);
    study.changed();
    for (const button of document.querySelectorAll("[data-number]")) button.addEventListener("click", () => study.select(study.number(Number(button.dataset.number)), true));
    await scatter.ready; await histogram.ready;
  };
  begin().then(() => { document.documentElement.dataset.ready = document.documentElement.dataset.whole = "true"; });
})();
