#include "frame.h"

static uint32_t remainder_of[256];

void frame_prepare(void) {
    for (uint16_t byte = 0; byte < 256; byte++) {
        uint32_t r = byte;
        for (uint8_t bit = 0; bit < 8; bit++) r = (r >> 1) ^ (r & 1 ? 0xEDB88320UL : 0);
        remainder_of[byte] = r;
    }
}

uint32_t crc32_of(const uint8_t *bytes, uint16_t n) {
    uint32_t r = 0xFFFFFFFFUL;
    while (n--) r = (r >> 8) ^ remainder_of[(uint8_t)r ^ *bytes++];
    return ~r;
}

/* Decodes COBS in place, which only ever moves bytes forward; returns the length, 0 when malformed. */
static uint16_t unstuff(uint8_t *bytes, uint16_t n) {
    uint16_t in = 0, out = 0;
    while (in < n) {
        uint8_t code = bytes[in++];
        if (in + code - 1 > n) return 0;
        for (uint8_t i = 1; i < code; i++) bytes[out++] = bytes[in++];
        if (code < 0xFF && in < n) bytes[out++] = 0;
    }
    return out;
}

uint16_t frame_receive(receiver_t *receiver, uint8_t byte) {
    if (byte) {
        if (receiver->n < sizeof receiver->bytes) receiver->bytes[receiver->n++] = byte;
        else receiver->overflowed = 1;
        return 0;
    }
    uint16_t n = receiver->n;
    uint8_t overflowed = receiver->overflowed;
    receiver->n = 0;
    receiver->overflowed = 0;
    if (n == 0 && !overflowed) return 0; /* zeros between frames are allowed */
    n = overflowed ? 0 : unstuff(receiver->bytes, n);
    if (n > CRC_BYTES) {
        n -= CRC_BYTES;
        const uint8_t *end = receiver->bytes + n;
        uint32_t sent = end[0] | (uint32_t)end[1] << 8 | (uint32_t)end[2] << 16 | (uint32_t)end[3] << 24;
        if (sent == crc32_of(receiver->bytes, n)) return n;
    }
    receiver->dropped++;
    return 0;
}

uint16_t frame_make(uint8_t *payload, uint16_t n, uint8_t frame[FRAME_MOST]) {
    uint32_t crc = crc32_of(payload, n);
    for (uint8_t i = 0; i < CRC_BYTES; i++, crc >>= 8) payload[n++] = (uint8_t)crc;
    uint16_t out = 1, code_at = 0;
    for (uint16_t in = 0; in < n; in++) {
        if (payload[in]) {
            frame[out++] = payload[in];
        } else {
            frame[code_at] = (uint8_t)(out - code_at);
            code_at = out++;
        }
    }
    frame[code_at] = (uint8_t)(out - code_at);
    frame[out++] = 0;
    return out;
}
