"""Text of the unit's one C file: the kernel, and the functions of FMI 3.0 around it."""

from __future__ import annotations

from upright.exports.controller import harmless
from upright.exports.fmu.translation import Kind, as_c, helpers
from upright.exports.fmu.unit import STEP, Unit
from upright.simulation.kernel.compiled import source as kernel_text
from upright.simulation.kernel.flavour import lay_out
from upright.simulation.kernel.lanes import room


def fmu_source(unit: Unit, token: str) -> str:
    """Text of the C file."""
    simulator = unit.simulator
    layout = lay_out(simulator.derived, simulator.flavour)
    inputs, states = max(layout.nu, 1), 2 * layout.n
    table: tuple[Kind, tuple[int, ...]] = ("double *", (1, 1))
    arrays: dict[str, tuple[Kind, tuple[int, ...]]] = dict.fromkeys(("P", "X0", "R", "HELD", "HBASE", "STAT"), table)
    arrays |= {"U": ("double *", (inputs, 1)), "OUT": ("double *", (states, 1, 1))}
    arrays |= {"START": ("long *", (1,)), "FL": ("double *", (1,)), "W": ("double *", (1,))}
    sizes = {"W": "W_SIZE", "U": "(PAST + 1)", "HELD": "0", "R": "0"}
    kernel = as_c(kernel_text(layout), "run_1", arrays, sizes)
    rows = simulator.table(unit.values, 1)[:, 0].tolist()
    numbers = ", ".join(repr(v).replace("inf", "HUGE_VAL") for v in rows)
    places = ", ".join(str(p.row) for p in unit.parameters) or "0"
    return f"""\
/* {harmless(unit.rig.name)}, written by upright export: the kernel that simulates the rig, and FMI 3.0 around it. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOKEN "{token}"
#define STEP {STEP!r} /* between two samples of the kernel [s] */
#define SUBSTEPS {simulator.substeps} /* Runge-Kutta steps between them */
#define STATES {states} /* coordinates, each followed by its speed */
#define INPUTS {layout.nu}
#define PAST {unit.remembered} /* commands that the drive still holds */
#define ROWS {len(rows)}
#define PARAMETERS {len(unit.parameters)}
#define W_SIZE {room(layout, 1, 1)}

static const double NUMBERS[ROWS] = {{{numbers}}};
static const int PLACES[] = {{{places}}};

{helpers(kernel)}
{kernel}
{_FMI}{"".join(map(_nothing, _TYPES))}{"".join(map(_refused, _REFUSED))}"""


