// A rig that moves in the page: drawn, pushed, held by a law whose poles are dragged, beside the rigs that its fit allows.
"use strict";

const matrix = {
  times: (a, b) => a.map((r) => b[0].map((_, j) => r.reduce((s, x, k) => s + x * b[k][j], 0))),
  solve(M, b) {
    const n = b.length, a = M.map((r, i) => [...r, b[i]]);
    for (let i = 0; i < n; i++) {
      let best = i;
      for (let r = i + 1; r < n; r++) if (Math.abs(a[r][i]) > Math.abs(a[best][i])) best = r;
      [a[i], a[best]] = [a[best], a[i]];
      for (let r = 0; r < n; r++) {
        if (r === i) continue;
        const f = a[r][i] / a[i][i];
        for (let c = i; c <= n; c++) a[r][c] -= f * a[i][c];
      }
    }
    return a.map((r, i) => r[n] / r[i]);
  },
};

// Ackermann: K = [0 ... 0 1] W^-1 p(A), for the poles of p.
function ackermann(A, B, poles) {
  const n = B.length;
  let p = [1];
  for (const [re, im] of poles) {
    if (im < 0) continue;
    const factor = im > 0 ? [1, -2 * re, re * re + im * im] : [1, -re];
    const next = Array(p.length + factor.length - 1).fill(0);
    p.forEach((x, i) => factor.forEach((y, j) => (next[i + j] += x * y)));
    p = next;
  }
  let pA = A.map((r) => r.map(() => 0));
  for (const c of p) pA = matrix.times(pA, A).map((r, i) => r.map((v, j) => v + (i === j ? c : 0)));
  const W = [B];
  for (let i = 1; i < n; i++) W.push(A.map((r) => r.reduce((s, x, k) => s + x * W[i - 1][k], 0)));
  const last = matrix.solve(W, Array.from({ length: n }, (_, i) => +(i === n - 1)));
  return pA[0].map((_, j) => pA.reduce((s, r, i) => s + last[i] * r[j], 0));
}

// Numbers of the sampled law by name, as the kernel has them, for gains K: u = -K x, x from the estimator.
function law(estimator, K) {
  const { A, B, E, C, D } = estimator, out = {};
  const minus = (M) => (M[0] ?? []).map((_, j) => -K.reduce((s, k, i) => s + k * M[i][j], 0));
  const c = minus(C), d = minus(D);
  c.forEach((v, j) => (out[`lC0_${j}`] = v));
  d.forEach((v, j) => (out[`lD0_${j}`] = v));
  A.forEach((row, i) => row.forEach((a, j) => (out[`lA${i}_${j}`] = a + E[i][0] * c[j])));
  B.forEach((row, i) => row.forEach((b, j) => (out[`lB${i}_${j}`] = b + E[i][0] * d[j])));
  return out;
}

// Numbers of a kernel as settings and gains change them; `held` when the law acts.
function write(kernel, base, data, settings, gains, held) {
  const names = kernel.described.parameters, lanes = base.length / names.length, P = kernel.arrays.P;
  const fill = (name, value) => {
    const row = names.indexOf(name);
    if (row >= 0) P.fill(value, row * lanes, (row + 1) * lanes);
  };
  P.set(base);
  for (const name of data.dry) {
    const row = names.indexOf(name);
    if (row >= 0) for (let i = row * lanes; i < (row + 1) * lanes; i++) P[i] = base[i] * settings.friction;
  }
  fill("actuator.delay", settings.delay);
  fill("actuator.limit", settings.limit);
  const numbers = law(data.estimator, gains);
  for (const name in numbers) fill(name, held || !/^l[CD]/.test(name) ? numbers[name] : 0);
  data.resolution.forEach((r, i) => (kernel.arrays.FL[i] = r * settings.counts));
}

const shapeOf = (described, name) => described.arguments.find((a) => a.name === name).shape;

// The rigs that the fit allows, each run once from its start.
class Ensemble {
  constructor(data) {
    this.data = data;
    this.kernel = new Kernel(data.many);
    this.base = this.kernel.arrays.P.slice();
    this.blocks = shapeOf(data.many, "P")[1] / data.many.width;
  }

