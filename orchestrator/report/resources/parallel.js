"use strict";
// Parallel coordinates: each run a line across the axes; dragging along an axis picks the runs between.
const Parallel = (() => {
  const { digits, style, dark } = page;
  const MOST = 4000; // lines that are drawn
  const [LEFT, RIGHT, TOP, FOOT] = [30, 30, 56, 22];

  class Parallel {
    constructor(host, study) {
      this.study = study;
      this.canvas = page.make("canvas", { class: "line", role: "img" });
      host.append(this.canvas);
      this.canvas.addEventListener("pointerdown", (event) => this.begin(event));
      this.canvas.addEventListener("pointermove", (event) => this.move(event));
      this.canvas.addEventListener("pointerup", (event) => this.end(event));
      new ResizeObserver(() => this.draw()).observe(this.canvas);
      for (const change of [dark, matchMedia("print")]) change.addEventListener("change", () => this.draw());
    }
    get axes() { return this.study.chosen; }
    place(k) { return LEFT + (this.axes.length > 1 ? (k / (this.axes.length - 1)) * (this.width - LEFT - RIGHT) : 0); }
    height(one, value) { return this.tall - FOOT - ((value - one.low) / (one.high - one.low || 1)) * (this.tall - TOP - FOOT); }
    value(one, y) { return one.low + ((this.tall - FOOT - y) / (this.tall - TOP - FOOT)) * (one.high - one.low); }
    nearest(x) {
      let best = 0;
      this.axes.forEach((_, k) => { if (Math.abs(this.place(k) - x) < Math.abs(this.place(best) - x)) best = k; });
      return this.axes[best];
    }
    begin(event) {
      if (!this.axes.length) return;
      this.canvas.setPointerCapture(event.pointerId);
      this.drag = { one: this.nearest(event.offsetX), from: event.offsetY, until: event.offsetY, x: event.offsetX };
    }
    move(event) {
      if (!this.drag) return;
      this.drag.until = event.offsetY; this.draw();
    }
    end() {
      const drag = this.drag;
      this.drag = null;
      if (!drag) return;
      if (Math.abs(drag.until - drag.from) < 4) { // a click: the limits go, or the nearest run is shown
        if (drag.one.limits) this.study.limit(drag.one, null); else this.study.select(this.at(drag));
        return;
      }
      const ends = [this.value(drag.one, drag.from), this.value(drag.one, drag.until)].sort((a, b) => a - b);
      this.study.limit(drag.one, ends);
    }
    at(drag) { // the run whose line is nearest on that axis
      let best = -1, least = Infinity;
      for (const row of this.study.kept) {
        const away = Math.abs(this.height(drag.one, drag.one.values[row]) - drag.from);
        if (away < least) { least = away; best = row; }
      }
      return best;
    }
    lines(context, rows, colour, alpha, width = 1) {
      context.strokeStyle = colour; context.globalAlpha = alpha; context.lineWidth = width;
      for (const row of rows) {
        context.beginPath();
        let down = false;
        this.axes.forEach((one, k) => {
          const value = one.values[row];
          if (!Number.isFinite(value)) { down = false; return; }
          down ? context.lineTo(this.place(k), this.height(one, value)) : context.moveTo(this.place(k), this.height(one, value));
          down = true;
        });
        context.stroke();
      }
      context.globalAlpha = 1;
    }
    draw() {
      const ratio = devicePixelRatio || 1, { canvas, study } = this;
      this.width = canvas.clientWidth || 800; this.tall = 320;
      canvas.style.height = `${this.tall}px`; canvas.width = this.width * ratio; canvas.height = this.tall * ratio;
      const context = canvas.getContext("2d"); context.setTransform(ratio, 0, 0, ratio, 0, 0); context.font = "12px system-ui, sans-serif";
      context.fillStyle = style("--page"); context.fillRect(0, 0, this.width, this.tall);
      const every = Math.max(1, Math.ceil(study.kept.length / MOST)), drawn = study.kept.filter((_, k) => k % every === 0), alpha = Math.max(0.06, Math.min(0.8, 60 / Math.max(1, drawn.length)));
      if (study.kept.length < study.count) this.lines(context, [...Array(study.count).keys()].filter((row, k) => !study.keeps[row] && k % Math.ceil(study.count / 1000) === 0), style("--soft"), 0.05);
      for (const kind of ["", "inconclusive", "pass", "fail"]) this.lines(context, drawn.filter((row) => study.kind(row) === kind), study.colour(kind), kind === "fail" ? Math.max(alpha, 0.25) : alpha);
      if (study.selected >= 0) this.lines(context, [study.selected], style("--ink"), 1, 2.5);
      this.axes.forEach((one, k) => this.axis(context, one, k));
      canvas.setAttribute("aria-label", `parallel coordinates of ${study.kept.length} runs over ${this.axes.map((one) => one.label).join(", ")}`);
    }
    axis(context, one, k) {
      const x = this.place(k), share = this.axes.length > 1 ? k / (this.axes.length - 1) : 0;
      context.strokeStyle = style("--soft"); context.fillStyle = style("--ink"); context.lineWidth = 1;
      context.beginPath(); context.moveTo(x, TOP); context.lineTo(x, this.tall - FOOT); context.stroke();
      context.textAlign = share === 0 ? "left" : share === 1 ? "right" : "center";
      const room = (this.width - LEFT - RIGHT) / Math.max(1, this.axes.length - 1), most = Math.max(6, Math.floor(1.6 * room / 7)), name = one.label.length > most ? `${one.label.slice(0, most - 1)}…` : one.label;
      context.fillText(name, share === 0 ? x - 20 : share === 1 ? x + 20 : x, k % 2 ? 28 : 14); // in two rows: neighbours leave each other room
      context.fillStyle = style("--soft");
      const ends = one.words ? [one.words[one.high] ?? "", one.words[one.low] ?? ""] : [digits(one.high), digits(one.low)];
      context.fillText(ends[0], share === 0 ? x - 20 : share === 1 ? x + 20 : x, TOP - 8); context.fillText(ends[1], share === 0 ? x - 20 : share === 1 ? x + 20 : x, this.tall - 6);
      context.textAlign = "left";
      const limits = this.drag?.one === one ? [this.drag.from, this.drag.until] : one.limits?.map((value) => this.height(one, value));
      if (!limits) return;
      const [top, foot] = [Math.min(...limits), Math.max(...limits)];
      context.fillStyle = style("--accent"); context.globalAlpha = 0.25; context.fillRect(x - 8, top, 16, foot - top); context.globalAlpha = 1;
      context.strokeStyle = style("--accent"); context.strokeRect(x - 8, top, 16, foot - top);
    }
  }
  return Parallel;
})();
