//! What tools and the board itself need to know of ST's B-G431B-ESC1.

use super::{CodeMemory, SMALL_MOTORS, Tooling};
use crate::clock_switch;
use crate::motor::Motor;

/// The motor. Change it to what is connected: see the motor's and the supply's data sheets.
pub(crate) const MOTOR: Motor = Motor {
    torque_constant_nm_per_a: 0.05,
    resistance_ohm: 0.6,
    max_current_a: 5.0,
    supply_v: 12.0,
    counts_per_turn: 4096,
    pole_pairs: 7,
};

/// See [`Tooling`].
pub(crate) const TOOLING: Tooling = Tooling {
    clock_hz: clock_switch::CLOCK_HZ,
    tick_hz: 1_000,
    axes: 1,
    words: 640,
    memory: CodeMemory::Stm32G4,
    chip: Some("STM32G431CBUx"),
    variants: &[],
    interrupts: INTERRUPTS,
    motor: Some(MOTOR),
    scheme: SMALL_MOTORS,
};

const INTERRUPTS: &[(&str, i16)] = &[
    // Time.
    ("TIM3", 0),
    // Tick.
    ("CORDIC", 2),
    // Command line.
    ("USART2", 4),
    ("DMA1_CHANNEL1", 4),
    ("DMA1_CHANNEL2", 4),
    // Link.
    ("FDCAN1_IT0", 4),
    ("FDCAN1_IT1", 4),
    // Kept schemes.
    ("FLASH", 4),
    // Background.
    ("FMAC", 6),
];
