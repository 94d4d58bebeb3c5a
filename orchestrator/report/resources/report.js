"use strict";
// The page of a run: curves that zoom together, trains on their line, tables that sort. All data is in the page.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7f7f7f", "#8c564b"];
  const DASHES = [[], [6, 3], [2, 2], [6, 2, 2, 2]];
  const make = (name, attributes = {}, ...children) => {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  };
  const digits = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(6))) : "–");

  // ---------------------------------------------------------------- columns

  const unpacked = new Map();
  const bytesOf = (text) => {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return bytes;
  };
  const unpack = async (place) => {
    const told = data.columns[place];
    const stream = new Blob([bytesOf(document.getElementById(`column-${place}`).textContent)]).stream();
    const bytes = new Uint8Array(await new Response(stream.pipeThrough(new DecompressionStream("deflate-raw"))).arrayBuffer());
    const n = told.points, whole = new Uint8Array(4 * n);
    for (let part = 0; part < 4; part++) for (let k = 0; k < n; k++) whole[4 * k + part] = bytes[part * n + k];
    const single = new Float32Array(whole.buffer), values = new Float64Array(n);
    for (let k = 0; k < n; k++) values[k] = single[k] + told.offset;
    return values;
  };
  const column = (place) => {
    if (!unpacked.has(place)) unpacked.set(place, unpack(place));
    return unpacked.get(place);
  };
  const timeOf = async (run) => {
    if (typeof run.time === "number") return column(run.time);
    const values = new Float64Array(run.points), { first, last } = run.time;
    for (let k = 0; k < run.points; k++) values[k] = run.points > 1 ? first + ((last - first) * k) / (run.points - 1) : first;
    return values;
  };
  const placeIn = (times, time) => { // the last point that is not later
    let low = 0, high = times.length - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (times[middle] <= time) low = middle; else high = middle - 1; }
    return low;
  };

  // What is seen of many points: of each pixel its least and its greatest.
  const outline = (x, y, from, until, pixels, steps) => {
    const first = Math.max(0, placeIn(x, from) - 1), last = Math.min(x.length - 1, placeIn(x, until) + 1);
    const count = last - first + 1, xs = [], ys = [];
    if (count <= 4 * pixels) {
      for (let k = first; k <= last; k++) {
        if (steps && k > first) { xs.push(x[k]); ys.push(y[k - 1]); }
        xs.push(x[k]); ys.push(y[k]);
      }
      return { x: xs, y: ys };
    }
    for (let piece = 0; piece < pixels; piece++) {
      const begin = first + Math.floor((count * piece) / pixels), end = first + Math.floor((count * (piece + 1)) / pixels);
      let least = begin, greatest = begin, gap = false;
      for (let k = begin; k < end; k++) { // what compares with a hole is false
        if (!(y[k] === y[k])) { gap = true; continue; }
        if (!(y[least] <= y[k])) least = k;
        if (!(y[greatest] >= y[k])) greatest = k;
      }
      const [a, b] = least < greatest ? [least, greatest] : [greatest, least];
      xs.push(x[a]); ys.push(y[a]);
      if (b !== a) { xs.push(x[b]); ys.push(y[b]); }
      if (gap) { xs.push(x[end - 1]); ys.push(NaN); }
    }
    return { x: xs, y: ys };
  };

  // ---------------------------------------------------------------- look

  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const shades = (plot) => {
    plot.background_fill_color = plot.border_fill_color = style("--page");
    plot.outline_line_color = style("--line");
    for (const axis of [...plot.xaxes ?? plot.below, ...plot.yaxes ?? plot.left]) {
      axis.axis_line_color = axis.major_tick_line_color = axis.minor_tick_line_color = style("--soft");
      axis.major_label_text_color = axis.axis_label_text_color = style("--ink");
    }
    for (const grid of plot.center) if ("grid_line_color" in grid) grid.grid_line_color = style("--line");
  };

  // ---------------------------------------------------------------- the signals of a run

  class Explorer {
    constructor(run, host, time) {
      this.run = run; this.host = host; this.time = time; this.panels = []; this.listeners = [];
      const first = time[0] ?? 0, last = time[time.length - 1] ?? 1;
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
    zoom(factor, shift = 0) {
      const { start, end } = this.range, width = (end - start) * factor;
      const middle = factor < 1 && this.now > start && this.now < end ? this.now : (start + end) / 2;
      const [low, high] = this.whole, size = Math.min(width, high - low);
      const begin = Math.min(Math.max(middle - size / 2 + shift * (end - start), low), high - size);
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
      bar.append(make("small", {}, "drag to move, wheel to zoom; arrow keys move the cursor, + and − zoom"));
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
        const wanted = search.value.toLowerCase(), found = this.run.signals.filter((one) => one.name.toLowerCase().includes(wanted));
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
      const known = new Map(this.run.signals.map((one) => [one.name, one]));
      const lines = names.filter((name) => known.has(name)).map((name, k) => {
        const one = known.get(name);
        return { label: name, column: one.column, unit: one.unit, steps: one.steps, colour: COLOURS[k % COLOURS.length] };
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
      const figure = Bokeh.Plotting.figure({ x_range: range, height: 240, sizing_mode: "stretch_width", tools: "xpan,xwheel_zoom",
        active_scroll: null, toolbar_location: null, output_backend: "webgl", lod_threshold: null, min_border_left: 62, y_axis_label: label || null, x_axis_label: "time [s]" });
      this.figure = figure; shades(figure);
      for (const band of explorer.run.bands) figure.add_layout(new Bokeh.BoxAnnotation({ left: band.from, right: band.until, fill_color: "#D55E00", fill_alpha: 0.12, line_color: null, level: "underlay" }));
      this.cursor = new Bokeh.Span({ dimension: "height", location: explorer.now, line_color: "#888888", line_width: 1 });
      figure.add_layout(this.cursor);
      this.lines = await Promise.all(told.lines.map(async (line, k) => {
        const y = await column(line.column), x = line.x === undefined ? explorer.time : await column(line.x);
        const source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
        const dash = DASHES[Math.floor(k / COLOURS.length) % DASHES.length];
        const glyph = figure.line({ field: "x" }, { field: "y" }, { source, line_color: line.colour, line_width: 1.6, line_dash: dash });
        return { ...line, x, y, source, glyph, dash };
      }));
      this.list(); this.refresh();
      this.view = await Bokeh.Plotting.show(figure, this.plot);
      this.plot.addEventListener("pointermove", (event) => this.point(event));
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

  // ---------------------------------------------------------------- trains on the line

  class Trains {
    constructor(run, host, explorer, time) {
      this.run = run; this.explorer = explorer; this.time = time; this.speed = 10; this.followed = -1;
      this.canvas = make("canvas", { class: "line", role: "img", tabindex: "0" });
      this.play = make("button", { type: "button" }, "play");
      this.slider = make("input", { type: "range", min: "0", max: "1000", value: "0", "aria-label": "time" });
      const rates = make("select", { "aria-label": "how fast" });
      for (const rate of [1, 5, 10, 30, 100]) rates.append(make("option", { value: String(rate) }, `${rate} ×`));
      rates.value = "10"; rates.addEventListener("change", () => (this.speed = Number(rates.value)));
      const follow = make("select", { "aria-label": "follow" }, make("option", { value: "-1" }, "all trains"));
      run.trains.forEach((train, k) => follow.append(make("option", { value: String(k) }, `follow ${train.name}`)));
      follow.addEventListener("change", () => { this.followed = Number(follow.value); this.draw(); });
      this.play.addEventListener("click", () => this.toggle());
      this.slider.addEventListener("input", () => this.explorer.at(this.first + (this.slider.value / 1000) * (this.last - this.first)));
      this.words = make("p", { "aria-live": "off" });
      this.space = make("canvas", { class: "line", role: "img", "aria-label": "time and space: position of each train over time" });
      host.append(make("div", { class: "bar", role: "group", "aria-label": "Animation" }, this.play, rates, follow, this.slider), this.canvas, this.words, this.space);
      this.first = time[0]; this.last = time[time.length - 1];
      explorer.listeners.push(() => this.draw());
      new ResizeObserver(() => { this.ground(); this.draw(); }).observe(this.canvas);
      dark.addEventListener("change", () => { this.ground(); this.draw(); });
    }
    async load() {
      const places = new Map(this.run.signals.map((one) => [one.name, one.column]));
      const get = (name) => (places.has(name) ? column(places.get(name)) : null);
      this.trains = await Promise.all(this.run.trains.map(async (train, k) => ({
        ...train, colour: COLOURS[k % COLOURS.length], x: await get(train.position), v: await get(train.speed),
        rear: train.tail ? await get(train.tail) : null, ceiling: await Promise.all(train.limits.map(get)) })));
      let low = Infinity, high = -Infinity, fastest = 1;
      for (const train of this.trains) for (let k = 0; k < train.x.length; k++) {
        if (train.x[k] < low) low = train.x[k];
        if (train.x[k] > high) high = train.x[k];
        if (train.v[k] > fastest) fastest = train.v[k];
      }
      this.low = low - 0.02 * (high - low) - 1; this.high = high + 0.02 * (high - low) + 1; this.fastest = fastest;
      this.ground(); this.draw();
    }
    toggle() {
      this.playing = !this.playing;
      this.play.textContent = this.playing ? "pause" : "play";
      if (!this.playing) return;
      if (this.explorer.now >= this.last) this.explorer.at(this.first);
      let before = performance.now();
      const step = (now) => {
        if (!this.playing) return;
        this.explorer.at(this.explorer.now + ((now - before) / 1000) * this.speed); before = now;
        if (this.explorer.now >= this.last) { this.playing = false; this.play.textContent = "play"; return; }
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
    fit(canvas, height) {
      const ratio = devicePixelRatio || 1, width = canvas.clientWidth || 600;
      canvas.style.height = `${height}px`; canvas.width = width * ratio; canvas.height = height * ratio;
      const context = canvas.getContext("2d", { willReadFrequently: canvas === this.space }); context.setTransform(ratio, 0, 0, ratio, 0, 0); context.font = "12px system-ui, sans-serif";
      return [context, width];
    }
    ground() { // the time-space diagram, which does not change with the cursor
      if (!this.trains) return;
      const height = 220, [context, width] = this.fit(this.space, height);
      context.fillStyle = style("--page"); context.fillRect(0, 0, width, height);
      for (const train of this.trains) {
        context.strokeStyle = train.colour; context.lineWidth = 1.4; context.beginPath();
        const every = Math.max(1, Math.floor(train.x.length / (2 * width)));
        for (let k = 0; k < train.x.length; k += every) {
          const px = 60 + ((this.time[k] - this.first) / (this.last - this.first || 1)) * (width - 70), py = height - 24 - ((train.x[k] - this.low) / (this.high - this.low)) * (height - 34);
          k ? context.lineTo(px, py) : context.moveTo(px, py);
        }
        context.stroke();
      }
      context.fillStyle = style("--soft");
      context.fillText(`${digits(this.first)} s`, 60, height - 8); context.textAlign = "right"; context.fillText(`${digits(this.last)} s`, width - 10, height - 8);
      context.fillText(`${digits(Math.round(this.high))} m`, 56, 16); context.fillText(`${digits(Math.round(this.low))} m`, 56, height - 26); context.textAlign = "left";
      this.kept = context.getImageData(0, 0, this.space.width, this.space.height);
    }
    draw() {
      if (!this.trains) return;
      const rows = this.trains.length, lane = rows > 12 ? 16 : 30, height = 50 + lane * rows, [context, width] = this.fit(this.canvas, height);
      const k = placeIn(this.time, this.explorer.now), followed = this.trains[this.followed];
      let low = this.low, high = this.high;
      if (followed) { const half = Math.max(600, 0.03 * (high - low)); low = followed.x[k] - half; high = followed.x[k] + half; }
      const at = (x) => 10 + ((x - low) / (high - low)) * (width - 20);
      context.fillStyle = style("--page"); context.fillRect(0, 0, width, height);
      context.strokeStyle = style("--line"); context.fillStyle = style("--soft");
      const unit = 10 ** Math.floor(Math.log10((high - low) / 4));
      for (let x = Math.ceil(low / unit) * unit; x <= high; x += unit) {
        context.beginPath(); context.moveTo(at(x), 0); context.lineTo(at(x), height - 20); context.stroke();
        if (Math.round(x / unit) % Math.ceil(80 / ((unit / (high - low)) * width)) === 0) context.fillText(x >= 10000 ? `${digits(x / 1000)} km` : `${digits(x)} m`, at(x) + 3, height - 6);
      }
      const said = [];
      this.trains.forEach((train, row) => {
        const y = 12 + row * lane, front = at(train.x[k]), length = train.rear ? train.x[k] - train.rear[k] : train.length;
        const pixels = Math.max(9, (length / (high - low)) * (width - 20));
        context.strokeStyle = style("--line"); context.beginPath(); context.moveTo(0, y + lane * 0.62); context.lineTo(width, y + lane * 0.62); context.stroke();
        context.fillStyle = train.colour; context.beginPath(); context.roundRect(front - pixels, y + lane * 0.62 - lane * 0.42, pixels, lane * 0.36, [2, 5, 2, 2]); context.fill();
        const ceilings = train.ceiling.map((values) => values[k]).filter(Number.isFinite), ceiling = ceilings.length ? Math.min(...ceilings) : NaN;
        const label = `${train.name} ${digits(Math.round(train.v[k] * 36) / 10)} km/h${Number.isFinite(ceiling) ? ` of ${digits(Math.round(ceiling * 36) / 10)}` : ""}`;
        context.fillStyle = train.v[k] > ceiling + 1e-3 ? style("--broken") : style("--ink");
        const wide = context.measureText(label).width;
        context.fillText(label, Math.min(Math.max(front + 6, 4), width - wide - 4), y + lane * 0.5);
        said.push(`${train.name} at ${digits(Math.round(train.x[k]))} m, ${label.slice(train.name.length + 1)}`);
      });
      this.canvas.setAttribute("aria-label", `trains at ${digits(this.explorer.now)} s: ${said.join("; ")}`);
      this.words.textContent = `t = ${digits(this.explorer.now)} s. ${followed ? "" : this.trains.every((train) => !train.length && !train.rear) ? "These models have no length: trains are drawn as points." : "Trains are to scale, or 9 pixels."}`;
      this.slider.value = String(Math.round((1000 * (this.explorer.now - this.first)) / (this.last - this.first || 1)));
      if (this.kept) {
        const space = this.space.getContext("2d"), ratio = devicePixelRatio || 1, px = 60 + ((this.explorer.now - this.first) / (this.last - this.first || 1)) * (this.space.width / ratio - 70);
        space.putImageData(this.kept, 0, 0); space.strokeStyle = style("--ink"); space.lineWidth = 1; space.beginPath(); space.moveTo(px, 6); space.lineTo(px, 196); space.stroke();
      }
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
    for (const host of document.querySelectorAll(".signals")) {
      const run = data.runs[Number(host.dataset.run)];
      if (!run.points) { host.append("No point was recorded."); continue; }
      const time = await timeOf(run), explorer = new Explorer(run, host, time);
      const places = run.panels.length ? run.panels.slice(0, 12) : null;
      if (places) for (const told of places) explorer.add(told);
      else explorer.show(run.signals.slice(0, 6).map((one) => one.name), false);
      explorer.at(explorer.now);
      for (const button of document.querySelectorAll(`[data-run="${host.dataset.run}"][data-requirement]`)) {
        const requirement = run.requirements[Number(button.dataset.requirement)];
        button.addEventListener("click", async () => {
          const panel = explorer.show(requirement.signals);
          await panel.ready; panel.mark(requirement.time); explorer.at(requirement.time);
          panel.node.scrollIntoView({ behavior: still.matches ? "auto" : "smooth", block: "center" });
        });
      }
      dark.addEventListener("change", () => explorer.panels.forEach((panel) => panel.figure && shades(panel.figure)));
      if (run.trains.length) {
        const place = document.querySelector(`.trains[data-run="${host.dataset.run}"]`);
        place.parentElement.hidden = false;
        await new Trains(run, place, explorer, time).load();
      }
    }
    document.documentElement.dataset.ready = "true";
  };
  begin();
})();
