//! Copies code into the CCM SRAM (`boards/ccm.x`, `boards/ccm-current-loop.x`), before anything else runs.

#![expect(unsafe_code, reason = "it runs before RAM holds anything, as what cortex-m-rt fills RAM by")]

use core::arch::global_asm;

// SAFETY: it writes to where the linker has put nothing but this code, in whole words, and calls nothing, for `memcpy`
// itself is among what it copies.
global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =__sccm",
    "ldr r1, =__eccm",
    "ldr r2, =__siccm",
    "1: cmp r0, r1",
    "beq 2f",
    "ldm r2!, {{r3}}",
    "stm r0!, {{r3}}",
    "b 1b",
    "2: dsb",
    "isb",
    "bx lr",
    ".ltorg",
    ".size __pre_init, . - __pre_init",
);
