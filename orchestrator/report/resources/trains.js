"use strict";
// Trains on their line: where each is at the time of the cursor, and their speed over place.
const Trains = (() => {
  const { COLOURS, make, digits, column, timeOf, placeIn, style, dark } = page;
  class Trains {
    constructor(place, host, explorer) {
      const run = explorer.runs[place], time = explorer.times[place];
      this.place = place; this.run = run; this.explorer = explorer; this.time = time; this.speed = 10; this.followed = -1;
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
      this.place_speed = make("canvas", { class: "line", role: "img", "aria-label": "speed of each train over its position, with its ceiling" });
      host.append(make("div", { class: "bar", role: "group", "aria-label": "Animation" }, this.play, rates, follow, this.slider), this.canvas, this.words,
        make("h3", {}, "Position over time"), this.space, make("h3", {}, "Speed over position, from stop to stop; dashed: the ceiling"), this.place_speed);
      this.first = time[0]; this.last = time[time.length - 1];
      explorer.listeners.push(() => this.draw());
      new ResizeObserver(() => { this.ground(); this.draw(); }).observe(this.canvas);
      dark.addEventListener("change", () => { this.ground(); this.draw(); });
    }
    async load() {
      const places = new Map(page.data.signals.map((one) => [one.name, one.columns[this.place]]));
      const get = (name) => (places.get(name) !== undefined ? column(places.get(name)) : null);
      this.trains = await Promise.all(this.run.trains.map(async (train, k) => ({
        ...train, colour: COLOURS[k % COLOURS.length], x: await get(train.position), v: await get(train.speed),
        rear: train.tail ? await get(train.tail) : null, ceiling: await Promise.all(train.limits.map(get)) })));
      let low = Infinity, high = -Infinity, fastest = 1;
      for (const train of this.trains) for (let k = 0; k < train.x.length; k++) {
        if (train.x[k] < low) low = train.x[k];
        if (train.x[k] > high) high = train.x[k];
        if (train.v[k] > fastest) fastest = train.v[k];
        for (const values of train.ceiling) if (values[k] < 200 && values[k] > fastest) fastest = values[k];
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
    slopes(context, at, low, high, foot, height) { // what rises is a burden, what falls a help
      const steps = this.run.gradients, steepest = Math.max(1e-9, ...steps.map((step) => Math.abs(step.gradient)));
      steps.forEach((step, k) => {
        const begin = at(Math.max(low, k ? step.from : -Infinity)), end = at(Math.min(high, steps[k + 1]?.from ?? Infinity));
        if (end <= begin) return;
        const tall = (height / 2) * (Math.abs(step.gradient) / steepest);
        context.fillStyle = step.gradient > 0 ? "#D55E0099" : "#009E7399";
        context.fillRect(begin, step.gradient > 0 ? foot - height / 2 - tall : foot - height / 2, end - begin, Math.max(1, tall));
        const label = `${digits(Math.round(step.gradient * 1e4) / 10)} ‰`;
        if (end - begin > context.measureText(label).width + 6) { context.fillStyle = style("--ink"); context.fillText(label, begin + 3, foot); }
      });
    }
    speeds(k) {
      const height = 200, [context, width] = this.fit(this.place_speed, height), [low, high] = [this.low, this.high];
      const top = this.fastest * 3.6 * 1.08, foot = height - 24;
      const px = (x) => 60 + ((x - low) / (high - low)) * (width - 70), py = (v) => foot - ((v * 3.6) / top) * (foot - 8);
      context.fillStyle = style("--page"); context.fillRect(0, 0, width, height); context.fillStyle = style("--soft"); context.strokeStyle = style("--line");
      const unit = [5, 10, 20, 50, 100].find((step) => top / step <= 6) ?? 100;
      for (let v = 0; v <= top; v += unit) { context.beginPath(); context.moveTo(60, py(v / 3.6)); context.lineTo(width - 10, py(v / 3.6)); context.stroke(); context.fillText(`${v} km/h`, 4, py(v / 3.6) + 4); }
      context.fillText(`${digits(Math.round(low))} m`, 60, height - 6); context.textAlign = "right"; context.fillText(`${digits(Math.round(high))} m`, width - 10, height - 6); context.textAlign = "left";
      this.trains.forEach((train, row) => {
        if (this.followed >= 0 && row !== this.followed) return;
        let begin = k, end = k;
        while (begin > 0 && Math.abs(train.v[begin - 1]) > 1e-3) begin--;
        while (end < train.v.length - 1 && Math.abs(train.v[end + 1]) > 1e-3) end++;
        const every = Math.max(1, Math.floor((end - begin) / (2 * width)));
        const trace = (values) => { context.beginPath(); let down = false; for (let n = begin; n <= end; n += every) { if (!Number.isFinite(values[n])) { down = false; continue; } down ? context.lineTo(px(train.x[n]), py(values[n])) : context.moveTo(px(train.x[n]), py(values[n])); down = true; } context.stroke(); };
        context.strokeStyle = style("--broken"); context.setLineDash([4, 3]); context.lineWidth = 1; train.ceiling.forEach(trace);
        context.setLineDash([]); context.strokeStyle = train.colour; context.lineWidth = 1.5; trace(train.v);
        context.fillStyle = train.colour; context.beginPath(); context.arc(px(train.x[k]), py(train.v[k]), 4, 0, 7); context.fill();
      });
    }
    draw() {
      if (!this.trains) return;
      const rows = this.trains.length, lane = rows > 12 ? 16 : 30, slopes = this.run.gradients.length ? 34 : 0, height = 50 + lane * rows + slopes, [context, width] = this.fit(this.canvas, height);
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
      if (slopes) this.slopes(context, at, low, high, height - 22, slopes - 8);
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
      this.speeds(k);
      if (this.kept) {
        const space = this.space.getContext("2d"), ratio = devicePixelRatio || 1, px = 60 + ((this.explorer.now - this.first) / (this.last - this.first || 1)) * (this.space.width / ratio - 70);
        space.putImageData(this.kept, 0, 0); space.strokeStyle = style("--ink"); space.lineWidth = 1; space.beginPath(); space.moveTo(px, 6); space.lineTo(px, 196); space.stroke();
      }
    }
  }
  return Trains;
})();