_FMI = r"""
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*Log)(void *environment, fmi3Status status, const char *category, const char *message);

typedef struct {
    double t, parameters[ROWS], start[STATES], x[STATES], u[INPUTS + 1];
    double past[(PAST + 1) * (INPUTS + 1)], w[W_SIZE], moved[2 * STATES];
    void *environment;
    Log log;
    bool running;
} Rig;

/* Value references: time, inputs, states, their starts, parameters. */
enum { TIME = 0, FIRST_INPUT = 1, FIRST_STATE = FIRST_INPUT + INPUTS, FIRST_START = FIRST_STATE + STATES,
       FIRST_PARAMETER = FIRST_START + STATES, END = FIRST_PARAMETER + PARAMETERS };

static fmi3Status say(Rig *rig, fmi3Status status, const char *message)
{
    if (rig->log)
        rig->log(rig->environment, status, "logStatusError", message);
    return status;
}

static double *place(Rig *rig, uint32_t reference)
{
    if (reference >= END)
        return NULL;
    if (reference >= FIRST_PARAMETER)
        return &rig->parameters[PLACES[reference - FIRST_PARAMETER]];
    if (reference >= FIRST_START)
        return &rig->start[reference - FIRST_START];
    if (reference >= FIRST_STATE)
        return rig->running ? &rig->x[reference - FIRST_STATE] : &rig->start[reference - FIRST_STATE];
    return reference == TIME ? &rig->t : &rig->u[reference - FIRST_INPUT];
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3Reset(void *instance)
{
    Rig *rig = instance;
    void *environment = rig->environment;
    Log log = rig->log;
    memset(rig, 0, sizeof *rig);
    memcpy(rig->parameters, NUMBERS, sizeof NUMBERS);
    rig->environment = environment;
    rig->log = log;
    return fmi3OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
    bool logging, bool event_mode, bool early_return, const uint32_t *intermediate, size_t count, void *environment,
    Log log, void (*update)(void))
{
    Rig *rig;
    (void)name, (void)resources, (void)visible, (void)event_mode, (void)early_return, (void)intermediate, (void)count;
    (void)update;
    if (!token || strcmp(token, TOKEN) != 0) {
        if (log)
            log(environment, fmi3Error, "logStatusError", "the instantiation token is that of another unit");
        return NULL;
    }
    rig = calloc(1, sizeof *rig);
    if (!rig)
        return NULL;
    rig->environment = environment;
    rig->log = logging ? log : NULL;
    fmi3Reset(rig);
    return rig;
}

EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
EXPORT void fmi3FreeInstance(void *instance) { free(instance); }
EXPORT fmi3Status fmi3Terminate(void *instance) { (void)instance; return fmi3OK; }
EXPORT fmi3Status fmi3SetDebugLogging(void *instance, bool on, size_t count, const char *const *categories)
{
    (void)instance, (void)on, (void)count, (void)categories;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterInitializationMode(void *instance, bool has_tolerance, double tolerance, double start,
    bool has_stop, double stop)
{
    Rig *rig = instance;
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    rig->t = start;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(void *instance)
{
    Rig *rig = instance;
    memcpy(rig->x, rig->start, sizeof rig->x);
    rig->running = true;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(void *instance, const uint32_t *references, size_t count, double *values, size_t n)
{
    size_t i;
    if (n != count)
        return say(instance, fmi3Error, "every variable is one number");
    for (i = 0; i < count; i++) {
        const double *at = place(instance, references[i]);
        if (!at)
            return say(instance, fmi3Error, "there is no variable of this reference");
        values[i] = *at;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(void *instance, const uint32_t *references, size_t count, const double *values,
    size_t n)
{
    Rig *rig = instance;
    size_t i;
    if (n != count)
        return say(rig, fmi3Error, "every variable is one number");
    for (i = 0; i < count; i++) {
        const uint32_t r = references[i];
        const bool input = r >= FIRST_INPUT && r < FIRST_STATE;
        if (r >= END || (!input && (r < FIRST_START || rig->running)))
            return say(rig, fmi3Error, "inputs can be set at any time, starts and parameters before the first step");
        if (!isfinite(values[i]))
            return say(rig, fmi3Error, "a variable is a finite number");
        *place(rig, r) = values[i];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(void *instance, double t, double size, bool no_return, bool *event, bool *terminate,
    bool *early, double *last)
{
    Rig *rig = instance;
    const long count = (long)floor(size / STEP + 0.5);
    long first = PAST, i;
    const long kept = count < PAST ? PAST - count : 0;
    (void)t, (void)no_return;
    *event = *terminate = *early = false;
    *last = rig->t;
    if (count < 1 || fabs((double)count * STEP - size) > 1e-6 * STEP)
        return say(rig, fmi3Error, "a step has to be a whole number of milliseconds, in s");
    memcpy(rig->past + PAST * INPUTS, rig->u, sizeof(double) * INPUTS);
    k_run_1(0, 1, 1, rig->parameters, rig->x, rig->past, NULL, &first, NULL, NULL, 0, count + 1, count, count,
            SUBSTEPS, STEP, NULL, 1, rig->moved, NULL, rig->w, 0);
    for (i = 0; i < STATES; i++)
        if (!isfinite(rig->moved[STATES + i]))
            return say(rig, fmi3Error, "the motion diverged");
    memcpy(rig->x, rig->moved + STATES, sizeof rig->x);
    memmove(rig->past, rig->past + (PAST - kept) * INPUTS, sizeof(double) * (size_t)(kept * INPUTS));
    for (i = kept; i < PAST; i++)
        memcpy(rig->past + i * INPUTS, rig->u, sizeof(double) * INPUTS);
    rig->t = t + size;
    *last = rig->t;
    return fmi3OK;
}
"""

_TYPES = ("Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean", "String")
_REFUSED = (
    "GetBinary", "SetBinary", "GetClock", "SetClock", "EnterEventMode", "GetNumberOfVariableDependencies",
    "GetVariableDependencies", "GetFMUState", "SetFMUState", "FreeFMUState", "SerializedFMUStateSize",
    "SerializeFMUState", "DeserializeFMUState", "GetDirectionalDerivative", "GetAdjointDerivative",
    "EnterConfigurationMode", "ExitConfigurationMode", "GetIntervalDecimal", "GetIntervalFraction", "GetShiftDecimal",
    "GetShiftFraction", "SetIntervalDecimal", "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction",
    "EvaluateDiscreteStates", "UpdateDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime",
    "SetContinuousStates", "GetContinuousStateDerivatives", "GetEventIndicators", "GetContinuousStates",
    "GetNominalsOfContinuousStates", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates", "EnterStepMode",
    "GetOutputDerivatives", "ActivateModelPartition",
)  # fmt: skip
"""What FMI 3.0 asks a library to have, and what this unit has nothing of: calls of them say so."""


def _nothing(kind: str) -> str:
    """Numbers of a type of which there are none."""
    return "".join(
        f"EXPORT fmi3Status fmi3{way}{kind}(void *i, const uint32_t *r, size_t count, {const}void *v, size_t n)\n"
        "{\n    (void)i, (void)r, (void)v, (void)n;\n    return count ? fmi3Error : fmi3OK;\n}\n"
        for way, const in (("Get", ""), ("Set", "const "))
    )


def _refused(name: str) -> str:
    return f'EXPORT fmi3Status fmi3{name}(void *i) {{ return say(i, fmi3Error, "fmi3{name} is not supported"); }}\n'
