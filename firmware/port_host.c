/* The firmware as a process on Linux, its wire a pty whose name it prints: for tests without a board.
 *
 *     rig-host                            1 kHz by the clock on the wall
 *     rig-host lockstep                   ticks for every exchange, and none else: runs are the same to the last bit
 *     rig-host ... m_p=0.2 l_cg=0.15 ...  a Furuta pendulum on it (furuta.h); without one the encoders stand still
 *
 * Lines on standard input, each answered on standard output: those of mishap.h, and
 *     counts A B      the encoders' counters, where no pendulum is simulated
 *     wrap CHANNEL V  the counter's own number, without that anything moved
 *     illegal         a quadrature transition that no encoder makes
 *     overrun         a tick comes due during the one before
 *     glitch STEPS    the converter puts out something else than it was commanded
 *     reset           the board starts anew, as after a dip of its supply
 *     run TICKS       time passes without the host
 *     skip TICKS      the same, but of these ticks only the last one comes
 *     state           answers: tick, psi, psi', theta, theta', command [steps], enable line, mode
 *     power           answers: tick, the last one with a command under power, the last one with its power stage on, and
 *                     most ticks that came at once, as where others keep this process from its time
 * It ends with its standard input. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "furuta.h"
#include "mishap.h"
#include "port.h"
#include "rig.h"

#define PERIOD_NS 1000000L
#define SUBSTEPS 10

const char port_name[] = "upright firmware, host";
bool port_virtual;
const uint16_t port_period = PERIOD_NS / 1000;
const uint16_t port_steps = 32768;

static int wire;
static bool simulated, enabled;
static furuta_t plant;
static mishaps_t mishaps;
static uint32_t counter[CHANNELS];
static uint16_t illegal;
static int16_t command;
static uint32_t tick, passed; /* of the board, and since its process began */
static uint32_t driven, powered, at_once; /* as `power` answers */

uint32_t port_counts(uint8_t channel) { return counter[channel]; }
uint16_t port_illegal(void) { return illegal; }
void port_command(int16_t steps) { command = steps; }
bool port_settled(void) { return true; }
void port_enable(bool on) {
    enabled = on;
    plant.running |= on;
}
uint8_t port_reset_cause(void) { return 0; }
uint32_t port_boot(void) { return port_virtual ? 0 : (uint32_t)time(NULL) ^ (uint32_t)getpid() << 16; }
uint32_t port_lock(void) { return 0; } /* tick and frames take turns in one thread */
void port_unlock(uint32_t before) { (void)before; }

void port_send(const uint8_t *bytes, uint16_t n) {
    uint8_t sent[512];
    for (uint16_t i = 0; i < n; i++) sent[i] = over_the_wire(&mishaps, bytes[i]);
    for (uint16_t i = 0; i < n;) {
        ssize_t written = write(wire, sent + i, (size_t)(n - i));
        if (written <= 0) return; /* nobody reads, and a rig does not wait for its host */
        i = (uint16_t)(i + written);
    }
}

static void pass(uint32_t ticks, uint16_t late) {
    if (enabled) powered = passed + ticks;
    if (enabled && command) driven = powered;
    if (ticks > at_once) at_once = ticks;
    for (uint32_t i = 0; simulated && i < ticks * SUBSTEPS; i++)
        mishaps_move(&mishaps, &plant, enabled, command, 1e-9 * PERIOD_NS / SUBSTEPS);
    static long shown[CHANNELS];
    for (int i = 0; simulated && i < CHANNELS; i++) {
        long before = shown[i];
        shown[i] = encoder_shows(&mishaps.encoder[i], furuta_counts(&plant, i));
        counter[i] += (uint32_t)(shown[i] - before); /* on from wherever a wrap has put it */
    }
    passed += ticks;
    rig_tick(tick += ticks, late);
    rig_poll();
}

