/* The Pico's own image on rp2040js (npm, MIT) with a rig of two bodies: quadrature edges in, edges of the PWM and the
 * enable line out. The emulator counts instructions and knows no wait for the flash: what is computed is the board's,
 * how long it takes is not.
 *
 *     NODE_PATH=... node picosim.cjs pico-pair.uf2 pair|sign
 *
 * Time is virtual: it passes while a frame is answered, and as `run` says. Lines on standard input, each answered:
 *     w HEX           bytes from the host, one every 10 us, and time until the answer has come: r HEX
 *     run MS          time passes without the host
 *     state           milliseconds, psi, psi', theta, theta', command [steps], enable line, longest tick [cycles]
 *     pwm             as of simrig.c, in nanoseconds
 *     illegal, hang, reset, cut, join */
const fs = require("fs");
const { Simulator, GPIOPinState, LogLevel, ConsoleLogger } = require("rp2040js");

const [, , file, wiring] = process.argv;
const SLICE = 50000, BYTE = 10000, CYCLE = 8, LONGEST = 400e6; // ns
const STEPS = 6250, SUPPLY = 12, COUNTS = 16000 / (2 * Math.PI);
const FLASH = 0x10000000, TICK_VECTOR = 16;

const image = fs.readFileSync(file);
const pins = { encoders: [[2, 3], [4, 5]], enable: 18, bridge: wiring === "pair" ? [16, 17] : [16, 20, 21] };

let sim, mcu, clock, began = 0; // ns of the boards before this start
let answer = [], zeros = 0, restart = false, cut = false;
const plant = { x: [0, 0, 0, 0], counts: [0, 0] };
let levels = [0, 0, 0], enabled = 0, since = 0, rose = 0, pushes = [0, 0], command = 0;
let seen = { shortest: 0, longest: 0, forward: 0, backward: 0, both: 0 }, worst = 0, entered = -1, depth = 0;

const now = () => began + clock.nanos;

function pushUntilNow() {
  const a = wiring === "pair" ? levels[0] : levels[0] && levels[1];
  const b = wiring === "pair" ? levels[1] : levels[0] && levels[2];
  const passed = now() - since;
  since = now();
  if (!enabled) return;
  if (a) (pushes[0] += passed), (seen.forward += passed);
  if (b) (pushes[1] += passed), (seen.backward += passed);
  if (a && b) seen.both += passed;
}

function start() {
  if (clock) began += clock.nanos;
  sim = new Simulator();
  mcu = sim.rp2040;
  clock = sim.clock;
  mcu.logger = new ConsoleLogger(LogLevel.Error, false);
  for (let at = 0; at < image.length; at += 512)
    mcu.flash.set(image.subarray(at + 32, at + 32 + 256), image.readUInt32LE(at + 12) - FLASH);
  mcu.core.PC = FLASH;
  mcu.uart[0].onByte = (byte) => {
    if (cut) return;
    answer.push(byte);
    if (!byte) zeros++;
  };
  const watchdog = mcu.peripherals[0x40058];
  watchdog.onWatchdogTrigger = () => {
    restart = true;
    watchdog.timer.enable = watchdog.alarm.enable = false; // or it would come again in the same moment
  };
  pushUntilNow();
  levels = [0, 0, 0];
  enabled = 0; // by its resistor
  mcu.gpio[pins.enable].addListener((state) => {
    pushUntilNow();
    enabled = state === GPIOPinState.High ? 1 : 0;
  });
  pins.bridge.forEach((pin, i) =>
    mcu.gpio[pin].addListener((state) => {
      const high = state === GPIOPinState.High ? 1 : 0;
      if (levels[i] === high) return;
      pushUntilNow();
      levels[i] = high;
      if (!high || (wiring === "sign" && i)) return;
      const period = now() - rose;
      rose = now();
      if (!seen.shortest || period < seen.shortest) seen.shortest = period;
      if (period > seen.longest) seen.longest = period;
    }),
  );
  [0, 1].forEach(show);
}

