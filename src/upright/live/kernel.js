// Instantiates a kernel of upright and calls it with its arrays, which lie in its own memory. See live/kernel.py.
"use strict";

class Kernel {
  constructor(described) {
    this.described = described;
    const arrays = described.arguments.filter((a) => a.shape);
    const bytes = (a) => 8 * a.shape.reduce((n, m) => n * m, 1);
    const start = 1 << 16; // the stack grows down from here
    const size = arrays.reduce((sum, a) => sum + bytes(a) + 64, start + 64);
    const memory = new WebAssembly.Memory({ initial: Math.ceil(size / 65536) });
    const env = {
      __linear_memory: memory,
      __stack_pointer: new WebAssembly.Global({ value: "i32", mutable: true }, start),
    };
    for (const name of described.imports) env[name] = Math[name];
    this.module = new WebAssembly.Instance(new WebAssembly.Module(Kernel.bytes(described.wasm)), { env });
    this.words = [];
    this.place = {};
    this.arrays = {};
    let top = start;
    for (const a of described.arguments) {
      this.place[a.name] = this.words.length;
      if (!a.shape) {
        this.words.push(a.value);
        continue;
      }
      const count = bytes(a) / 8;
      const view = a.whole ? new BigInt64Array(memory.buffer, top, count) : new Float64Array(memory.buffer, top, count);
      const wide = count / (a.rows?.length || 1);
      a.rows?.forEach((row, i) => {
        if (typeof row !== "string") view.fill(a.whole ? BigInt(row) : row, i * wide, (i + 1) * wide);
        else new Uint8Array(memory.buffer, top + 8 * i * wide, 8 * wide).set(Kernel.bytes(row));
      });
      this.arrays[a.name] = view;
      this.words.push(top, ...a.shape);
      top = (top + bytes(a) + 63) & ~63;
    }
    this.steps = this.words[this.place._nsteps];
  }

  static bytes(text) {
    return Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  }

  // The whole motion that the arrays say, of some of its blocks.
  run(first = 0, after = this.words[this.place._b1]) {
    const all = this.words[this.place._b1];
    [this.words[this.place._b0], this.words[this.place._b1]] = [first, after];
    this._call(0, this.steps + 1, this.steps);
    [this.words[this.place._b0], this.words[this.place._b1]] = [0, all];
  }

  // The motion from sample `first` until the state of sample `end` stands in W; above 0 it goes on from the last call.
  frame(first, end) {
    this._call(first, end, 0x7fffffff);
  }

  _call(first, end, last) {
    this.words[this.place._first] = first;
    this.words[this.place._end] = end;
    this.words[this.place._nsteps] = last;
    this.module.exports.run(...this.words);
  }

  // Place of a number of lane `lane` in the working array W.
  at(name, lane = 0) {
    return this.described.rows[name] * this.described.width + lane;
  }
}
