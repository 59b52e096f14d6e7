/* Frames on the wire: 0x00 COBS(payload | CRC32 of it, least byte first) 0x00. The CRC is that of zlib. The zero in
 * front ends whatever noise came before, so that noise between two frames costs neither. */
#ifndef FRAME_H
#define FRAME_H
#include <stdint.h>

#define PAYLOAD_MOST 250 /* with its CRC one COBS block, so that every frame is three bytes longer than that */
#define CRC_BYTES 4
#define FRAME_MOST (PAYLOAD_MOST + CRC_BYTES + 3)

/* Takes a frame apart while it comes, so that nothing is left to do at its end. */
typedef struct {
    uint8_t bytes[PAYLOAD_MOST + CRC_BYTES];
    uint16_t n;
    uint32_t remainder;
    uint8_t left;      /* of a block of COBS */
    uint8_t full;      /* no zero follows that block */
    uint8_t begun, overflowed;
    uint16_t dropped; /* frames that were too long, malformed or corrupted */
} receiver_t;

void frame_prepare(void); /* the CRC's table; once, before anything else */
uint32_t crc32_of(const uint8_t *bytes, uint16_t n);

/* Length of the payload, now in `bytes`, when this byte completes a sound frame; else 0. */
uint16_t frame_receive(receiver_t *receiver, uint8_t byte);

/* Frame of a payload, which needs room for CRC_BYTES more; returns the frame's length. */
uint16_t frame_make(uint8_t *payload, uint16_t n, uint8_t frame[FRAME_MOST]);
#endif
