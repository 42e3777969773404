//! What tools and the board itself need to know of ST's NUCLEO-G474RE.

use dimsart_core::limits::Sizes;

use super::{CodeMemory, MODULE_GROUPS, SMALL_MOTORS, Tooling};
use crate::clock_switch;
#[cfg(all(target_os = "none", feature = "moteus"))]
use crate::moteus::Moteus;
use crate::motor::Motor;

/// The motor of every axis. Change it to what is connected: see the motor's and the supply's data sheets.
pub(crate) const MOTOR: Motor = Motor {
    torque_constant_nm_per_a: 0.05,
    resistance_ohm: 1.0,
    max_current_a: 2.0,
    supply_v: 12.0,
    counts_per_turn: 4096,
    pole_pairs: 1,
};

/// With feature `moteus`, the drives of the axes. Change them to what is connected: see their `id.id`, `servo.max_current_A`
/// and `servo.max_velocity`.
#[cfg(all(target_os = "none", feature = "moteus"))]
pub(crate) const MOTEUS: Moteus<{ TOOLING.axes }> = Moteus {
    host: 0,
    ids: [1, 2, 3],
    timeout_s: 0.02,
    missing_ticks: 3,
    most_torque_nm: 1.0,
    most_speed_rad_per_s: 100.0,
}
.checked();

/// See [`Tooling`].
pub(crate) const TOOLING: Tooling = Tooling {
    clock_hz: clock_switch::CLOCK_HZ,
    tick_hz: 1_000,
    axes: 3,
    words: 3_072,
    sizes: Sizes::BOARD,
    memory: CodeMemory::Stm32G4,
    chip: Some("STM32G474RETx"),
    modules: &MODULE_GROUPS,
    variants: &["classic-can", "uart-link", "measure", "by-hand", "auth", "moteus", "ihm08m1"],
    interrupts: INTERRUPTS,
    motor: Some(MOTOR),
    drive: None,
    scheme: SMALL_MOTORS,
};

/// One without a three-phase motor has no `ADC1_2`, one without CAN no `FDCAN1`, one with it no `USART3` with its DMA; one whose tick asks drives has those of `FDCAN1`
/// off.
const INTERRUPTS: &[(&str, i16)] = &[
    // Current loop.
    ("ADC1_2", 0),
    // Time.
    ("TIM5", 1),
    // Tick.
    ("CORDIC", 2),
    // Command line.
    ("LPUART1", 4),
    ("DMA1_CHANNEL1", 4),
    ("DMA1_CHANNEL2", 4),
    // Link.
    ("FDCAN1_IT0", 4),
    ("FDCAN1_IT1", 4),
    ("USART3", 4),
    ("DMA1_CHANNEL3", 4),
    ("DMA1_CHANNEL4", 4),
    // Kept schemes.
    ("FLASH", 4),
    // Background.
    ("FMAC", 6),
];
