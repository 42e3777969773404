//! What tools and the board itself need to know of ST's B-G431B-ESC1.

use dimsart_core::limits::Sizes;
use drive::{Configuration, Encoder, Inverter, Joint, Limits};

use super::{CodeMemory, SMALL_MOTORS, ThreePhaseDrive, Tooling};
use crate::clock_switch;
use crate::current_loop::Scaling;
use crate::motor::Motor;

/// Motor, encoder and limits. Change them to what is connected: see the data sheets of motor and supply.
const CONFIGURATION: Configuration = Configuration {
    motor: drive::Motor {
        resistance_ohm: 0.6,
        direct_inductance_h: 2.5e-4,
        quadrature_inductance_h: 2.5e-4,
        // 0.05 N·m/A.
        flux_linkage_vs: 0.05 / (1.5 * 7.0),
        pole_pairs: 7,
        is_encoder_reversed: false,
        // Found anew after every start: an incremental encoder knows no angle then.
        encoder_offset_rad: 0.0,
    },
    limits: Limits {
        current_a: 5.0,
        trip_current_a: 10.0,
        least_bus_v: 8.0,
        most_bus_v: 28.0,
        derating_c: 80.0,
        trip_c: 100.0,
        speed_rad_per_s: 400.0,
        stall_s: 20.0,
    },
    bandwidth_rad_per_s: 6_283.0,
    aligning_current_a: 2.0,
    // As much as it brakes by itself when it is driven by a voltage.
    damping_nms_per_rad: 0.05 * 0.05 / 0.6,
    encoder: Encoder::Incremental { counts_per_turn: 4096 },
    joint: Joint { gear_ratio: 1.0, zero_rad: 0.0 },
    inverter: Inverter {
        period_s: 50e-6,
        // 0.8 us.
        dead_time_share: 0.016,
        dead_time_current_a: 0.3,
        // The lower switches have been on for 1.7 us when the phases are sampled: others saw amplifiers settle in 1.3 us.
        most_duty: 0.9,
    },
};
/// Motor and encoder, and what the board has for them.
pub(crate) const DRIVE: ThreePhaseDrive = ThreePhaseDrive { configuration: CONFIGURATION, scaling: SCALING };
/// By the board's schematic (ST UM2516) and what public firmware for it has: 3 mOhm, 64/7 of it behind the resistors and the
/// amplifier, pulled up to 0.129 V in front of it; 18 of 187 kOhm; a thermistor of 10 kOhm (B 3425 K) above 4.7 kOhm. Of a
/// reference of 3.3 V.
const SCALING: Scaling = Scaling {
    a_per_count: -3.3 / 4095.0 / (0.003 * 64.0 / 7.0),
    rest_counts: 2553.0,
    rest_tolerance: 200.0,
    v_per_count: 3.3 / 4095.0 * 187.0 / 18.0,
    temperature_c: THERMISTOR_C,
};

/// Of 10 kOhm (B 3425 K) above 4.7 kOhm, at every 128th count.
pub(crate) const THERMISTOR_C: &[f32; 33] = &[
    -60.0, -31.4, -18.3, -9.7, -3.0, 2.6, 7.6, 12.1, 16.3, 20.3, 24.1, 27.8, 31.5, 35.1, 38.7, 42.3, 46.0,
    49.8, 53.6, 57.7, 61.9, 66.5, 71.3, 76.6, 82.4, 89.0, 96.5, 105.5, 116.7, 131.6, 153.9, 196.6, 300.0,
];

/// The motor as schemes see it.
pub(crate) const MOTOR: Motor = Motor {
    torque_constant_nm_per_a: CONFIGURATION.motor.torque_constant_nm_per_a(),
    resistance_ohm: CONFIGURATION.motor.resistance_ohm,
    max_current_a: CONFIGURATION.limits.current_a,
    supply_v: 12.0,
    counts_per_turn: 4096,
    pole_pairs: CONFIGURATION.motor.pole_pairs,
};
const _: () = assert!(MOTOR.counts_per_turn as u32 == CONFIGURATION.encoder.counts_per_turn());

/// See [`Tooling`].
pub(crate) const TOOLING: Tooling = Tooling {
    clock_hz: clock_switch::CLOCK_HZ,
    tick_hz: 1_000,
    axes: 1,
    words: 480,
    sizes: Sizes::SMALL,
    memory: CodeMemory::Stm32G4,
    chip: Some("STM32G431CBUx"),
    modules: &["control", "teleoperation"],
    variants: &[],
    interrupts: INTERRUPTS,
    motor: Some(MOTOR),
    drive: Some(DRIVE),
    scheme: SMALL_MOTORS,
};

const INTERRUPTS: &[(&str, i16)] = &[
    // Current loop.
    ("ADC1_2", 0),
    // Time.
    ("TIM3", 1),
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