static void obey(const char *line) {
    long a, b;
    if (sscanf(line, "counts %ld %ld", &a, &b) == 2 && !simulated) {
        counter[0] = (uint32_t)a;
        counter[1] = (uint32_t)b;
    } else if (sscanf(line, "wrap %ld %ld", &a, &b) == 2 && a >= 0 && a < CHANNELS) {
        counter[a] = (uint32_t)b;
    } else if (!strcmp(line, "illegal")) {
        illegal++;
    } else if (sscanf(line, "glitch %ld", &a) == 1) {
        command = (int16_t)a;
    } else if (!strcmp(line, "reset")) {
        tick = 0;
        rig_reset();
    } else if (!strcmp(line, "overrun")) {
        rig_overrun();
    } else if (sscanf(line, "run %ld", &a) == 1 && port_virtual) {
        while (a-- > 0) pass(1, 0);
    } else if (sscanf(line, "skip %ld", &a) == 1 && port_virtual && a > 0) {
        pass((uint32_t)a, 0);
    } else if (!strcmp(line, "power")) {
        printf("%u %u %u %u\n", passed, driven, powered, at_once);
        fflush(stdout);
        return;
    } else if (!strcmp(line, "state")) {
        printf("%u %.17g %.17g %.17g %.17g %d %d %d\n", passed, plant.x[0], plant.x[1], plant.x[2], plant.x[3], command,
               enabled, rig_mode());
        fflush(stdout);
        return;
    } else if (!mishaps_line(&mishaps, &plant, line)) {
        printf("not understood: %s\n", line);
        fflush(stdout);
        return;
    }
    puts("ok");
    fflush(stdout);
}

static void listen_to_lines(void) {
    static char text[256];
    static size_t n;
    ssize_t got = read(STDIN_FILENO, text + n, sizeof text - 1 - n);
    if (got <= 0) exit(0);
    n += (size_t)got;
    text[n] = 0;
    char *line = text, *end;
    for (; (end = strchr(line, '\n')); line = end + 1) {
        *end = 0;
        obey(line);
    }
    n = strlen(line);
    if (n == sizeof text - 1) n = 0;
    memmove(text, line, n);
}

static void listen_to_wire(void) {
    uint8_t bytes[512];
    ssize_t n = read(wire, bytes, sizeof bytes);
    for (ssize_t i = 0; i < n; i++) {
        uint8_t byte = over_the_wire(&mishaps, bytes[i]);
        if (mishaps.cut) continue;
        rig_receive(byte);
        while (port_virtual && rig_waiting()) pass(1, 0);
    }
}

static int64_t nanoseconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}

int main(int count, char **arguments) {
    furuta_prepare(&plant);
    for (int i = 1; i < count; i++) {
        if (!strcmp(arguments[i], "lockstep")) port_virtual = true;
        else if (furuta_set(&plant, arguments[i])) simulated = true;
        else return fprintf(stderr, "%s is not understood\n", arguments[i]), 2;
    }
    if (simulated && furuta_missing(&plant)) return fprintf(stderr, "%s is missing\n", furuta_missing(&plant)), 2;
    mishaps_prepare(&mishaps, &plant);

    int host_end; /* kept open, so that a host may come and go */
    char name[128];
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    if (openpty(&wire, &host_end, name, &raw, NULL)) return perror("openpty"), 1;
    fcntl(wire, F_SETFL, O_NONBLOCK);
    rig_reset();
    printf("%s\n", name);
    fflush(stdout);

    struct pollfd ends[] = {{wire, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
    int64_t start = nanoseconds();
    for (;;) {
        struct timespec wait = {0, 0}, *until_tick = port_virtual ? NULL : &wait;
        if (!port_virtual) {
            int64_t since = nanoseconds() - start - (int64_t)passed * PERIOD_NS;
            if (since >= PERIOD_NS) {
                uint32_t ticks = (uint32_t)(since / PERIOD_NS);
                int64_t late = since % PERIOD_NS / 1000;
                pass(ticks, (uint16_t)late);
                continue;
            }
            wait.tv_nsec = PERIOD_NS - since;
        }
        if (ppoll(ends, 2, until_tick, NULL) <= 0) continue;
        if (ends[1].revents) listen_to_lines();
        if (ends[0].revents & POLLIN) listen_to_wire();
    }
}
