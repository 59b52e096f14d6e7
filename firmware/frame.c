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

/* Of a payload with its own CRC behind it, whatever the payload is. */
#define REMAINDER_OF_SOUND 0xDEBB20E3UL

static void take(receiver_t *receiver, uint8_t byte) {
    if (receiver->n == sizeof receiver->bytes) {
        receiver->overflowed = 1;
        return;
    }
    receiver->bytes[receiver->n++] = byte;
    receiver->remainder = (receiver->remainder >> 8) ^ remainder_of[(uint8_t)receiver->remainder ^ byte];
}

uint16_t frame_receive(receiver_t *receiver, uint8_t byte) {
    if (byte) {
        if (receiver->left) {
            receiver->left--;
            take(receiver, byte);
            return 0;
        }
        if (!receiver->begun) {
            receiver->begun = 1;
            receiver->remainder = 0xFFFFFFFFUL;
        } else if (!receiver->full) {
            take(receiver, 0);
        }
        receiver->left = byte - 1;
        receiver->full = byte == 0xFF;
        return 0;
    }
    if (!receiver->begun) return 0; /* zeros between frames are allowed */
    uint16_t n = receiver->n;
    uint8_t spoiled = receiver->overflowed || receiver->left || receiver->remainder != REMAINDER_OF_SOUND;
    receiver->n = 0;
    receiver->begun = receiver->left = receiver->overflowed = 0;
    if (!spoiled && n > CRC_BYTES) return n - CRC_BYTES;
    receiver->dropped++;
    return 0;
}

uint16_t frame_make(uint8_t *payload, uint16_t n, uint8_t frame[FRAME_MOST]) {
    uint32_t crc = crc32_of(payload, n);
    for (uint8_t i = 0; i < CRC_BYTES; i++, crc >>= 8) payload[n++] = (uint8_t)crc;
    uint16_t out = 2, code_at = 1;
    frame[0] = 0;
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
