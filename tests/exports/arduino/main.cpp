/* The sketch on a board that does what standard input says, a line each:
 *     run US        time passes, loop by loop of 50 us; answers: samples taken, enable, duty, way
 *     stall US      the loop does not come for so long
 *     turn I N      encoder I by N edges, an interrupt each
 *     jump I        both channels of encoder I change at once
 *     type TEXT     over the serial monitor
 *     button 0|1    closed, open
 *     printed       what the sketch has printed since */
#include "Arduino.h"
#include "law.ino"

#include <iostream>
#include <sstream>

static long at[2];
static void phases(int i) {
    static const int gray[4] = {0, 1, 3, 2};
    int now = gray[at[i] & 3];
    level[ENCODER_PINS[i][0]] = now & 1;
    level[ENCODER_PINS[i][1]] = now >> 1;
}
static void edge(int i, int steps) {
    at[i] += steps;
    phases(i);
    handler[ENCODER_PINS[i][0]]();
}

int main() {
    for (int i = 0; i < LAW_READINGS; i++) phases(i);
    setup();
    std::string line, what;
    while (std::getline(std::cin, line)) {
        std::istringstream words(line);
        long a = 0, b = 0;
        words >> what;
        if (what == "type") {
            std::string text;
            words >> text;
            typed += text + "\n";
        } else {
            words >> a >> b;
        }
        if (what == "run") {
            int before = writes;
            for (long us = 0; us < a; us += 50, clock_us += 50) loop();
            std::cout << writes - before << " " << output[ENABLE_PIN] << " " << duty << " "
                      << output[FORWARD_PIN] - output[BACKWARD_PIN] << std::endl;
        } else if (what == "printed") {
            std::cout << printed << "." << std::endl;
            printed.clear();
        } else if (what == "stall") {
            clock_us += a;
        } else if (what == "turn") {
            for (long k = 0; k < (b < 0 ? -b : b); k++) edge((int)a, b < 0 ? -1 : 1);
        } else if (what == "jump") {
            edge((int)a, 2);
        } else if (what == "button") {
            level[STOP_PIN] = (int)a;
        }
    }
}
