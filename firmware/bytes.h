/* Numbers as they go over the wire, least byte first. */
#ifndef BYTES_H
#define BYTES_H
#include <stdint.h>
#include <string.h>

static inline uint16_t get_u16(const uint8_t *b) { return (uint16_t)(b[0] | (uint16_t)b[1] << 8); }
static inline uint32_t get_u32(const uint8_t *b) { return get_u16(b) | (uint32_t)get_u16(b + 2) << 16; }
static inline void put_u16(uint8_t *b, uint16_t v) { b[0] = (uint8_t)v, b[1] = (uint8_t)(v >> 8); }
static inline void put_u32(uint8_t *b, uint32_t v) { put_u16(b, (uint16_t)v), put_u16(b + 2, (uint16_t)(v >> 16)); }

static inline float get_float(const uint8_t *b) {
    uint32_t bits = get_u32(b);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static inline void put_float(uint8_t *b, float v) {
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    put_u32(b, bits);
}
#endif
