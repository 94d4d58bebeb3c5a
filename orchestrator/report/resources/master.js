"use strict";
// The master of a live page: steps FMI 2.0 FMUs in WebAssembly by a plan that the program has written (live/plan.py).
// Its arithmetic, and the order of it, are those of the program's own loop: the numbers are the same but for libm.
const Master = (() => {
  const SET = 0, STEP = 1, GET = 2, CO_SIMULATION = 1, WARNING = 1, BAD_DESCRIPTOR = 8;
  const SWEEPS = 100, AGREE = 1e-12, SHRINKS = 0.8; // as in the program's initialization

  // One module: its functions and its memory. There are no files for it: whatever it asks for is refused.
  class Model {
    constructor(module) {
      const imports = {};
      for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => BAD_DESCRIPTOR;
      this.code = new WebAssembly.Instance(module, imports).exports;
      this.code._initialize();
      this.look();
    }
    look() { // anew, whenever its memory may have grown
      const { buffer } = this.code.memory;
      this.reals = new Float64Array(buffer); this.whole = new Int32Array(buffer); this.bytes = new Uint8Array(buffer);
    }
    room(size) {
      const place = this.code.malloc(Math.max(8, size));
      if (place === 0) throw new Error("there is no memory left");
      this.look();
      return place;
    }
    text(words) {
      const bytes = new TextEncoder().encode(`${words}\0`), place = this.room(bytes.length);
      this.bytes.set(bytes, place);
      return place;
    }
    read(place) {
      this.look();
      return new TextDecoder().decode(this.bytes.slice(place, this.bytes.indexOf(0, place)));
    }
  }

  // Some variables of one type of an instance: where their references and their values are in the memory of its model.
  class Channel {
    constructor(owner, { kind, references }) {
      const { model } = owner;
      this.owner = owner; this.model = model; this.component = owner.component;
      this.isReal = kind === "Real"; this.isTruth = kind === "Boolean"; this.count = references.length;
      this.references = model.room(4 * this.count);
      this.place = model.room(8 * this.count);
      this.first = this.isReal ? this.place / 8 : this.place / 4;
      model.whole.set(references, this.references / 4);
      this.setter = model.code[`fmi2Set${kind}`]; this.getter = model.code[`fmi2Get${kind}`];
    }
    values() { // the memory; that of a model that has grown is another
      if (this.model.reals.length === 0) this.model.look();
      return this.isReal ? this.model.reals : this.model.whole;
    }
    set(time) { const status = this.setter(this.component, this.references, this.count, this.place); if (status > WARNING) this.owner.fail("set", status, time); }
    get(time) { const status = this.getter(this.component, this.references, this.count, this.place); if (status > WARNING) this.owner.fail("get", status, time); }
    setAll(given, time) {
      this.values().set(given, this.first);
      this.set(time);
    }
  }

  // Inputs of one type of one instance, and where each value comes from.
  class Feed extends Channel {
    constructor(owner, told) {
      super(owner, told);
      const { sources, plain, scales, offsets, thresholds, ages } = told;
      Object.assign(this, { sources: Int32Array.from(sources), plain, scales, offsets, thresholds, ages });
    }
    write(master, time) {
      const into = this.values(), { values } = master, { sources, first } = this;
      if (this.plain) for (let k = 0; k < sources.length; k++) into[first + k] = values[sources[k]];
      else for (let k = 0; k < sources.length; k++) into[first + k] = this.value(master, k);
      this.set(time);
    }
    value(master, k) {
      const age = this.ages[k], scale = this.scales[k], offset = this.offsets[k], threshold = this.thresholds[k];
      let value = age === null ? master.values[this.sources[k]] : master.aged(age, this.sources[k]);
      if (scale !== 1 || offset !== 0) value = scale * value + offset;
      if (threshold === null) return value;
      return this.isTruth ? Number(value > threshold) : Math.ceil(value - threshold);
    }
  }

  // Outputs of one type of one instance, and where they go.
  class Yield extends Channel {
    constructor(owner, told) {
      super(owner, told);
      this.begin = told.begin; this.direct = told.direct;
    }
    read(values, time, mayBeAnything) {
      this.get(time);
      const from = this.values(), { first, begin, count } = this;
      if (this.isReal) {
        for (let k = 0; k < count; k++) {
          const value = from[first + k];
          if (!(value - value === 0) && !mayBeAnything) this.owner.fail("an output that is not finite; get", 0, time);
          values[begin + k] = value;
        }
      } else if (this.isTruth) for (let k = 0; k < count; k++) values[begin + k] = from[first + k] !== 0 ? 1 : 0;
      else for (let k = 0; k < count; k++) values[begin + k] = from[first + k];
    }
  }

  class Owner {
    constructor(told, model) {
      this.name = told.name; this.model = model;
      this.component = model.code.fmi2Instantiate(model.text(told.name), CO_SIMULATION, model.text(told.guid), model.text(""), 0, 0, 0);
      if (this.component === 0) throw new Error(`${told.name} cannot be instantiated`);
      this.starts = told.starts.map((start) => ({ channel: new Channel(this, start), values: start.values.map(Number) }));
      this.feeds = told.feeds.map((feed) => new Feed(this, feed));
      this.yields = told.yields.map((part) => new Yield(this, part));
      this.given = new Map(); // channels of single parameters
    }
    fail(what, status, time) {
      const said = this.model.read(this.model.code.railcosim_message(this.component));
      throw new Error(`${this.name}, t = ${time} s: ${said || `${what}: status ${status}`}`);
    }
    call(name, time, ...given) {
      const status = this.model.code[name](this.component, ...given);
      if (status > WARNING) this.fail(name, status, time);
    }
    give(kind, reference, value, time) {
      const key = `${kind} ${reference}`;
      if (!this.given.has(key)) this.given.set(key, new Channel(this, { kind, references: [reference] }));
      this.given.get(key).setAll([value], time);
    }
  }

  // Of the plan everything, and of the models one for each module, which all its instances share.
  class Master {
    constructor(plan, modules) {
      const models = modules.map((module) => new Model(module));
      this.plan = plan;
      this.owners = plan.instances.map((told) => new Owner(told, models[told.module]));
      this.sweep = plan.sweep.map((k) => this.owners[k]).filter((owner) => owner.feeds.length);
      this.values = new Float64Array(plan.signals.length);
      this.history = Array.from({ length: plan.depth }, () => new Float64Array(plan.signals.length));
      this.operations = plan.operations.flatMap(([kind, k, rate]) => {
        const owner = this.owners[k];
        if (kind === STEP) return [{ kind, rate, phase: 0, owner, step: owner.model.code.fmi2DoStep, component: owner.component }];
        // With a step of its own, direct outputs act at once, the others are of that step's end.
        return (kind === SET ? owner.feeds : owner.yields).map((channel) => ({ kind, rate, channel, phase: kind === GET && !channel.direct ? rate - 1 : 0 }));
      });
      this.points = 1 + Math.floor(plan.steps / plan.every) + (plan.steps % plan.every ? 1 : 0);
    }

    // Begin anew. `given` are [instance, kind, reference, value]; `wanted` the places of the values that are kept.
    begin(given, wanted) {
      const { start, stop } = this.plan;
      this.row = 0; this.kept = 0;
      this.wanted = Int32Array.from(wanted);
      this.columns = wanted.map(() => new Float64Array(this.points).fill(NaN));
      this.owners.forEach((owner, k) => {
        owner.call("fmi2Reset", start);
        owner.call("fmi2SetupExperiment", start, 0, 0, start, 1, stop);
        for (const { channel, values } of owner.starts) channel.setAll(values, start);
        for (const [instance, kind, reference, value] of given) if (instance === k) owner.give(kind, reference, value, start);
      });
      for (const owner of this.owners) owner.call("fmi2EnterInitializationMode", start);
      for (const owner of this.owners) for (const part of owner.yields) part.read(this.values, start, true);
      this.settle(start);
      for (const owner of this.owners) owner.call("fmi2ExitInitializationMode", start);
      for (const owner of this.owners) for (const part of owner.yields) part.read(this.values, start, false);
      this.remember();
      this.record();
    }
    settle(time) { // exchange until nothing changes
      const flushed = this.owners.length + 1;
      let last = Infinity;
      for (let count = 0; count < Math.max(SWEEPS, flushed); count++) {
        const before = this.values.slice();
        for (const owner of this.sweep) {
          for (const feed of owner.feeds) feed.write(this, time);
          for (const part of owner.yields) part.read(this.values, time, true);
        }
        let change = 0;
        before.forEach((a, k) => {
          const b = this.values[k];
          if (a !== b && !(Number.isNaN(a) && Number.isNaN(b))) change = Math.max(change, Number.isFinite(b - a) ? Math.abs(b - a) / Math.max(1, Math.abs(a), Math.abs(b)) : Infinity);
        });
        if (change <= AGREE) return;
        if (count >= flushed && !(change < SHRINKS * last)) break;
        last = change;
      }
      throw new Error("the initial values do not settle");
    }

    run() { // all steps
      const { start, step, steps, every } = this.plan;
      for (let k = 0; k < steps; k++) {
        this.take(k, start + k * step, step);
        this.remember();
        if ((k + 1) % every === 0 || k + 1 === steps) this.record();
      }
    }
    take(number, time, length) {
      for (const it of this.operations) {
        if (it.rate !== 1 && number % it.rate !== it.phase) continue;
        if (it.kind === SET) it.channel.write(this, time);
        else if (it.kind === GET) it.channel.read(this.values, time + length, false);
        else {
          const status = it.step(it.component, time, it.rate * length, 1);
          if (status > WARNING) it.owner.fail("fmi2DoStep", status, time);
        }
      }
    }
    remember() { // for delayed connections
      if (!this.history.length) return;
      this.newest = this.kept === 0 ? 0 : (this.newest + 1) % this.history.length;
      this.history[this.newest].set(this.values);
      this.kept = Math.min(this.kept + 1, this.history.length);
    }
    aged(age, place) {
      if (this.kept === 0) return this.values[place]; // still initializing
      const back = Math.min(age, this.kept - 1), { length } = this.history;
      return this.history[(this.newest - back + length) % length][place];
    }
    record() {
      const { values, wanted, columns, row } = this;
      for (let k = 0; k < wanted.length; k++) columns[k][row] = values[wanted[k]];
      this.row++;
    }
  }
  return Master;
})();
