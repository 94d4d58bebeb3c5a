"use strict";
// Curves that zoom together, tables that sort, and the beginning of it all.
(() => {
  const { data, COLOURS, DASHES, make, digits, column, timeOf, placeIn, outline, style, dark, still, shades } = page;

  // ---------------------------------------------------------------- the signals of a run

  class Explorer {
    constructor(runs, host, times) {
      this.runs = runs; this.host = host; this.times = times; this.panels = []; this.listeners = [];
      const ends = times.filter((time) => time.length);
      const first = Math.min(...ends.map((time) => time[0])), last = Math.max(...ends.map((time) => time[time.length - 1]));
      this.range = { start: first, end: last > first ? last : first + 1 }; // of all panels
      this.whole = [this.range.start, this.range.end];
      this.now = first;
      this.bar(); this.choose();
      this.body = make("div"); host.append(this.body);
    }
    look(start, end) {
      if (start === this.range.start && end === this.range.end) return;
      this.range = { start, end };
      for (const panel of this.panels) panel.figure?.x_range.setv(this.range);
      this.later();
    }
    later() {
      if (this.waiting) return;
      this.waiting = requestAnimationFrame(() => { this.waiting = 0; for (const panel of this.panels) panel.refresh(); });
    }
    zoom(factor, shift = 0) { // around the cursor, if it is seen, which stays where it is on the screen
      const { start, end } = this.range, [low, high] = this.whole;
      const centre = this.now >= start && this.now <= end ? this.now : (start + end) / 2;
      const size = Math.min((end - start) * factor, high - low);
      const wanted = centre - ((centre - start) / (end - start)) * size + shift * (end - start);
      const begin = Math.min(Math.max(wanted, low), high - size);
      this.look(begin, begin + size);
    }
    bar() {
      const buttons = [["+", "zoom in", () => this.zoom(0.5)], ["−", "zoom out", () => this.zoom(2)],
        ["◀", "earlier", () => this.zoom(1, -0.25)], ["▶", "later", () => this.zoom(1, 0.25)],
        ["all", "the whole time", () => this.look(...this.whole)]];
      const bar = make("div", { class: "bar", role: "group", "aria-label": "Time shown" });
      for (const [sign, label, act] of buttons) {
        const button = make("button", { type: "button", "aria-label": label, title: label }, sign);
        button.addEventListener("click", act); bar.append(button);
      }
      this.clock = make("output", { "aria-label": "time of the cursor" });
      bar.append("cursor at ", this.clock);
      bar.append(make("small", {}, "drag to move, Ctrl or Shift with the wheel to zoom; arrow keys move the cursor, + and − zoom"));
      this.host.append(bar);
      this.host.addEventListener("keydown", (event) => this.key(event));
    }
    key(event) {
      if (event.target.matches("input, select, summary, button") || event.ctrlKey || event.metaKey || event.altKey) return;
      const step = (this.range.end - this.range.start) / (event.shiftKey ? 20 : 200);
      const acts = { ArrowLeft: () => this.at(this.now - step), ArrowRight: () => this.at(this.now + step),
        "+": () => this.zoom(0.5), "-": () => this.zoom(2), Home: () => this.at(this.whole[0]), End: () => this.at(this.whole[1]),
        0: () => this.look(...this.whole) };
      if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
    }
    at(time, told = true) {
      this.now = Math.min(Math.max(time, this.whole[0]), this.whole[1]);
      this.clock.textContent = `${digits(this.now)} s`;
      for (const panel of this.panels) panel.read();
      if (told) for (const listener of this.listeners) listener(this.now);
    }
    choose() {
      const search = make("input", { type: "search", placeholder: "find a signal", "aria-label": "find a signal" });
      const list = make("div", { class: "chooser", role: "group", "aria-label": "Signals of the new panel", tabindex: "0" });
      const add = make("button", { type: "button" }, "new panel of the chosen");
      const fill = () => {
        const wanted = search.value.toLowerCase(), found = data.signals.filter((one) => one.name.toLowerCase().includes(wanted));
        list.replaceChildren(...found.slice(0, 400).map((one) => {
          const box = make("input", { type: "checkbox", value: one.name });
          box.checked = this.chosen.has(one.name);
          box.addEventListener("change", () => (box.checked ? this.chosen.add(one.name) : this.chosen.delete(one.name)));
          return make("label", {}, box, ` ${one.name}${one.unit ? ` [${one.unit}]` : ""}`);
        }));
        if (found.length > 400) list.append(`and ${found.length - 400} more: type to find them`);
      };
      this.chosen = new Set();
      search.addEventListener("input", fill);
      add.addEventListener("click", () => {
        if (this.chosen.size) this.show([...this.chosen]);
        this.chosen.clear(); fill();
      });
      const folded = make("details", {}, make("summary", {}, "Choose signals"), make("div", { class: "bar" }, search, add), list);
      folded.addEventListener("toggle", () => folded.open && !list.childElementCount && fill());
      this.host.append(folded);
    }
    show(names, top = true) {
      const known = new Map(data.signals.map((one) => [one.name, one])), several = this.runs.length > 1;
      const lines = names.filter((name) => known.has(name)).flatMap((name, k) => {
        const one = known.get(name);
        return one.columns.map((place, run) => ({ label: several ? `${this.runs[run].name}: ${name}` : name, run, column: place,
          unit: one.unit, steps: one.steps, look: several ? [run, k] : [k, Math.floor(k / COLOURS.length)] })).filter((line) => line.column !== null);
      });
      const units = new Set(lines.map((line) => line.unit));
      return this.add({ title: names.join(", "), label: units.size === 1 && lines[0].unit ? `[${lines[0].unit}]` : "", lines }, top);
    }
    add(told, top = false) {
      const panel = new Panel(this, told);
      if (top) { this.panels.unshift(panel); this.body.prepend(panel.node); panel.node.focus(); } else { this.panels.push(panel); this.body.append(panel.node); }
      panel.ready = panel.draw();
      return panel;
    }
  }

  class Panel {
    constructor(explorer, told) {
      this.explorer = explorer; this.told = told; this.hidden = new Set(); this.marks = [];
      this.plot = make("div", { class: "plot" });
      this.legend = make("ul", { class: "legend" });
      const close = make("button", { type: "button", "aria-label": `close the panel ${told.title}` }, "close");
      close.addEventListener("click", () => { explorer.panels = explorer.panels.filter((one) => one !== this); this.node.remove(); });
      this.node = make("section", { class: "panel", tabindex: "0", "aria-label": told.title },
        make("div", { class: "bar" }, make("h3", { style: "flex:1" }, told.title), close), this.plot, this.legend);
    }
    async draw() {
      const { told, explorer } = this;
      const label = /^\$\$|\\\(|\\\[/.test(told.label) ? "" : told.label; // what the library would take for mathematics
      const range = new Bokeh.Range1d(explorer.range);
      range.change.connect(() => explorer.look(range.start, range.end));
      const figure = Bokeh.Plotting.figure({ x_range: range, height: 240, sizing_mode: "stretch_width", tools: "xpan", toolbar_location: null, output_backend: "webgl", lod_threshold: null, min_border_left: 62, y_axis_label: label || null, x_axis_label: "time [s]" });
      this.figure = figure; shades(figure);
      for (const band of explorer.runs.flatMap((run) => run.bands)) figure.add_layout(new Bokeh.BoxAnnotation({ left: band.from, right: band.until, fill_color: "#D55E00", fill_alpha: 0.12, line_color: null, level: "underlay" }));
      this.cursor = new Bokeh.Span({ dimension: "height", location: explorer.now, line_color: "#888888", line_width: 1 });
      figure.add_layout(this.cursor);
      this.lines = await Promise.all(told.lines.map(async (line) => {
        const y = await column(line.column), x = line.x === undefined ? explorer.times[line.run] : await column(line.x);
        const source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
        const colour = COLOURS[line.look[0] % COLOURS.length], dash = DASHES[line.look[1] % DASHES.length];
        const glyph = figure.line({ field: "x" }, { field: "y" }, { source, line_color: colour, line_width: 1.6, line_dash: dash });
        return { ...line, x, y, source, glyph, colour, dash };
      }));
      this.list(); this.refresh();
      this.view = await Bokeh.Plotting.show(figure, this.plot);
      this.plot.addEventListener("pointermove", (event) => this.point(event));
      this.plot.addEventListener("wheel", (event) => { // alone it scrolls the page
        if (!event.ctrlKey && !event.shiftKey) return;
        event.preventDefault(); this.point(event); explorer.zoom((event.deltaY || event.deltaX) < 0 ? 0.8 : 1.25);
      }, { passive: false });
    }
    point(event) {
      const frame = this.figure.inner_width, box = this.plot.getBoundingClientRect();
      if (!frame) return;
      const left = box.width - frame - (this.right ?? 0), share = (event.clientX - box.left - this.left(left)) / frame;
      if (share >= 0 && share <= 1) this.explorer.at(this.explorer.range.start + share * (this.explorer.range.end - this.explorer.range.start));
    }
    left(guess) { // where the frame of the drawing begins
      const view = this.view?.frame?.bbox ?? this.view?.frame_view?.bbox;
      return view ? view.left : guess;
    }
    list() {
      this.outputs = this.lines.map((line, k) => {
        const swatch = document.createElementNS("http://www.w3.org/2000/svg", "svg");
        swatch.setAttribute("viewBox", "0 0 26 10"); swatch.setAttribute("aria-hidden", "true");
        const stroke = document.createElementNS("http://www.w3.org/2000/svg", "path");
        stroke.setAttribute("d", "M0 5H26"); stroke.setAttribute("stroke", line.colour); stroke.setAttribute("stroke-width", "3"); stroke.setAttribute("stroke-dasharray", line.dash.join(" "));
        swatch.append(stroke);
        const shown = make("button", { type: "button", "aria-pressed": "true", "aria-label": `show ${line.label}` }, "shown");
        shown.addEventListener("click", () => {
          const off = !this.hidden.has(k); off ? this.hidden.add(k) : this.hidden.delete(k);
          shown.setAttribute("aria-pressed", String(!off)); shown.textContent = off ? "hidden" : "shown"; line.glyph.visible = !off;
        });
        const output = make("output");
        this.legend.append(make("li", {}, swatch, make("span", {}, line.label), output, shown));
        return output;
      });
      this.read();
    }
    read() {
      if (!this.lines) return;
      this.cursor.location = this.explorer.now;
      this.lines.forEach((line, k) => {
        const value = line.y[placeIn(line.x, this.explorer.now)], words = data.columns[line.column].words;
        this.outputs[k].textContent = words ? words[value] ?? "–" : `${digits(value)}${line.unit ? ` ${line.unit}` : ""}`;
      });
    }
    refresh() {
      if (!this.lines) return;
      const { start, end } = this.explorer.range, pixels = Math.max(200, Math.round(this.plot.clientWidth));
      for (const line of this.lines) line.source.data = outline(line.x, line.y, start, end, pixels, line.steps);
    }
    mark(time) {
      this.figure.add_layout(new Bokeh.Span({ dimension: "height", location: time, line_color: "#b3261e", line_width: 1.5, line_dash: [4, 3] }));
    }
  }

  // ---------------------------------------------------------------- tables

  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((cell, k) => {
      const button = make("button", { type: "button" }, cell.textContent);
      cell.replaceChildren(button);
      button.addEventListener("click", () => {
        const down = cell.getAttribute("aria-sort") === "ascending", body = table.tBodies[0];
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", down ? "descending" : "ascending");
        const key = (row) => row.cells[k].textContent, number = (text) => (text.trim() === "" ? NaN : Number(text));
        const rows = [...body.rows].sort((a, b) => {
          const [x, y] = [key(a), key(b)], [p, q] = [number(x), number(y)];
          return Number.isNaN(p) || Number.isNaN(q) ? x.localeCompare(y) : p - q;
        });
        body.append(...(down ? rows.reverse() : rows));
      });
    });
  }

  // ---------------------------------------------------------------- begin

  const begin = async () => {
    Bokeh.set_log_level?.("error");
    const runs = data.runs.filter((run) => run.points), host = document.getElementById("signals");
    const times = await Promise.all(data.runs.map(timeOf));
    if (!runs.length) host.append("No point was recorded.");
    else {
      const explorer = new Explorer(data.runs, host, times);
      for (const told of data.panels.slice(0, 12)) explorer.add(told);
      if (!data.panels.length) explorer.show(data.signals.slice(0, 6).map((one) => one.name), false);
      explorer.at(explorer.now);
      for (const button of document.querySelectorAll("[data-requirement]")) {
        const requirement = data.runs[Number(button.dataset.run)].requirements[Number(button.dataset.requirement)];
        button.addEventListener("click", async () => {
          const panel = explorer.show(requirement.signals);
          await panel.ready; panel.mark(requirement.time); explorer.at(requirement.time);
          panel.node.scrollIntoView({ behavior: still.matches ? "auto" : "smooth", block: "center" });
        });
      }
      dark.addEventListener("change", () => explorer.panels.forEach((panel) => panel.figure && shades(panel.figure)));
      const part = document.getElementById("trains");
      part.hidden = !runs.some((run) => run.trains.length);
      for (const [k, run] of data.runs.entries()) if (run.trains.length && run.points) {
        const own = make("div");
        if (runs.length > 1) own.append(make("h3", {}, run.name));
        part.append(own);
        await new Trains(k, own, explorer).load();
      }
    }
    document.documentElement.dataset.ready = "true";
  };
  begin();
})();
