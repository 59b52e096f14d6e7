/* The ATmega2560's firmware on simavr with a Furuta pendulum: quadrature edges in, SPI converter or PWM, and the enable
 * line out.
 *
 *     simrig atmega2560-analog.elf m_p=0.2 l_cg=0.15 ...        every number of furuta.h
 *     simrig atmega2560-pair.elf pair m_p=0.2 l_cg=0.15 ...     an H-bridge: the drive gets what its inputs say edge by
 *     simrig atmega2560-sign.elf sign m_p=0.2 l_cg=0.15 ...     edge, nothing while its enable line is low
 *
 * Virtual time in lockstep: a frame from the host starts it, and it stands still when the answer has left, so that
 * runs are the same to the last bit whatever else the machine does. A frame that the firmware will not answer, because
 * it was spoiled, takes no longer than its bytes do: who waits for an answer lets time pass by `run`. The name of the pty comes first on standard output.
 * Lines on standard input, each answered: those of mishap.h, and
 *     wrap CHANNEL V  the counter's own number, without that anything moved
 *     illegal         both phases of encoder 1 change at once
 *     reset           the processor starts anew, as after a dip of its supply; a resistor holds the enable line low
 *     hang            the processor stops in a loop with its interrupts off
 *     run TICKS       time passes without the host
 *     glitch STEPS    the converter puts out something else than it was commanded
 *     met             answers: converter as the enable line went up last [steps]
 *     pwm             answers, of the H-bridge's edges since it was last asked: shortest and longest time from one rise to
 *                     the next [cycles], cycles that it pushed forward, backward, and both ways at once
 *     state           answers: milliseconds, psi, psi', theta, theta', converter [steps], enable line, the longest
 *                     tick since it was last asked [cycles]
 * It ends with its standard input. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pty.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "avr_ioport.h"
#include "avr_spi.h"
#include "avr_uart.h"
#include "frame.h"
#include "furuta.h"
#include "mishap.h"
#include "sim_avr.h"
#include "sim_elf.h"

#define CLOCK 16000000
#define SLICE 800          /* cycles between two looks at plant and wire: 0.05 ms */
#define SLICES_PER_TICK 20
#define BYTES_PER_SLICE 5  /* 1 Mbaud */
#define EDGES_PER_SLICE 4  /* of one encoder, at most; its interrupt takes 110 cycles each time */
#define LONGEST_ANSWER(bytes) (10000 + 2 * (bytes)) /* slices; a law is looked at for 0.1 s */
#define WRITE_AND_UPDATE 0x03
#define RAM 0x800000

static avr_t *avr;
static avr_irq_t *to_uart, *phase[2][2];
static furuta_t plant;
static mishaps_t mishaps;
static long position[2];           /* as the edges so far say */
static uint32_t counters;          /* address of the firmware's counts */
static uint32_t tick_entry;        /* of its tick's interrupt */
static uint8_t spi[3];
static int spi_bytes, selected;
static int16_t converter;
static double pushed; /* over the last slice [steps] */
static int enabled;
static int16_t met; /* by the enable line as it went up [steps] */
static uint64_t slices;
static bool answered, uart_ready = true;
static uint8_t answer[4096];
static size_t answer_bytes;
static avr_cycle_count_t worst_tick;

/* The H-bridge: which way its inputs push, since when, and for how long in this slice and since it was asked for. */
enum { NONE, PAIR, SIGN };
static int bridge;
static uint32_t input[3];
static avr_cycle_count_t since, rose;
static int64_t pushes[2];
static struct { int64_t forward, backward, both, shortest, longest; } edges;
#define PWM_STEPS 800

static void push_until_now(void) {
    bool a = bridge == PAIR ? input[0] : input[0] && input[1], b = bridge == PAIR ? input[1] : input[0] && input[2];
    int64_t passed = (int64_t)(avr->cycle - since);
    since = avr->cycle;
    if (!enabled) return;
    if (a) pushes[0] += passed, edges.forward += passed;
    if (b) pushes[1] += passed, edges.backward += passed;
    if (a && b) edges.both += passed;
}
static void bridge_input(struct avr_irq_t *irq, uint32_t high, void *which) {
    (void)irq;
    intptr_t i = (intptr_t)which;
    if (input[i] == (high != 0)) return;
    push_until_now();
    input[i] = high != 0;
    if (!high || (bridge == SIGN && i)) return;
    int64_t period = (int64_t)(avr->cycle - rose);
    rose = avr->cycle;
    if (!edges.shortest || period < edges.shortest) edges.shortest = period;
    if (period > edges.longest) edges.longest = period;
}

