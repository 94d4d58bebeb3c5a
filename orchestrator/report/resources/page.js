"use strict";
// What all parts of the page stand on: its data, its colours, small helpers.
const page = (() => {
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

  return { data, COLOURS, DASHES, make, digits, column, timeOf, placeIn, outline, style, dark, still, shades };
})();