function show(i) {
  const gray = [0, 1, 3, 2][plant.counts[i] & 3];
  mcu.gpio[pins.encoders[i][0]].setInputValue(!!(gray & 1));
  mcu.gpio[pins.encoders[i][1]].setInputValue(!!(gray >> 1));
}

function runUntil(then) {
  const core = mcu.core;
  while (now() < then) {
    if (restart) {
      restart = false;
      start();
      mcu.peripherals[0x40058].reason = 1;
      return runUntil(then);
    }
    if (core.waiting) {
      const next = clock.nanosToNextAlarm;
      clock.tick(Math.max(1, Math.min(next > 0 ? next : CYCLE, then - now())));
      continue;
    }
    const inTick = core.IPSR === TICK_VECTOR;
    if (inTick && entered < 0) (entered = core.cycles), (depth = core.SP);
    else if (entered >= 0 && !core.IPSR) (worst = Math.max(worst, core.cycles - entered)), (entered = -1);
    clock.tick(core.executeInstruction() * CYCLE);
  }
}

/* An arm on a drive with friction, and a pendulum that hangs from it. */
function move(dt) {
  const [psi, psi1, theta, theta1] = plant.x;
  const psi2 = 60 * ((SUPPLY * command) / STEPS) - 5 * psi1;
  const theta2 = -80 * theta - 0.5 * theta1 + psi2;
  const v1 = psi1 + dt * psi2, w1 = theta1 + dt * theta2;
  plant.x = [psi + dt * v1, v1, theta + dt * w1, w1];
}

function slice() {
  pushUntilNow();
  command = ((pushes[0] - pushes[1]) * STEPS) / SLICE;
  pushes = [0, 0];
  move(SLICE * 1e-9);
  const from = now();
  const edges = [0, 1].map((i) => Math.round(plant.x[2 * i] * COUNTS) - plant.counts[i]);
  const most = Math.max(1, ...edges.map(Math.abs));
  for (let k = 1; k <= most; k++) {
    runUntil(from + (SLICE * k) / (most + 1));
    for (const i of [0, 1])
      if (k <= Math.abs(edges[i])) {
        plant.counts[i] += Math.sign(edges[i]);
        show(i);
      }
  }
  runUntil(from + SLICE);
}

function handOver(bytes) {
  answer = [];
  zeros = 0;
  let fed = 0;
  const end = now() + LONGEST;
  while (now() < end && zeros < 2) {
    for (let k = 0; k < SLICE / BYTE && fed < bytes.length; k++) if (!cut) mcu.uart[0].feedByte(bytes[fed++]);
    slice();
  }
  return Buffer.from(answer).toString("hex");
}

function obey(line) {
  const [what, value] = line.split(" ");
  if (what === "w") return `r ${handOver(Buffer.from(value, "hex"))}`;
  if (what === "run") for (const end = now() + 1e6 * Number(value); now() < end; ) slice();
  else if (what === "state")
    return [now() / 1e6, ...plant.x, Math.round(command), enabled, worst].join(" ");
  else if (what === "pwm") {
    pushUntilNow();
    const said = [seen.shortest, seen.longest, seen.forward, seen.backward, seen.both].map(Math.round).join(" ");
    seen = { shortest: 0, longest: 0, forward: 0, backward: 0, both: 0 };
    return said;
  } else if (what === "illegal") {
    plant.counts[0] += 2;
    plant.x[0] += 2 / COUNTS;
    show(0);
  } else if (what === "hang") {
    mcu.writeUint32(0x20041000, 0xe7fee7fe); // b .
    mcu.core.PM = true;
    mcu.core.waiting = false;
    mcu.core.PC = 0x20041000;
  } else if (what === "reset") start();
  else if (what === "cut") cut = true;
  else if (what === "join") cut = false;
  else return `not understood: ${line}`;
  return "ok";
}

start();
runUntil(20e6);
console.log("ready");
require("readline")
  .createInterface({ input: process.stdin })
  .on("line", (line) => console.log(obey(line)));