static void sent(struct avr_irq_t *irq, uint32_t byte, void *unused) {
    (void)irq, (void)unused;
    static receiver_t as_host;
    answered |= frame_receive(&as_host, (uint8_t)byte) > 0;
    if (answer_bytes < sizeof answer) answer[answer_bytes++] = over_the_wire(&mishaps, (uint8_t)byte);
}
static void uart_on(struct avr_irq_t *irq, uint32_t value, void *unused) {
    (void)irq, (void)value, (void)unused;
    uart_ready = true;
}
static void uart_off(struct avr_irq_t *irq, uint32_t value, void *unused) {
    (void)irq, (void)value, (void)unused;
    uart_ready = false;
}
static void spi_byte(struct avr_irq_t *irq, uint32_t byte, void *unused) {
    (void)irq, (void)unused;
    if (selected && spi_bytes < 3) spi[spi_bytes++] = (uint8_t)byte;
}
static void sync_line(struct avr_irq_t *irq, uint32_t high, void *unused) {
    (void)irq, (void)unused;
    if (high && selected && spi_bytes == 3 && spi[0] == WRITE_AND_UPDATE) converter = (int16_t)(spi[1] << 8 | spi[2]);
    selected = !high;
    if (selected) spi_bytes = 0;
}
static void enable_line(struct avr_irq_t *irq, uint32_t high, void *unused) {
    (void)irq, (void)unused;
    if (bridge) push_until_now();
    if (high && !enabled) met = converter;
    enabled = high != 0;
    plant.running |= enabled;
}

static void show(int channel) {
    static const uint8_t gray[4] = {0, 1, 3, 2};
    uint8_t now = gray[position[channel] & 3];
    avr_raise_irq(phase[channel][0], now & 1);
    avr_raise_irq(phase[channel][1], now >> 1);
}

static void run_until(avr_cycle_count_t cycle) {
    while (avr->cycle < cycle) {
        avr_cycle_count_t entered = avr->cycle;
        bool ticks = avr->pc == tick_entry;
        uint32_t sp = avr->data[R_SPL] | avr->data[R_SPH] << 8;
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) fprintf(stderr, "the processor has stopped\n"), exit(1);
        /* a tick lasts until the stack is where it was before its interrupt */
        static avr_cycle_count_t began;
        static uint32_t depth;
        if (ticks && !began) began = entered, depth = sp;
        else if (began && (uint32_t)(avr->data[R_SPL] | avr->data[R_SPH] << 8) > depth) {
            if (avr->cycle - began > worst_tick) worst_tick = avr->cycle - began;
            began = 0;
        }
    }
}

/* Edges of an encoder in a slice: the first at a share of it, the others as far apart as the speed says. */
typedef struct { long left; int way; double at, apart; } edges_t;
static edges_t edges_of(int i, double before) {
    long steps = encoder_shows(&mishaps.encoder[i], furuta_counts(&plant, i)) - position[i];
    edges_t edges = {labs(steps), steps < 0 ? -1 : 1, 0, 0};
    if (edges.left > EDGES_PER_SLICE) edges.left = EDGES_PER_SLICE;
    double from = before * plant.counts[i], moved = plant.x[2 * i] * plant.counts[i] - from;
    /* what an encoder that is not sound shows has no such times, nor what is made up for from an earlier slice */
    if (mishaps.encoder[i].scale != 1 || edges.left > fabs(moved) + 1) moved = 0;
    edges.apart = moved ? 1 / fabs(moved) : 1.0 / (double)(edges.left + 1);
    edges.at = edges.apart;
    if (moved) edges.at *= moved > 0 ? floor(from + 0.5) + 0.5 - from : from - floor(from + 0.5) + 0.5;
    return edges;
}

