/* As much of Arduino's core as an exported sketch calls, on a board whose time and pins a test moves. */
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>
#define F(text) text
#define __FlashStringHelper char
enum { LOW, HIGH, INPUT_PULLUP, OUTPUT, CHANGE };
static unsigned long clock_us;
static int level[64], output[64], duty, writes;
static void (*handler[64])();
static std::string typed, printed;
static unsigned long micros() { return clock_us; }
static int digitalRead(int pin) { return level[pin]; }
static void digitalWrite(int pin, int high) { output[pin] = high; }
static void pinMode(int, int) {}
static void analogWrite(int, int value) { duty = value, writes++; }
static int digitalPinToInterrupt(int pin) { return pin; }
static void attachInterrupt(int pin, void (*isr)(), int) { handler[pin] = isr; }
static void noInterrupts() {}
static void interrupts() {}
struct Port {
    void begin(long) {}
    int available() { return (int)typed.size(); }
    int read() {
        int c = typed[0];
        typed.erase(0, 1);
        return c;
    }
    void print(const char *text) { printed += text; }
    void println(const char *text) { printed += std::string(text) + "\n"; }
    void println(long n) { printed += std::to_string(n) + "\n"; }
};
static Port Serial;
