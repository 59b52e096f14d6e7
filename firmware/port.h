/* What a board gives to the rig's core: encoders in, command and enable line out, a wire, a lock. */
#ifndef PORT_H
#define PORT_H
#include <stdbool.h>
#include <stdint.h>

#define CHANNELS 2

extern const char port_name[];          /* of the board, as a person would call it */
extern bool port_virtual;               /* time passes only while samples are exchanged */
extern const uint16_t port_period;      /* of the tick [us] */
extern const uint16_t port_steps;       /* of the converter from zero to full scale */

uint32_t port_counts(uint8_t channel);  /* of an encoder; runs over at 2^32 */
uint16_t port_illegal(void);            /* quadrature transitions so far that no encoder makes */
void port_command(int16_t steps);       /* to the converter */
bool port_settled(void);                /* the converter puts out what it was last commanded */
void port_enable(bool on);              /* power stage */
void port_send(const uint8_t *bytes, uint16_t n);
uint8_t port_reset_cause(void);         /* as the processor says it */
uint32_t port_boot(void);               /* a number that hardly any two starts of the board share */

/* No tick between the two. */
uint32_t port_lock(void);
void port_unlock(uint32_t before);
#endif