static void slice(void) {
    static const double dt = (double)SLICE / CLOCK;
    if (bridge) {
        push_until_now();
        pushed = (double)(pushes[0] - pushes[1]) * PWM_STEPS / SLICE;
        converter = (int16_t)lround(pushed);
        memset(pushes, 0, sizeof pushes);
    } else pushed = converter;
    double before[2] = {plant.x[0], plant.x[2]};
    mishaps_move(&mishaps, &plant, enabled, pushed, dt);
    edges_t turns[2];
    for (int i = 0; i < 2; i++) turns[i] = edges_of(i, before[i]);
    avr_cycle_count_t start = (avr_cycle_count_t)slices * SLICE;
    for (;;) {
        int i = turns[0].left && (!turns[1].left || turns[0].at <= turns[1].at) ? 0 : 1;
        if (!turns[i].left) break;
        run_until(start + (avr_cycle_count_t)(SLICE * turns[i].at));
        position[i] += turns[i].way;
        turns[i].at += turns[i].apart;
        turns[i].left--;
        show(i);
    }
    run_until(start + SLICE);
    slices++;
}

static uint32_t symbol(const elf_firmware_t *elf, const char *name) {
    for (uint32_t i = 0; i < elf->symbolcount; i++)
        if (!strcmp(elf->symbol[i]->symbol, name)) return elf->symbol[i]->addr;
    fprintf(stderr, "the firmware has no %s\n", name);
    exit(1);
}

static void hang(void) {
    avr->flash[avr->flashend - 1] = 0xFF; /* rjmp .-2, where no program is */
    avr->flash[avr->flashend] = 0xCF;
    avr->pc = avr->flashend - 1;
    avr->sreg[S_I] = 0;
}

static void obey(const char *line) {
    long a, b;
    const char *said = "ok";
    if (sscanf(line, "wrap %ld %ld", &a, &b) == 2 && a >= 0 && a < 2) {
        uint32_t value = (uint32_t)b;
        memcpy(avr->data + counters + 4 * a, &value, sizeof value); /* both ends store the least byte first */
    } else if (!strcmp(line, "illegal")) {
        position[0] += 2;
        mishaps.encoder[0].shown += 2;
        show(0);
    } else if (sscanf(line, "glitch %ld", &a) == 1) {
        converter = (int16_t)a;
    } else if (!strcmp(line, "met")) {
        printf("%d\n", met);
        fflush(stdout);
        return;
    } else if (!strcmp(line, "pwm")) {
        push_until_now();
        printf("%lld %lld %lld %lld %lld\n", (long long)edges.shortest, (long long)edges.longest,
               (long long)edges.forward, (long long)edges.backward, (long long)edges.both);
        memset(&edges, 0, sizeof edges);
        fflush(stdout);
        return;
    } else if (!strcmp(line, "reset")) {
        if (bridge) push_until_now();
        enabled = 0;
        avr_reset(avr);
    } else if (!strcmp(line, "hang")) {
        hang();
    } else if (sscanf(line, "run %ld", &a) == 1) {
        while (a-- > 0)
            for (int i = 0; i < SLICES_PER_TICK; i++) slice();
        answer_bytes = 0; /* nobody listened */
    } else if (!strcmp(line, "state")) {
        printf("%g %.17g %.17g %.17g %.17g %d %d %d\n", (double)slices / SLICES_PER_TICK, plant.x[0], plant.x[1],
               plant.x[2], plant.x[3], converter, enabled, (int)worst_tick);
        worst_tick = 0;
        fflush(stdout);
        return;
    } else if (!mishaps_line(&mishaps, &plant, line)) {
        printf("not understood: ");
        said = line;
    }
    puts(said);
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

/* One frame to the firmware, and time until its answer has left, if it is one that has an answer. */
static void hand_over(int wire, const uint8_t *frame, size_t n) {
    static receiver_t as_firmware;
    bool sound = false;
    for (size_t i = 0; i < n; i++) sound = frame_receive(&as_firmware, frame[i]) >= 2;
    size_t fed = 0;
    answered = false;
    for (size_t left = LONGEST_ANSWER(n); left > 0 && !answered;) {
        for (int i = 0; i < BYTES_PER_SLICE && fed < n && uart_ready; i++) avr_raise_irq(to_uart, frame[fed++]);
        slice();
        if (fed == n) left = sound ? left - 1 : 0;
    }
    for (size_t i = 0; i < answer_bytes;) {
        ssize_t written = write(wire, answer + i, answer_bytes - i);
        if (written <= 0) break;
        i += (size_t)written;
    }
    answer_bytes = 0;
}

static void listen_to_wire(int wire) {
    static uint8_t bytes[4096];
    static size_t n;
    ssize_t got = read(wire, bytes + n, sizeof bytes - n);
    if (got <= 0) return;
    for (ssize_t i = 0; i < got; i++) bytes[n + i] = over_the_wire(&mishaps, bytes[n + i]);
    n += (size_t)got;
    uint8_t *frame = bytes, *end;
    for (;;) {
        uint8_t *from = frame, *last = bytes + n;
        while (from < last && !*from) from++; /* zeros in front go with a frame */
        if (!(end = memchr(from, 0, (size_t)(last - from)))) break;
        if (!mishaps.cut) hand_over(wire, frame, (size_t)(end + 1 - frame));
        frame = end + 1;
    }
    n -= (size_t)(frame - bytes);
    if (n == sizeof bytes) n = 0;
    memmove(bytes, frame, n);
}

static avr_irq_t *pin(char port, int bit) { return avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), bit); }