  // What becomes of each rig of blocks `first` to `after`: "stands", "saturates" or "falls".
  words(settings, gains, first = 0, after = this.blocks) {
    const { data, kernel } = this, { point, fallen, travel, moved, felt, period, speed_limit: fast } = data;
    write(kernel, this.base, data, settings, gains, true);
    kernel.run(first, after);
    const n = point.length, wide = this.blocks * data.many.width, count = shapeOf(data.many, "OUT")[0], words = [];
    for (let lane = first * data.many.width; lane < Math.min(after * data.many.width, data.lanes); lane++) {
      let away, full;
      if (fast === null) {
        const S = kernel.arrays.STAT, at = (row) => S[row * wide + lane];
        away = point.map((_, i) => at(n + i));
        full = at(2 * n) * period;
      } else {
        const O = kernel.arrays.OUT, columns = 2 * n + 1, at = (k, c) => O[(k * columns + c) * wide + lane];
        away = point.map(() => 0);
        full = 0;
        for (let k = 0; k < count; k++) {
          point.forEach((p, i) => (away[i] = Math.max(away[i], Math.abs(at(k, 2 * i) - p))));
          const [a, b] = [Math.max(k - 1, 0), Math.min(k + 1, count - 1)]; // as numpy.gradient
          if (!(Math.abs(at(b, 2 * moved) - at(a, 2 * moved)) / ((b - a) * period) <= fast)) away[moved] = Infinity;
          full += Math.abs(at(k, 2 * n)) >= settings.limit * (1 - 1e-9) ? period : 0;
        }
      }
      const held = away[n - 1] <= fallen && away[moved] <= (travel ?? Number.MAX_VALUE);
      words.push(held ? (full > felt ? "saturates" : "stands") : "falls");
    }
    return words;
  }
}

// One rig that goes on, and what a page can change of it.
class Twin {
  constructor(data) {
    this.data = data;
    this.one = new Kernel(data.one);
    this.now = new Kernel(data.one); // the same numbers at their start, when a setting changes in the middle
    this.n = data.coordinates.length;
    [this.rows, this.columns] = shapeOf(data.one, "OUT");
    this.base = this.one.arrays.P.slice();
    this.poles = data.poles.map((z) => [...z]);
    this.gains = data.K;
    this.settings = { friction: 1, delay: data.delay, limit: data.command.limit, counts: 1, holding: true };
    this.set({});
    this.restart();
  }

  set(change) {
    Object.assign(this.settings, change);
    for (const k of [this.one, this.now]) write(k, this.base, this.data, this.settings, this.gains, this.settings.holding);
    if (this.k === undefined) return;
    this.now.arrays.X0.set(this.state());
    this.now.frame(0, 0);
    for (const name of this.data.one.settings) this.one.arrays.W[this.one.at(name)] = this.now.arrays.W[this.now.at(name)];
  }

  place(poles) {
    this.poles = poles;
    this.gains = ackermann(this.data.A, this.data.B, poles);
    this.set({});
  }

  restart(away = this.data.away, start = this.data.start) {
    this.one.arrays.X0.set(start.map((x, i) => x + away[i]));
    const readings = this.data.point.map((p, i) => {
      const r = this.data.resolution[i] * this.settings.counts, q = this.one.arrays.X0[2 * i];
      return (r > 0 ? Math.floor(q / r + 0.5) * r : q) - p;
    });
    const names = this.data.one.parameters;
    this.data.estimator.begin.forEach((row, i) => {
      const z = names.indexOf(`z${i}`);
      if (z >= 0) this.one.arrays.P[z] = row.reduce((s, b, j) => s + b * readings[j], 0);
    });
    this.one.frame(0, 0);
    this.k = 0;
    this.lost = "";
  }

  state() {
    const W = this.one.arrays.W;
    return Array.from({ length: 2 * this.n }, (_, i) => W[this.one.at((i % 2 ? "v" : "q") + (i >> 1))]);
  }

  // Goes on for so many samples; gives rows of coordinate, velocity, ..., command.
  advance(samples) {
    const rows = [];
    while (samples > 0) {
      const some = Math.min(samples, this.rows);
      this.one.frame(this.k, this.k + some);
      for (let i = 0; i < some; i++) rows.push(this.one.arrays.OUT.slice(i * this.columns, (i + 1) * this.columns));
      this.k += some;
      samples -= some;
    }
    const x = this.state();
    if (this.settings.holding && !this.lost) {
      const away = (i) => Math.abs(x[2 * i] - this.data.point[i]);
      if (!(away(this.n - 1) <= this.data.fallen)) this.lost = "It fell.";
      else if (this.data.travel !== null && !(away(this.data.moved) <= this.data.travel)) this.lost = "It left its travel.";
      if (this.lost) this.set({ holding: false });
    }
    return rows;
  }

  // A tap: one coordinate is faster by so much; what was stuck slips.
  push(coordinate, speed) {
    const W = this.one.arrays.W;
    W[this.one.at(`v${coordinate}`)] += speed;
    for (let i = 0; i < this.n; i++) {
      const name = `s${i}`, v = W[this.one.at(`v${i}`)];
      if (name in this.data.one.rows && v) W[this.one.at(name)] = Math.sign(v);
    }
  }
}
