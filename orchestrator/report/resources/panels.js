"use strict";
// Panels of curves: those over time zoom together and share a cursor; the others have an axis of their own.
const { Explorer, Panel } = (() => {
  const { data, COLOURS, DASHES, VERDICTS, make, digits, column, placeIn, outline, shape, style, shades } = page;

  class Axis { // what is seen of one direction, between ends that it does not leave
    constructor(low, high, changed) {
      this.whole = [low, high > low ? high : low + 1]; this.changed = changed;
      this.range = { start: this.whole[0], end: this.whole[1] };
    }
    look(start, end) {
      if (start === this.range.start && end === this.range.end) return;
      this.range = { start, end };
      this.changed();
    }
    zoom(factor, shift = 0, around = NaN) { // around a place, if it is seen, which stays where it is on the screen
      const { start, end } = this.range, [low, high] = this.whole;
      const centre = around >= start && around <= end ? around : (start + end) / 2;
      const size = Math.min((end - start) * factor, high - low);
      const wanted = centre - ((centre - start) / (end - start)) * size + shift * (end - start);
      const begin = Math.min(Math.max(wanted, low), high - size);
      this.look(begin, begin + size);
    }
    all() { this.look(...this.whole); }
  }

  const buttonsOf = (axis, centre, what) => [["+", "zoom in", () => axis.zoom(0.5, 0, centre())], ["−", "zoom out", () => axis.zoom(2, 0, centre())],
    ["◀", "earlier", () => axis.zoom(1, -0.25)], ["▶", "later", () => axis.zoom(1, 0.25)], ["all", `the whole ${what}`, () => axis.all()]]
    .map(([sign, label, act]) => {
      const button = make("button", { type: "button", "aria-label": label, title: label }, sign);
      button.addEventListener("click", act);
      return button;
    });

  // ---------------------------------------------------------------- what all panels of a page share

  class Explorer {
    constructor(runs, host, times) {
      this.runs = runs; this.host = host; this.times = times; this.panels = []; this.listeners = []; this.trains = []; this.chosen = new Set();
      const ends = times.filter((time) => time.length);
      this.axis = new Axis(Math.min(...ends.map((time) => time[0])), Math.max(...ends.map((time) => time[time.length - 1])), () => this.moved());
      this.now = this.axis.whole[0];
      this.queue = Promise.resolve();
      this.watcher = new IntersectionObserver((seen) => { // a panel that nobody sees costs nothing
        for (const each of seen) { const panel = this.panels.find((one) => one.node === each.target); if (panel) { panel.seen = each.isIntersecting; if (panel.seen) panel.follow(); } }
      }, { rootMargin: "300px" });
      this.bar(); if (data.signals.length) this.choose();
      this.body = make("div"); host.append(this.body);
    }
    get range() { return this.axis.range; }
    moved() {
      this.later();
    }
    later() {
      if (this.waiting) return;
      this.waiting = requestAnimationFrame(() => { this.waiting = 0; for (const panel of this.panels) if (panel.seen) panel.follow(); });
    }
    bar() {
      const bar = make("div", { class: "bar stays", role: "group", "aria-label": "Time shown" }, ...buttonsOf(this.axis, () => this.now, "time"));
      this.clock = make("output", { "aria-label": "time of the cursor" });
      this.during = make("output", { class: "during", "aria-label": "what happens at the cursor" });
      bar.append("cursor at ", this.clock, this.during);
      this.host.append(bar, make("p", { class: "hint" }, "Drag to move, Ctrl or Shift with the wheel to zoom; arrow keys move the cursor, + and − zoom, 0 shows all."));
      this.host.addEventListener("keydown", (event) => this.key(event, this.axis));
    }
    key(event, axis) {
      if (event.defaultPrevented || event.target.matches("input, select, summary, button") || event.ctrlKey || event.metaKey || event.altKey) return;
      const step = (this.range.end - this.range.start) / (event.shiftKey ? 20 : 200), centre = axis === this.axis ? this.now : NaN;
      const acts = { ArrowLeft: () => this.at(this.now - step), ArrowRight: () => this.at(this.now + step),
        "+": () => axis.zoom(0.5, 0, centre), "-": () => axis.zoom(2, 0, centre), Home: () => this.at(this.axis.whole[0]), End: () => this.at(this.axis.whole[1]),
        0: () => axis.all() };
      if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
    }
    at(time) {
      this.now = Math.min(Math.max(time, this.axis.whole[0]), this.axis.whole[1]);
      this.clock.textContent = `${digits(this.now)} s`;
      const during = new Set(this.runs.flatMap((run) => run.bands).filter((band) => band.from <= this.now && this.now <= band.until).map((band) => band.label));
      this.during.textContent = [...during].slice(0, 4).join(", ");
      for (const panel of this.panels) if (panel.seen) panel.read();
      for (const listener of this.listeners) listener(this.now);
    }
    choose() {
      const search = make("input", { type: "search", placeholder: "find a signal", "aria-label": "find a signal" });
      const list = make("div", { class: "chooser", role: "group", "aria-label": "Signals of the new panel", tabindex: "0" });
      const add = make("button", { type: "button" }, "new panel of the chosen");
      const fill = () => {
        const words = search.value.toLowerCase().split(/\s+/), found = data.signals.filter((one) => words.every((word) => one.name.toLowerCase().includes(word)));
        list.replaceChildren(...found.slice(0, 400).map((one) => {
          const box = make("input", { type: "checkbox", value: one.name });
          box.checked = this.chosen.has(one.name);
          box.addEventListener("change", () => (box.checked ? this.chosen.add(one.name) : this.chosen.delete(one.name)));
          return make("label", {}, box, ` ${one.name}${one.unit ? ` [${one.unit}]` : ""}`);
        }));
        if (found.length > 400) list.append(`and ${found.length - 400} more: type to find them`);
      };
      search.addEventListener("input", fill);
      add.addEventListener("click", () => {
        if (this.chosen.size) this.show([...this.chosen]);
        this.chosen.clear(); fill();
      });
      const folded = make("details", {}, make("summary", {}, "Choose signals"), make("div", { class: "bar" }, search, add), list);
      folded.addEventListener("toggle", () => folded.open && !list.childElementCount && fill());
      this.host.append(folded);
    }
    lines(names, decided = []) { // of signals in all runs
      const known = new Map(data.signals.map((one) => [one.name, one])), several = this.runs.length > 1;
      return names.filter((name) => known.has(name)).flatMap((name, k) => {
        const one = known.get(name);
        return one.columns.map((place, run) => ({ label: several ? `${this.runs[run].name}: ${name}` : name, run, column: place, unit: one.unit, steps: one.steps, track: ["signal", name],
          decided: decided.filter((told) => told.run === run), look: several ? [run, k] : [k, Math.floor(k / COLOURS.length)] })).filter((line) => line.column !== null);
      });
    }
    show(names, top = true, decided = []) { // at most two units share a panel, one on each side
      const lines = this.lines(names, decided), units = [...new Set(lines.map((line) => line.unit))], made = [];
      for (let k = 0; k < units.length; k += 2) {
        const pair = units.slice(k, k + 2), own = lines.filter((line) => pair.includes(line.unit)), [label, right] = pair.map((unit) => (unit ? `[${unit}]` : ""));
        for (const line of own) line.right = pair.length > 1 && line.unit === pair[1];
        made.push(this.add({ title: units.length > 2 ? [...new Set(own.map((line) => line.label))].join(", ") : names.join(", "), label, right, lines: own }, top));
      }
      return made[0];
    }
    add(told, top = false, host = this.body) {
      const panel = new Panel(this, told);
      if (top) { this.panels.unshift(panel); host.prepend(panel.node); panel.node.focus(); } else { this.panels.push(panel); host.append(panel.node); }
      this.watcher.observe(panel.node);
      panel.ready = top ? panel.draw() : (this.queue = this.queue.then(() => panel.draw()));
      return panel;
    }
    drop(panel) { this.watcher.unobserve(panel.node); this.panels = this.panels.filter((one) => one !== panel); panel.node.remove(); }
    shade() { for (const panel of this.panels) if (panel.figure) shades(panel.figure); }
  }

  // ---------------------------------------------------------------- one panel

  class Panel {
    constructor(explorer, told) {
      this.explorer = explorer; this.told = told; this.axis = told.over ? null : explorer.axis;
      this.plot = make("div", { class: "plot" });
      this.legend = make("ul", { class: "legend" });
      this.head = make("div", { class: "bar" }, make("h3", {}, told.title));
      const close = make("button", { type: "button", "aria-label": `close the panel ${told.title}`, title: "close" }, "×");
      close.addEventListener("click", () => explorer.drop(this));
      if (!told.stays) this.head.append(close);
      this.node = make("section", { class: "panel", tabindex: "0", "aria-label": told.title }, this.head, this.plot, this.legend);
    }
    async draw() {
      const { told, explorer } = this;
      this.lines = await Promise.all(told.lines.map(async (line) => ({ ...line, y: await column(line.column),
        x: line.x === undefined ? explorer.times[line.run] : await column(line.x), colour: COLOURS[line.look[0] % COLOURS.length], dash: DASHES[line.look[1] % DASHES.length] })));
      if (!this.axis) this.own();
      const range = new Bokeh.Range1d(this.axis.range);
      range.change.connect(() => this.axis.look(range.start, range.end));
      const plain = (label) => (/^\$\$|\\\(|\\\[/.test(label ?? "") ? "" : label) || null; // what the library would take for mathematics
      const figure = Bokeh.Plotting.figure({ x_range: range, height: 240, sizing_mode: "stretch_width", tools: "xpan", toolbar_location: null, output_backend: "webgl", lod_threshold: null,
        min_border_left: 62, min_border_right: told.right === undefined ? 8 : 62, y_axis_label: plain(told.label), x_axis_label: told.over ? plain(told.x_label) : "time [s]",
        x_axis_type: told.x_log ? "log" : "linear", y_axis_type: told.y_log ? "log" : "linear" });
      this.figure = figure; this.glyphs = [[], []]; this.marked = [];
      if (told.right !== undefined) {
        figure.extra_y_ranges = { right: new Bokeh.DataRange1d({ only_visible: true }) };
        figure.add_layout(new Bokeh.LinearAxis({ y_range_name: "right", axis_label: plain(told.right) }), "right");
      }
      if (!told.over) this.happenings();
      this.levels(told);
      for (const line of this.lines) this.trace(line);
      figure.y_range = told.y_range ? new Bokeh.Range1d({ start: told.y_range[0], end: told.y_range[1] }) : new Bokeh.DataRange1d({ only_visible: true, renderers: this.glyphs[0] });
      if (told.right !== undefined) figure.extra_y_ranges.right.renderers = this.glyphs[1];
      this.cursors();
      for (const line of this.lines) for (const decided of line.decided ?? []) this.decide(line, decided);
      shades(figure); this.list(); this.refresh();
      this.view = await Bokeh.Plotting.show(figure, this.plot);
      this.plot.addEventListener("pointermove", (event) => this.point(event));
      this.plot.addEventListener("wheel", (event) => { // alone it scrolls the page
        if (!event.ctrlKey && !event.shiftKey) return;
        event.preventDefault(); this.axis.zoom((event.deltaY || event.deltaX) < 0 ? 0.8 : 1.25, 0, this.place(event));
      }, { passive: false });
    }
    own() { // an axis of its own: as wide as the curves, or as it was asked for
      let [low, high] = this.told.x_range ?? [Infinity, -Infinity];
      if (!this.told.x_range) for (const { x } of this.lines) for (const each of x) { if (each < low) low = each; if (each > high) high = each; }
      if (!(low <= high)) [low, high] = [0, 1];
      this.axis = new Axis(low, high, () => this.explorer.later());
      this.head.lastChild.before(...buttonsOf(this.axis, () => NaN, "curve"));
      this.node.addEventListener("keydown", (event) => this.explorer.key(event, this.axis));
    }
    trace(line) {
      line.source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
      const how = { source: line.source, line_color: line.colour, line_width: 1.6, line_dash: line.dash, ...(line.right ? { y_range_name: "right" } : {}) };
      line.glyph = this.figure.line({ field: "x" }, { field: "y" }, how);
      this.glyphs[line.right ? 1 : 0].push(line.glyph);
    }
    happenings() { // events, faults and outages as bands, or as lines where they take no time; and where a run broke
      const runs = this.explorer.runs, all = [...new Map(runs.flatMap((run) => run.bands).map((band) => [`${band.from} ${band.until}`, band])).values()];
      const strips = all.filter((band) => band.until > band.from), instants = all.filter((band) => !(band.until > band.from));
      const figure = this.figure, look = { line_color: "#D55E00", line_alpha: 0.6, line_dash: [2, 3], level: "underlay" };
      if (strips.length) figure.vstrip({ field: "a" }, { field: "b" }, { source: new Bokeh.ColumnDataSource({ data: { a: strips.map((band) => band.from), b: strips.map((band) => band.until) } }), fill_color: "#D55E00", fill_alpha: 0.12, line_color: null, level: "underlay" });
      if (instants.length) figure.vspan({ field: "a" }, { source: new Bokeh.ColumnDataSource({ data: { a: instants.map((band) => band.from) } }), ...look });
      for (const run of runs) if (run.broke !== null && run.broke !== undefined) figure.add_layout(new Bokeh.Span({ dimension: "height", location: run.broke, line_color: style("--broken"), line_width: 2 }));
    }
    levels(told) { // levels and marks that the scenario draws
      const figure = this.figure, dashed = { line_color: "#888888", line_dash: [6, 3], line_width: 1 };
      for (const ends of told.levels ?? []) {
        if (ends.length === 2) figure.add_layout(new Bokeh.BoxAnnotation({ bottom: Math.min(...ends), top: Math.max(...ends), fill_color: "#888888", fill_alpha: 0.1, line_color: null, level: "underlay" }));
        for (const level of ends) figure.add_layout(new Bokeh.Span({ dimension: "width", location: level, ...dashed }));
      }
      const purple = "#9a4fc0";
      for (const { x, y } of told.marks ?? []) {
        if (x !== null && y !== null) figure.scatter({ field: "x" }, { field: "y" }, { source: new Bokeh.ColumnDataSource({ data: { x: [x], y: [y] } }), marker: "circle", size: 9, line_color: purple, fill_color: null });
        else if (x !== null || y !== null) figure.add_layout(new Bokeh.Span({ dimension: x === null ? "width" : "height", location: x ?? y, line_color: purple, line_dash: [2, 3] }));
      }
    }
    cursors() { // a line across time; elsewhere a dot on each curve that is of a run
      if (!this.told.over) {
        this.cursor = new Bokeh.Span({ dimension: "height", location: this.explorer.now, line_color: "#888888", line_width: 1 });
        this.figure.add_layout(this.cursor);
      } else {
        this.dots = new Bokeh.ColumnDataSource({ data: { x: [], y: [], c: [] } });
        this.figure.scatter({ field: "x" }, { field: "y" }, { source: this.dots, marker: "circle", size: 8, fill_color: { field: "c" }, line_color: null });
      }
    }
    moment(line, time) { // the point of a curve at a time; none where it is of no time
      const times = this.explorer.times[line.run];
      return !this.told.over ? placeIn(line.x, time) : line.x.length === times.length ? placeIn(times, time) : -1;
    }
    decide(line, told) { // the instant that decided a requirement
      const k = this.moment(line, told.time);
      if (k < 0 || !Number.isFinite(line.y[k])) return;
      const how = { source: new Bokeh.ColumnDataSource({ data: { x: [this.told.over ? line.x[k] : told.time], y: [line.y[k]] } }), marker: { pass: "diamond", fail: "x" }[told.verdict] ?? "triangle", size: 12,
        line_color: style(VERDICTS[told.verdict] ?? "--open"), line_width: 2, fill_color: style(VERDICTS[told.verdict] ?? "--open"), fill_alpha: 0.5, ...(line.right ? { y_range_name: "right" } : {}) };
      line.marks = [...(line.marks ?? []), this.figure.scatter({ field: "x" }, { field: "y" }, how)];
      const margin = told.margin === null || told.margin === undefined ? "" : `, margin ${digits(told.margin)}`, who = this.explorer.runs.length > 1 ? `${this.explorer.runs[line.run].name}, ` : "", key = `${who}${told.name} ${told.time}`;
      if (!this.marked.some((one) => one.key === key)) this.marked.push({ key, time: told.time, verdict: told.verdict, words: `${who}${told.name}: ${told.verdict}${margin}, decided at ${digits(told.time)} s` });
    }
    place(event) { // where along the axis the pointer is
      const frame = this.figure.inner_width, box = this.plot.getBoundingClientRect(), view = this.view?.frame?.bbox ?? this.view?.frame_view?.bbox;
      if (!frame) return NaN;
      const share = (event.clientX - box.left - (view ? view.left : box.width - frame)) / frame, { start, end } = this.axis.range;
      return share < 0 || share > 1 ? NaN : this.told.x_log ? start * (end / start) ** share : start + share * (end - start);
    }
    point(event) {
      const place = this.place(event);
      if (Number.isNaN(place)) return;
      if (!this.told.over) return this.explorer.at(place);
      this.over = place; this.read();
    }
    list() {
      this.outputs = this.lines.map((line) => {
        const button = make("button", { type: "button", "aria-pressed": "true", title: "show or hide" }, shape(line.colour, line.dash), make("span", {}, line.label));
        button.addEventListener("click", () => {
          const shown = !line.glyph.visible;
          for (const glyph of [line.glyph, ...(line.marks ?? [])]) glyph.visible = shown;
          button.setAttribute("aria-pressed", String(shown));
        });
        const output = make("output");
        this.legend.append(make("li", {}, button, output));
        return output;
      });
      for (const one of this.marked) {
        const button = make("button", { type: "button", class: "decided" }, make("span", { class: one.verdict === "pass" ? "holds" : one.verdict === "fail" ? "broken" : "open", "aria-hidden": "true" }, { pass: "◆", fail: "✕" }[one.verdict] ?? "▲"), ` ${one.words}`);
        button.addEventListener("click", () => this.explorer.at(one.time));
        this.legend.append(make("li", {}, button));
      }
      for (const mark of this.told.marks ?? []) if (mark.label) this.legend.append(make("li", { class: "mark" }, `┈ ${mark.label}`));
      this.read();
    }
    read() {
      if (!this.outputs) return;
      const now = this.explorer.now, dots = { x: [], y: [], c: [] };
      if (this.cursor) this.cursor.location = now;
      this.lines.forEach((line, k) => {
        let at = this.moment(line, now);
        if (at < 0) at = this.over === undefined ? -1 : line.x.reduce((best, x, n) => (Math.abs(x - this.over) < Math.abs(line.x[best] - this.over) ? n : best), 0);
        const value = line.y[at], words = data.columns[line.column].words;
        if (this.dots && Number.isFinite(value)) { dots.x.push(line.x[at]); dots.y.push(value); dots.c.push(line.colour); }
        this.outputs[k].textContent = words ? words[value] ?? "–" : Number.isFinite(value) ? `${digits(value)}${line.unit ? ` ${line.unit}` : ""}` : "–";
      });
      if (this.dots) this.dots.data = dots;
    }
    follow() { // what has changed while nobody looked, too
      if (!this.outputs) return;
      this.figure.x_range.setv(this.axis.range); this.read(); this.refresh();
    }
    refresh() {
      if (!this.outputs || this.drawn === this.axis.range) return;
      this.drawn = this.axis.range;
      const { start, end } = this.axis.range, pixels = Math.max(200, Math.round(this.plot.clientWidth));
      for (const line of this.lines) line.source.data = this.told.over ? page.thinned(line.x, line.y, 4 * pixels) : outline(line.x, line.y, start, end, pixels, line.steps);
    }
  }
  return { Explorer, Panel };
})();
