"""State of a plant at every sample, in one motion or in ten thousand.

The one place that steps a plant. Classical Runge-Kutta with `substeps` steps per sample; dry friction sticks and slips
at moments found inside the step. The input is held between samples. Per lane it runs through limit, offset, gain,
delay, lag: ``force = gain * lag(delay(clip(u, limit) + offset)) - slope * speed``; before the first sample of the
record it is what it is there. What else a drive does stands in `kernel.drive`. Delay, lag and what switches
keep mean and first moment of the input within a substep exactly, so that the motion depends continuously on them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.laws.linear import Law
from upright.laws.rule import Rule
from upright.physics.actuator import ACTUATOR
from upright.physics.equations import Derived
from upright.simulation import gpu
from upright.simulation.kernel.compiled import WIDTH, Kernel, compiling, kernel, run_words
from upright.simulation.kernel.flavour import Flavour, Layout, lay_out
from upright.simulation.kernel.lanes import room

if TYPE_CHECKING:
    from upright.simulation.lowering.webassembly import Wasm

Array = NDArray[np.float64]
Device = Literal["cpu", "gpu"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Held:
    """A coordinate whose motion is prescribed; the others feel its acceleration.

    ``Held()`` locks the coordinate where it starts. ``Held(q=...)`` takes its positions at the samples, shape (T,),
    and runs a cubic spline with continuous acceleration through them: smooth a rough measurement first.
    With `v` and `a` all three are given at every half substep, shape (2 substeps (T-1) + 1,), and used as they are.
    """

    q: ArrayLike | None = None
    v: ArrayLike | None = None
    a: ArrayLike | None = None

    @property
    def locked(self) -> bool:
        """Whether the coordinate stays where it starts."""
        return self.q is None

    def grid(self, dt: float, substeps: int) -> Array:
        """Position, velocity and acceleration at every half substep, shape (., 3).

        Raises
        ------
        BadInput
            When the arrays are too short, of different lengths or not finite.
        """
        if self.q is None:
            return np.zeros((1, 3))
        q = np.asarray(self.q, dtype=np.float64)
        if q.ndim != 1 or q.size < 2 or not np.all(np.isfinite(q)):
            raise BadInput(f"a held coordinate needs at least two finite positions in one array, got shape {q.shape}.")
        if self.v is not None and self.a is not None:
            v, a = np.asarray(self.v, dtype=np.float64), np.asarray(self.a, dtype=np.float64)
            if v.shape != q.shape or a.shape != q.shape:
                raise BadInput(f"held q, v and a need one length, got {q.shape}, {v.shape} and {a.shape}.")
            return np.stack([q, v, a], axis=1)
        if q.size < 4:
            return _parabola(q, dt, substeps)
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.arange(q.size) * dt, q)
        t = np.arange(2 * substeps * (q.size - 1) + 1) * (0.5 * dt / substeps)
        return np.stack([spline(t), spline(t, 1), spline(t, 2)], axis=1)


def _parabola(q: Array, dt: float, substeps: int) -> Array:
    t = np.arange(2 * substeps * (q.size - 1) + 1) * (0.5 * dt / substeps)
    c = np.polynomial.Polynomial.fit(np.arange(q.size) * dt, q, q.size - 1)
    return np.stack([c(t), c.deriv(1)(t), c.deriv(2)(t)], axis=1)


_NONE = np.zeros((1, 0, 0))
_KIND = ("C", "A", "W")  # machine code reads an array from its first number on, whatever its strides and type


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulator:
    """A plant ready to be stepped again and again with other numbers, at a few microseconds per call.

    Names are resolved once: `table` makes the first array of parameters, and what changes is written into its rows. ::

        values = furuta.parameters()
        derived = furuta.derived_for(values)
        stepper = Simulator(derived=derived, flavour=choose(derived, values, free=["b_1c"]), dt=1e-3)
        params, row = stepper.table(values, lanes=1), stepper.names.index("b_1c")
        for level in levels:
            params[row] = level
            motion = stepper.run(params, x0, samples=1001)

    Attributes
    ----------
    derived : Derived
        Equations of the plant.
    flavour : Flavour
        Terms to compute, from `upright.simulation.choose`.
    dt : float
        Sample time [s].
    substeps : int
        Runge-Kutta steps per sample.
    loop : Law or Rule, optional
        Controller, the one that the flavour was chosen for.
    held : mapping of str to Held
        Coordinates whose motion is prescribed, exactly those of the flavour.
    """

    derived: Derived
    flavour: Flavour
    dt: float
    substeps: int = 1
    loop: Law | Rule | None = None
    held: Mapping[str, Held] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (self.dt > 0.0 and math.isfinite(self.dt)):
            raise BadInput(f"the sample time must be positive, got {self.dt:g} s.")
        if self.substeps < 1:
            raise BadInput(f"substeps must be at least 1, got {self.substeps}.")
        law = None if self.loop is None else self.loop.compiled_in
        late = self.loop is not None and self.loop.delay > 0.0 and not self.flavour.dynamic
        if law != self.flavour.loop or late:
            raise BadInput("a loop was given without a flavour for it, or the other way round; use choose(loop=...).")
        wanted = {self.derived.coordinates[i] for i in self.flavour.held}
        if set(self.held) != wanted:
            raise BadInput(f"the flavour holds {sorted(wanted)}, but motion was given for {sorted(self.held)}.")
        for i in (*self.flavour.dry, *self.flavour.dahl):
            for name, held in self.held.items():
                if not held.locked and self._layout.joints[i][self.derived.coordinates.index(name)]:
                    raise BadInput(
                        f"dry friction at a joint between {self.derived.coordinates[i]} and {name} is not computed"
                        f" while {name} is moved from outside; lock it, or describe the rig in the angle of the joint."
                    )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the rows of `params`: the plant's parameters, then each actuator quantity for every input."""
        return (*self.derived.parameters, *(name for name in ACTUATOR for _ in self.derived.inputs))

    @cached_property
    def carried(self) -> int:
        """How many rows `run` takes and gives behind the states, all zero where a motion begins anew."""
        return len(self._layout.carried)

    @cached_property
    def _layout(self) -> Layout:
        return lay_out(self.derived, self.flavour)

    @cached_property
    def _kernel(self) -> Kernel:
        return kernel(self._layout)

    @cached_property
    def _grid(self) -> Array:
        """Prescribed motion at every half substep, three columns for each held coordinate."""
        grids = [self.held[self.derived.coordinates[i]].grid(self.dt, self.substeps) for i in self.flavour.held]
        if not grids:
            return np.zeros((1, 0))
        longest = max(len(g) for g in grids)
        return np.ascontiguousarray(
            np.hstack([np.vstack([g, np.repeat(g[-1:], longest - len(g), axis=0)]) for g in grids])
        )

    @cached_property
    def _scalars(self) -> Array:
        n, nu = self._layout.n, self._layout.nu
        return np.zeros(n + 2 + nu) if self.loop is None else self.loop.scalars(n, nu)

    @cached_property
    def _reference(self) -> Array:
        return np.zeros((0, 0)) if self.loop is None else np.require(self.loop.signal(), np.float64, _KIND)

    def table(self, params: Mapping[str, ArrayLike], lanes: int) -> Array:
        """Rows of `names` from values by name, shape (rows, lanes); what is missing takes its default or zero."""
        out = np.zeros((len(self.names), lanes))
        for r, name in enumerate(self.names):
            out[r] = params.get(name, ACTUATOR[name].default if name in ACTUATOR else 0.0)  # type: ignore[arg-type]
        return out

    def stepping(self, params: Array, x0: Array, u: Array) -> Stepping:
        """One sample of every lane, again and again in the same memory, for motions that are corrected at each.

        Arguments as for `run`; without a loop, and with a flavour that records.
        """
        width = 1 if params.shape[1] == 1 else WIDTH
        call = self.call(params, x0, u, samples=2, width=width)
        coordinates = self.derived.coordinates
        locked = [(k, 2 * i) for k, i in enumerate(self.flavour.held) if self.held[coordinates[i]].locked]
        return Stepping(
            call=call, working=aligned(call.room), locked=tuple(locked), address=self._kernel.address(f"run_{width}"),
            events=self._kernel.events if self.flavour.dry else 0,
        )  # fmt: skip

    def run(
        self,
        params: Array,
        x0: Array,
        u: Array | None = None,
        *,
        samples: int,
        start: NDArray[np.int64] | None = None,
        every: int = 1,
        threads: int = 1,
        settle: float = 0.0,
        memory: Array | None = None,
        device: Device = "cpu",
    ) -> Array:
        """Motion of every lane.

        Parameters
        ----------
        params : array, shape (rows, lanes)
            In the order of `names`.
        x0 : array, shape (states, lanes)
            Initial states in the paper's order: coordinate, its velocity, next coordinate, ...; where the flavour
            carries more, that behind them.
        u : array, shape (T, inputs), optional
            Input at the samples, held between them and after the last; nothing when omitted.
        samples : int
            Rows returned; the first is `x0`.
        start : int array, shape (lanes,), optional
            Sample of `u`, reference and held motion at which each lane begins, 0 when omitted.
        every : int
            Only each `every`-th sample is returned; `samples` counts what is returned.
        threads : int
            Threads among which blocks of lanes are shared.
        settle : float
            Time [s] from which distances from the target count, when the flavour records nothing.
        memory : array, shape (values,), optional
            Where the motion is written, for who calls often and is done with one motion before the next: what comes
            back is a view of it. At least samples x rows x lanes values, lanes rounded up to 16 unless there is one.
        device : "cpu" or "gpu"
            What computes: this processor, or a GPU of NVIDIA's, each of whose threads steps one lane; the numbers
            agree to rounding.

        Returns
        -------
        array, shape (samples, states, lanes), or (samples, states + inputs, lanes) with a loop
            States, then the command of the controller after its limit, then what the flavour carries. A lane that
            diverges holds NaN or infinity from there on, and only there. When the flavour records nothing: the rows of
            `ensemble`.

        Raises
        ------
        BadInput
            When shapes do not fit together, or there is no GPU where one was requested.
        """
        if device not in ("cpu", "gpu"):
            raise BadInput(f"motions are computed on device 'cpu' or 'gpu', got {device!r}.")
        width = 1 if (params.ndim == 2 and params.shape[1] == 1) or device == "gpu" else WIDTH
        call = self.call(
            params, x0, u, samples=samples, start=start, every=every, settle=settle, memory=memory, width=width
        )
        motion = call.out if self.flavour.record else call.reduced
        if device == "gpu":
            with compiling(self.loop):
                gpu.launch(
                    gpu.door(), lambda: self._kernel.ptx(call.room), call.lanes, call.arguments,
                    results=(call.out, call.reduced),
                )  # fmt: skip
            return motion
        with compiling(self.loop):
            compiled = self._kernel.run_1 if width == 1 else self._kernel.run_16
            events = self._kernel.events if self.flavour.dry else 0

        def step(first: int, last: int) -> None:
            compiled(first, last, *call.arguments, aligned(call.room), events)

        if threads <= 1 or call.blocks < 2 * threads:
            step(0, call.blocks)
        else:
            take_turns(step, call.blocks, threads)
        return motion[..., : call.lanes]

    def going_on(self, call: Call, width: int) -> Callable[[int, int, int, Array], None]:
        """Steps a block of lanes of a call from one sample to another, in a working array of `Call.room` numbers.

        From sample 0 it begins there; from any other it goes on from the array as it was left, see `rows`. Rows of
        `Call.out` are counted from the first of the two samples.
        """
        with compiling(self.loop):
            compiled = self._kernel.run_1 if width == 1 else self._kernel.run_16
            events = self._kernel.events if self.flavour.dry else 0
        before, after = call.arguments[:8], call.arguments[11:]

        def go(block: int, first: int, end: int, working: Array) -> None:
            compiled(block, block + 1, *before, first, end, 1 << 62, *after, working, events)

        return go

    def library(self) -> list[str]:
        """Functions of the C library that the kernel calls, whose last bits are each system's own."""
        with compiling(self.loop):
            return self._kernel.library()

    def wasm(self, width: int) -> Wasm:
        """The kernel for a page or Node, to be called with what `call` says.

        Raises
        ------
        BadInput
            When a rule, or the plant, cannot be compiled for a page.
        """
        with compiling(self.loop):
            return self._kernel.wasm(f"run_{width}")

    @property
    def rows(self) -> Mapping[str, int]:
        """Place of each number of a lane in the working array: ``W[place * width + lane]``."""
        return self._layout.rows

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of those of `rows` that stay as they are while a motion lasts."""
        return self._layout.settings

    @property
    def law_rows(self) -> tuple[str, ...]:
        """Names of the numbers of the controller, which follow `names` in the kernel's table of parameters."""
        return self._layout.numbers

    def call(
        self,
        params: Array,
        x0: Array,
        u: Array | None = None,
        *,
        samples: int,
        width: int,
        start: NDArray[np.int64] | None = None,
        every: int = 1,
        settle: float = 0.0,
        memory: Array | None = None,
    ) -> Call:
        """What the kernel is called with, in blocks of `width` lanes; arguments and errors as for `run`."""
        n, nu, f = self._layout.n, self._layout.nu, self.flavour
        lanes = params.shape[1] if params.ndim == 2 else 0
        if lanes == 0 or params.shape[0] != len(self.names):
            raise BadInput(f"params needs shape ({len(self.names)}, lanes), got {params.shape}; see Simulator.names.")
        if x0.shape != (2 * n + self.carried, lanes):
            raise BadInput(
                f"x0 needs shape ({2 * n + self.carried}, {lanes}): states first, lanes last; got {x0.shape}."
            )
        if samples < 1 or every < 1:
            raise BadInput(f"samples and every must be at least 1, got {samples} and {every}.")
        u = np.zeros((0, nu)) if u is None else np.require(u, np.float64, _KIND)
        steps = int((samples - 1) * every)
        if u.ndim != 2 or u.shape[1] != nu:
            raise BadInput(f"u needs shape (T, {nu}): time first, one column for each input; got {u.shape}.")
        blocks = -(-lanes // width)
        law = _NONE[0] if self.loop is None else self.loop.rows(nu, lanes, x0[: 2 * n : 2])
        P = ready(params, blocks * width) if self.loop is None else padded(params, blocks * width, extra=len(law))
        if self.loop is not None:
            P[len(params) :, :lanes] = law
            P[len(params) :, lanes:] = law[:, -1:]
            limit = self.names.index("actuator.limit")
            P[limit : limit + nu] = np.minimum(P[limit : limit + nu], self.loop.limit)
        X0 = ready(x0, blocks * width)
        begin = np.zeros(blocks * width, np.int64)
        if start is not None:
            if np.shape(start) != (lanes,) or np.min(start) < 0:
                raise BadInput(f"start needs {lanes} sample numbers that are not negative, got {start!r}.")
            begin[:lanes] = start
        base = np.zeros((len(f.held), blocks * width))
        for k, i in enumerate(f.held):
            if self.held[self.derived.coordinates[i]].locked:
                base[k] = X0[2 * i]
        buffer = 1
        if f.loop and f.dynamic:
            row = self.names.index("actuator.delay")
            delays = params[row : row + nu] / self.dt + self._scalars[n]
            longest = float(np.max(delays[np.isfinite(delays)], initial=0.0))
            if longest > 1e4:
                raise BadInput(f"a delay of {longest:g} samples is too long for a loop; is it in seconds?")
            buffer = int(max(longest, 0.0)) + 3
        scalars = self._scalars.copy()
        scalars[n + 1] = math.ceil(settle / self.dt - 1e-9)
        out, reduced = _NONE, _NONE[0]
        if f.record:
            out = recorded((samples, 2 * n + (nu if f.loop else 0) + self.carried, blocks * width), memory)
        else:
            reduced = np.empty((4 * n + nu, blocks * width))
        return Call(
            arguments=(
                lanes, P, X0, u, self._reference, begin, self._grid, base, 0, steps + 1, steps, int(every),
                int(self.substeps), float(self.dt), scalars, buffer, out, reduced,
            ),
            params=P, x0=X0, references=self._reference, start=begin, base=base, lanes=lanes, blocks=blocks, out=out,
            reduced=reduced, room=room(self._layout, width, buffer),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Call:
    """What a kernel is called with.

    Attributes
    ----------
    arguments : tuple of int, float or array
        Those of `lanes.RUN_ARGUMENTS` from ``_total`` to ``STAT``.
    params, x0, references, start, base : array
        Those of the arguments that say what is moved, from where, what it follows, when, and where locked coordinates
        stay.
    lanes, blocks : int
        Lanes, and blocks of them.
    out, reduced : array
        Those of the arguments that the kernel writes: the motion, or what it reduces to.
    room : int
        Size of the working array ``W``.
    """

    arguments: tuple[int | float | Array | NDArray[np.int64], ...]
    params: Array
    x0: Array
    references: Array
    start: NDArray[np.int64]
    base: Array
    lanes: int
    blocks: int
    out: Array
    reduced: Array
    room: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Stepping:
    """Memory of motions that are stepped by one sample: write what changes, `go`, and read `after`.

    Lanes that only fill up a block keep what they began with.

    Attributes
    ----------
    call, working, events : Call, array, int
        What the kernel is called with.
    locked : tuple of (int, int)
        Rows of `Call.base` and of the states of the coordinates that stay where they are.
    address : int
        Where the compiled loop stands, which takes `words`: for machine code that steps by itself.
    """

    call: Call
    working: Array
    locked: tuple[tuple[int, int], ...]
    address: int
    events: int

    @property
    def params(self) -> Array:
        """Parameters (rows, lanes)."""
        return self.call.params[:, : self.call.lanes]

    @property
    def state(self) -> Array:
        """States (states, lanes) before the step."""
        return self.call.x0[:, : self.call.lanes]

    @property
    def start(self) -> NDArray[np.int64]:
        """Sample of the input (lanes,) at which each lane steps."""
        return self.call.start[: self.call.lanes]

    @property
    def after(self) -> Array:
        """States (states, lanes) one sample later."""
        return self.call.out[1, :, : self.call.lanes]

    @cached_property
    def words(self) -> NDArray[np.int64]:
        """The arguments of the compiled loop."""
        return np.frombuffer(run_words(0, self.call.blocks, *self.call.arguments, self.working, self.events), np.int64)

    def go(self) -> None:
        """Step every lane by one sample."""
        for k, row in self.locked:
            self.call.base[k] = self.call.x0[row]
        self._loop(self.words.tobytes())

    @cached_property
    def _loop(self) -> Callable[[bytes], None]:
        from upright.simulation.lowering import machine

        return machine.function(self.address)


def ready(a: Array, width: int) -> Array:
    """The array itself where machine code can read it as it stands, else a `padded` copy."""
    return a if a.shape[1] == width and a.dtype == np.float64 and a.flags.carray else padded(a, width)


def padded(a: Array, width: int, extra: int = 0) -> Array:
    """Contiguous copy with the last lane repeated and room for `extra` rows."""
    rows, lanes = a.shape
    out = np.empty((rows + extra, width))
    out[:rows, :lanes] = a
    out[:rows, lanes:] = a[:, -1:]
    return out


def aligned(size: int) -> Array:
    """Zeros that start on a cache line, so that no vector straddles two."""
    raw = np.zeros(size + 7)
    first = (-raw.ctypes.data // 8) % 8
    return raw[first : first + size]


def recorded(shape: tuple[int, int, int], memory: Array | None) -> Array:
    """Array to record into: fresh, or the first part of `memory`."""
    if memory is None:
        return np.empty(shape)
    size = math.prod(shape)
    if memory.ndim != 1 or memory.size < size or memory.dtype != np.float64 or not memory.flags.carray:
        raise BadInput(f"memory needs at least {size} contiguous float64 values in one row, got {memory.shape}.")
    return memory[:size].reshape(shape)


def take_turns(step: Callable[[int, int], None], blocks: int, threads: int) -> None:
    """Let threads take turns at pieces of the work; the kernel holds no lock."""
    from concurrent.futures import ThreadPoolExecutor

    pieces = min(blocks, 4 * threads)
    edges = [blocks * k // pieces for k in range(pieces + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda k: step(edges[k], edges[k + 1]), range(pieces)))
