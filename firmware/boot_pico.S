/* What the RP2040's boot ROM copies from the flash's first 256 bytes and runs: reads the flash by its plain command 03h,
 * at a fourth of the clock, which every flash chip understands, and goes on to the program's vectors behind it. uf2.py
 * puts the checksum that the ROM wants into the last 4 bytes. */
    .cpu cortex-m0plus
    .thumb
    .section .boot, "ax"
    ldr r3, =0x18000000     /* XIP_SSI */
    movs r1, #0
    str r1, [r3, #0x08]     /* SSIENR: off */
    movs r1, #4
    str r1, [r3, #0x14]     /* BAUDR */
    ldr r1, =0x001f0300     /* CTRLR0: frames of 32 bits, EEPROM read */
    str r1, [r3, #0x00]
    ldr r1, =0x03000218     /* SPI_CTRLR0: command 03h of 8 bits, address of 24 */
    ldr r0, =0x180000f4
    str r1, [r0]
    movs r1, #0
    str r1, [r3, #0x04]     /* CTRLR1: one frame */
    movs r1, #1
    str r1, [r3, #0x08]     /* SSIENR: on */
    ldr r0, =0x10000100     /* vectors of the program */
    ldr r1, =0xe000ed08     /* VTOR */
    str r0, [r1]
    ldmia r0, {r0, r1}
    msr msp, r0
    bx r1
    .ltorg
