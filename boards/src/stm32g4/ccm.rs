//! Copies code to the CCM SRAM (`boards/ccm.x`, `boards/ccm-current-loop.x`) at the very start.

#![expect(unsafe_code, reason = "runs before RAM is initialised, like cortex-m-rt's start code")]

use core::arch::global_asm;

// SAFETY: writes whole words to memory that the linker reserved for this code, and calls nothing, because
// `memcpy` itself is copied.
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
