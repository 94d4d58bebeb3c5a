"use strict";
// What all parts of the page stand on: its data, its colours, small helpers.
const page = (() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7f7f7f", "#8c564b"];
  const VERDICTS = { pass: "--holds", fail: "--broken", inconclusive: "--open" };
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
  const inflated = async (text) => {
    const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };
  const unpack = async (place) => {
    const told = data.columns[place], bytes = await inflated(document.getElementById(`column-${place}`).textContent);
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
  const live = new Map(); // signals as the live models of the page have computed them, by name
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

  // Of a curve that may go any way: of so many pieces the ends of both directions, in their order.
  const thinned = (x, y, most) => {
    if (x.length <= most) return { x, y };
    const xs = [], ys = [], pieces = Math.ceil(most / 4);
    for (let piece = 0; piece < pieces; piece++) {
      const begin = Math.floor((x.length * piece) / pieces), end = Math.floor((x.length * (piece + 1)) / pieces), kept = [begin, begin, begin, begin];
      let gap = false;
      for (let k = begin; k < end; k++) {
        if (!(y[k] === y[k] && x[k] === x[k])) { gap = true; continue; }
        if (!(x[kept[0]] <= x[k])) kept[0] = k;
        if (!(x[kept[1]] >= x[k])) kept[1] = k;
        if (!(y[kept[2]] <= y[k])) kept[2] = k;
        if (!(y[kept[3]] >= y[k])) kept[3] = k;
      }
      for (const k of [...new Set(kept)].sort((a, b) => a - b)) { xs.push(x[k]); ys.push(y[k]); }
      if (gap) { xs.push(x[end - 1]); ys.push(NaN); }
    }
    return { x: xs, y: ys };
  };

  // ---------------------------------------------------------------- look

  const shape = (colour, dash) => { // of a line, for a legend
    const drawn = document.createElementNS("http://www.w3.org/2000/svg", "svg"), stroke = document.createElementNS("http://www.w3.org/2000/svg", "path");
    for (const [key, value] of [["viewBox", "0 0 26 10"], ["aria-hidden", "true"]]) drawn.setAttribute(key, value);
    for (const [key, value] of [["d", "M0 5H26"], ["stroke", colour], ["stroke-width", "3"], ["stroke-dasharray", dash.join(" ")]]) stroke.setAttribute(key, value);
    drawn.append(stroke);
    return drawn;
  };

  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const shades = (plot) => {
    plot.background_fill_color = plot.border_fill_color = style("--page");
    plot.outline_line_color = style("--line");
    for (const axis of [...plot.below, ...plot.left, ...plot.right]) {
      axis.axis_line_color = axis.major_tick_line_color = axis.minor_tick_line_color = style("--soft");
      axis.major_label_text_color = axis.axis_label_text_color = style("--ink");
    }
    for (const grid of plot.center) if ("grid_line_color" in grid) grid.grid_line_color = style("--line");
  };

  return { data, COLOURS, DASHES, VERDICTS, make, digits, column, inflated, live, timeOf, placeIn, outline, thinned, shape, style, dark, still, shades };
})();
