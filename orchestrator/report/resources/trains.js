"use strict";
// Trains on their line: where each is at the time of the cursor, over time, and how fast over place.
const Trains = (() => {
  const { COLOURS, make, digits, column, live, placeIn, style, dark } = page;
  const STILL = 1e-3, NO_LIMIT = 200; // m/s

  class Trains {
    constructor(place, host, explorer) {
      const run = explorer.runs[place], time = explorer.times[place];
      this.place = place; this.run = run; this.explorer = explorer; this.time = time; this.speed = 10; this.followed = -1;
      this.first = time[0]; this.last = time[time.length - 1];
      this.canvas = make("canvas", { class: "line", role: "img", tabindex: "0" });
      this.words = make("p", { "aria-live": "off" });
      this.places = make("canvas", { class: "line", role: "img", "aria-label": "speed of each train over its position, with its ceiling" });
      this.host = make("div");
      host.append(this.controls(), this.canvas, this.words, this.host, make("h3", {}, "Speed over position, from stop to stop; dashed: the ceiling"), this.places);
      explorer.listeners.push(() => this.draw());
      new ResizeObserver(() => this.draw()).observe(this.canvas);
      this.canvas.addEventListener("keydown", (event) => explorer.key(event, explorer.axis));
      for (const change of [dark, matchMedia("print")]) change.addEventListener("change", () => this.draw());
    }
    controls() {
      this.play = make("button", { type: "button" }, "play");
      this.slider = make("input", { type: "range", min: "0", max: "1000", value: "0", "aria-label": "time" });
      const rates = make("select", { "aria-label": "how fast" });
      for (const rate of [1, 5, 10, 30, 100]) rates.append(make("option", { value: String(rate) }, `${rate} ×`));
      rates.value = "10"; rates.addEventListener("change", () => (this.speed = Number(rates.value)));
      const follow = make("select", { "aria-label": "follow" }, make("option", { value: "-1" }, "all trains"));
      this.run.trains.forEach((train, k) => follow.append(make("option", { value: String(k) }, `follow ${train.name}`)));
      follow.addEventListener("change", () => { this.followed = Number(follow.value); this.draw(); });
      this.play.addEventListener("click", () => this.toggle());
      this.slider.addEventListener("input", () => this.explorer.at(this.first + (this.slider.value / 1000) * (this.last - this.first)));
      return make("div", { class: "bar", role: "group", "aria-label": "Animation" }, this.play, rates, follow, this.slider);
    }
    async take() { // where the trains are, as it is known now
      const places = new Map(page.data.signals.map((one) => [one.name, one.columns[this.place]]));
      const get = (name) => live.get(name) ?? (places.get(name) !== undefined ? column(places.get(name)) : null);
      this.trains = await Promise.all(this.run.trains.map(async (train, k) => ({
        ...train, colour: COLOURS[k % COLOURS.length], x: await get(train.position), v: await get(train.speed), rear: train.tail ? await get(train.tail) : null,
        ceiling: await Promise.all(train.limits.map(get)), allowed: train.strip ? await get(train.strip) : null })));
      let low = Infinity, high = -Infinity, fastest = 1;
      for (const train of this.trains) for (let k = 0; k < train.x.length; k++) {
        if (train.x[k] < low) low = train.x[k];
        if (train.x[k] > high) high = train.x[k];
        if (train.v[k] > fastest) fastest = train.v[k];
        for (const values of train.ceiling) if (values[k] < NO_LIMIT && values[k] > fastest) fastest = values[k];
      }
      this.low = low - 0.02 * (high - low) - 1; this.high = high + 0.02 * (high - low) + 1; this.fastest = fastest;
    }
    async load() {
      await this.take();
      const places = new Map(page.data.signals.map((one) => [one.name, one.columns[this.place]]));
      const lines = this.run.trains.map((train, k) => ({ label: train.name, run: this.place, column: places.get(train.position), unit: "m", track: ["signal", train.position], look: [k, Math.floor(k / COLOURS.length)] }));
      this.space = this.explorer.add({ title: "Position over time", label: "position [m]", lines, stays: true }, false, this.host);
      this.draw();
      await this.space.ready;
    }
    toggle() {
      const stop = () => { this.playing = false; this.play.textContent = "play"; };
      if (this.playing) return stop();
      this.playing = true; this.play.textContent = "pause";
      if (this.explorer.now >= this.last) this.explorer.at(this.first);
      let before = performance.now();
      const step = (now) => {
        if (!this.playing) return;
        this.explorer.at(this.explorer.now + (Math.max(0, now - before) / 1000) * this.speed); before = now;
        if (this.explorer.now >= this.last) stop(); else requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }
    fit(canvas, height) {
      const ratio = devicePixelRatio || 1, width = canvas.clientWidth || 600;
      canvas.style.height = `${height}px`; canvas.width = width * ratio; canvas.height = height * ratio;
      const context = canvas.getContext("2d"); context.setTransform(ratio, 0, 0, ratio, 0, 0); context.font = "12px system-ui, sans-serif";
      context.fillStyle = style("--page"); context.fillRect(0, 0, width, height);
      return [context, width];
    }
    stretch(train, k) { // from the stop before a point to the one after it; of a train that stands, where it goes next
      const count = train.v.length, moves = (n) => Math.abs(train.v[n]) > STILL;
      if (train.stretch && train.stretch[0] <= k && k <= train.stretch[1]) return train.stretch;
      let begin = k, end = k;
      while (end < count - 1 && !moves(end)) end++;
      if (moves(end) || begin === 0) while (end < count - 1 && moves(end + 1)) end++; else end = k;
      while (begin > 0 && !moves(begin - 1) && !moves(k)) begin--; // what came while it stood
      while (begin > 0 && moves(begin - 1)) begin--;
      if (!moves(k) && end > k) begin = k;
      return (train.stretch = [Math.max(0, begin - 1), end]);
    }
    slopes(context, at, low, high, foot, height) { // what rises is a burden, what falls a help
      const steps = this.run.gradients, steepest = Math.max(1e-9, ...steps.map((step) => Math.abs(step.gradient)));
      steps.forEach((step, k) => {
        const begin = at(Math.max(low, k ? step.from : -Infinity)), end = at(Math.min(high, steps[k + 1]?.from ?? Infinity));
        if (end <= begin) return;
        const tall = (height / 2) * (Math.abs(step.gradient) / steepest), middle = foot - height / 2;
        context.fillStyle = step.gradient > 0 ? "#D55E0099" : "#009E7399";
        context.fillRect(begin, step.gradient > 0 ? middle - tall : middle, end - begin, Math.max(1, tall));
        this.label(context, `${digits(Math.round(step.gradient * 1e4) / 10)} ‰`, begin, end, middle + (step.gradient > 0 ? 12 : -4));
      });
    }
    label(context, text, begin, end, foot) {
      if (end - begin < context.measureText(text).width + 6) return;
      context.fillStyle = style("--ink"); context.fillText(text, begin + 3, foot);
    }
    allowed(context, at, low, high, foot, train, k) { // the speed limit of the line along the way of a train
      const [first, last] = this.stretch(train, k), values = train.allowed;
      let begin = first;
      for (let n = first; n <= last; n++) {
        if (n < last && values[n + 1] === values[begin]) continue;
        const from = at(Math.max(low, train.x[begin])), until = at(Math.min(high, train.x[Math.min(n + 1, last)])), limit = values[begin];
        if (until > from && limit < NO_LIMIT) {
          context.fillStyle = style("--panel"); context.strokeStyle = style("--soft");
          context.fillRect(from, foot - 14, until - from, 14); context.strokeRect(from, foot - 14, until - from, 14);
          this.label(context, `${digits(Math.round(limit * 36) / 10)}`, from, until, foot - 3);
        }
        begin = n + 1;
      }
    }
    speeds(k) {
      const height = 200, [context, width] = this.fit(this.places, height), [low, high] = [this.low, this.high];
      const top = this.fastest * 3.6 * 1.08, foot = height - 24;
      const px = (x) => 60 + ((x - low) / (high - low)) * (width - 70), py = (v) => foot - ((v * 3.6) / top) * (foot - 8);
      context.fillStyle = style("--soft"); context.strokeStyle = style("--line");
      const unit = [5, 10, 20, 50, 100].find((step) => top / step <= 6) ?? 100;
      for (let v = 0; v <= top; v += unit) { context.beginPath(); context.moveTo(60, py(v / 3.6)); context.lineTo(width - 10, py(v / 3.6)); context.stroke(); context.fillText(`${v} km/h`, 4, py(v / 3.6) + 4); }
      context.fillText(`${digits(Math.round(low))} m`, 60, height - 6); context.textAlign = "right"; context.fillText(`${digits(Math.round(high))} m`, width - 10, height - 6); context.textAlign = "left";
      this.trains.forEach((train, row) => {
        if (this.followed >= 0 && row !== this.followed) return;
        const [begin, end] = this.stretch(train, k), every = Math.max(1, Math.floor((end - begin) / (2 * width)));
        const trace = (values) => {
          context.beginPath();
          let down = false;
          for (let n = begin; n <= end; n += every) {
            if (!Number.isFinite(values[n]) || values[n] >= NO_LIMIT) { down = false; continue; }
            down ? context.lineTo(px(train.x[n]), py(values[n])) : context.moveTo(px(train.x[n]), py(values[n])); down = true;
          }
          context.stroke();
        };
        context.strokeStyle = style("--broken"); context.setLineDash([4, 3]); context.lineWidth = 1; train.ceiling.forEach(trace);
        context.setLineDash([]); context.strokeStyle = train.colour; context.lineWidth = 1.5; trace(train.v);
        context.fillStyle = train.colour; context.beginPath(); context.arc(px(train.x[k]), py(train.v[k]), 4, 0, 7); context.fill();
      });
    }
    grid(context, at, low, high, width, height) {
      context.strokeStyle = style("--line"); context.fillStyle = style("--soft");
      const rough = (90 / (width - 20)) * (high - low), size = 10 ** Math.floor(Math.log10(rough)), unit = [1, 2, 5, 10].map((times) => times * size).find((each) => each >= rough);
      for (let x = Math.ceil(low / unit) * unit; x <= high; x += unit) {
        context.beginPath(); context.moveTo(at(x), 0); context.lineTo(at(x), height - 20); context.stroke();
        context.fillText(unit >= 1000 ? `${digits(x / 1000)} km` : `${digits(x)} m`, at(x) + 3, height - 6);
      }
    }
    draw() {
      if (!this.trains) return;
      const rows = this.trains.length, lane = rows > 12 ? 16 : 30, k = placeIn(this.time, this.explorer.now), followed = this.trains[this.followed];
      const led = followed ?? this.trains[0], slopes = this.run.gradients.length ? 44 : 0, limits = led.allowed ? 22 : 0;
      const height = 50 + lane * rows + slopes + limits, [context, width] = this.fit(this.canvas, height);
      let low = this.low, high = this.high;
      if (followed) { const half = Math.max(600, 0.03 * (high - low)); low = followed.x[k] - half; high = followed.x[k] + half; }
      const at = (x) => 10 + ((x - low) / (high - low)) * (width - 20);
      this.grid(context, at, low, high, width, height);
      if (slopes) this.slopes(context, at, low, high, height - 22, slopes - 8);
      if (limits) this.allowed(context, at, low, high, height - 24 - slopes, led, k);
      const said = this.trains.map((train, row) => this.train(context, at, width, 12 + row * lane, lane, train, k, (width - 20) / (high - low)));
      this.canvas.setAttribute("aria-label", `trains at ${digits(this.explorer.now)} s: ${said.join("; ")}`);
      this.words.textContent = `t = ${digits(this.explorer.now)} s. ${this.trains.every((train) => !train.length && !train.rear) ? "These models have no length: trains are drawn as points." : "Trains are to scale, or 9 pixels."}`
        + `${slopes ? " Below: gradients." : ""}${limits ? ` Boxes: speed limits along the way of ${led.name}, in km/h.` : ""}`;
      this.slider.value = String(Math.round((1000 * (this.explorer.now - this.first)) / (this.last - this.first || 1)));
      this.slider.setAttribute("aria-valuetext", `${digits(this.explorer.now)} s`);
      this.speeds(k);
    }
    train(context, at, width, y, lane, train, k, scale) { // one train in its lane; what is said of it
      const front = at(train.x[k]), length = train.rear ? train.x[k] - train.rear[k] : train.length, pixels = Math.max(9, length * scale), foot = y + lane * 0.62;
      context.strokeStyle = style("--line"); context.beginPath(); context.moveTo(0, foot); context.lineTo(width, foot); context.stroke();
      context.fillStyle = train.colour; context.beginPath(); context.roundRect(front - pixels, foot - lane * 0.42, pixels, lane * 0.36, [2, 5, 2, 2]); context.fill();
      const ceilings = train.ceiling.map((values) => values[k]).filter((value) => value < NO_LIMIT), ceiling = ceilings.length ? Math.min(...ceilings) : NaN;
      const speed = `${digits(Math.round(train.v[k] * 36) / 10)} km/h${Number.isFinite(ceiling) ? ` of ${digits(Math.round(ceiling * 36) / 10)}` : ""}`, label = `${train.name} ${speed}`;
      context.fillStyle = train.v[k] > ceiling + STILL ? style("--broken") : style("--ink");
      context.fillText(label, Math.min(Math.max(front + 6, 4), width - context.measureText(label).width - 4), y + lane * 0.5);
      return `${train.name} at ${digits(Math.round(train.x[k]))} m, ${speed}`;
    }
  }
  return Trains;
})();