/* Standard output belongs to the answers. */
static void log_errors(avr_t *unused, const int level, const char *format, va_list values) {
    (void)unused;
    if (level <= LOG_ERROR) vfprintf(stderr, format, values);
}

static void make_board(const char *file) {
    elf_firmware_t elf;
    memset(&elf, 0, sizeof elf);
    avr_global_logger_set(log_errors);
    if (elf_read_firmware(file, &elf)) exit(1);
    elf.frequency = CLOCK;
    avr = avr_make_mcu_by_name("atmega2560");
    if (!avr || avr_init(avr)) exit(1);
    avr_load_firmware(avr, &elf);
    counters = symbol(&elf, "encoder_counts") % RAM;
    tick_entry = symbol(&elf, "__vector_17"); /* TIMER1_COMPA */

    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    to_uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), uart_on, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), uart_off, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_SPI_GETIRQ(0), SPI_IRQ_OUTPUT), spi_byte, NULL);
    avr_irq_register_notify(pin('B', 0), sync_line, NULL);
    avr_irq_register_notify(pin('G', 5), enable_line, NULL);
    for (intptr_t i = 0; bridge && i < 3; i++) avr_irq_register_notify(pin('H', 4 + (int)i), bridge_input, (void *)i);
    for (int i = 0; i < 4; i++) phase[i / 2][i % 2] = pin('B', 4 + i);
}

int main(int count, char **arguments) {
    if (count < 2) return fprintf(stderr, "simrig atmega2560-analog.elf name=value ...\n"), 2;
    furuta_prepare(&plant);
    for (int i = 2; i < count; i++)
        if (!strcmp(arguments[i], "pair")) bridge = PAIR;
        else if (!strcmp(arguments[i], "sign")) bridge = SIGN;
        else if (!furuta_set(&plant, arguments[i])) return fprintf(stderr, "%s is not understood\n", arguments[i]), 2;
    if (furuta_missing(&plant)) return fprintf(stderr, "%s is missing\n", furuta_missing(&plant)), 2;
    mishaps_prepare(&mishaps, &plant);
    frame_prepare();
    make_board(arguments[1]);

    int wire, host_end; /* kept open, so that a host may come and go */
    char name[128];
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    if (openpty(&wire, &host_end, name, &raw, NULL)) return perror("openpty"), 1;
    fcntl(wire, F_SETFL, O_NONBLOCK);
    for (int i = 0; i < 2; i++) show(i);
    for (int i = 0; i < 3 * SLICES_PER_TICK; i++) slice(); /* until the firmware is up */
    printf("%s\n", name);
    fflush(stdout);

    struct pollfd ends[] = {{wire, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
    for (;;) {
        if (poll(ends, 2, -1) <= 0) continue;
        if (ends[1].revents) listen_to_lines();
        if (ends[0].revents & POLLIN) listen_to_wire(wire);
    }
}
