/* Frames on the wire: COBS(payload | CRC32 of it, least byte first) 0x00. The CRC is that of zlib. */
#ifndef FRAME_H
#define FRAME_H
#include <stdint.h>

#define PAYLOAD_MOST 250 /* with its CRC one COBS block, so that every frame is two bytes longer than that */
#define CRC_BYTES 4
#define FRAME_MOST (PAYLOAD_MOST + CRC_BYTES + 2)

typedef struct {
    uint8_t bytes[FRAME_MOST];
    uint16_t n;
    uint8_t overflowed;
    uint16_t dropped; /* frames that were too long, malformed or corrupted */
} receiver_t;

void frame_prepare(void); /* the CRC's table; once, before anything else */
uint32_t crc32_of(const uint8_t *bytes, uint16_t n);

/* Length of the payload, now in `bytes`, when this byte completes a sound frame; else 0. */
uint16_t frame_receive(receiver_t *receiver, uint8_t byte);

/* Frame of a payload, which needs room for CRC_BYTES more; returns the frame's length. */
uint16_t frame_make(uint8_t *payload, uint16_t n, uint8_t frame[FRAME_MOST]);
#endif
