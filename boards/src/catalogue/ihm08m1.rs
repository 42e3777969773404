//! What tools and the board itself need to know of ST's X-NUCLEO-IHM08M1 on a NUCLEO-G474RE.

use drive::{Configuration, Encoder, Inverter, Joint, Limits};

use super::ThreePhaseDrive;
use super::b_g431b_esc1::THERMISTOR_C;
use crate::current_loop::Scaling;

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
        // Of an absolute encoder; that of an incremental one is found anew after every start.
        encoder_offset_rad: 0.0,
    },
    limits: Limits {
        current_a: 5.0,
        trip_current_a: 10.0,
        // The shield's own, and less than it takes.
        least_bus_v: 10.0,
        most_bus_v: 45.0,
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
        // The lower switches have been on for 1.7 us when the phases are sampled.
        most_duty: 0.9,
    },
};
/// Motor and encoder, and what the shield has for them.
pub const DRIVE: ThreePhaseDrive = ThreePhaseDrive { configuration: CONFIGURATION, scaling: SCALING };
/// 10 mOhm, 5.18 of it behind the shield's amplifiers, which are at 1.71 V without current; 9.31 of 178.31 kOhm. Sources:
/// `nucleo_g474re/ihm08m1.rs`.
const SCALING: Scaling = Scaling {
    a_per_count: -3.3 / 4095.0 / (0.01 * 5.7 * 6.8 / 7.48),
    rest_counts: 2122.0,
    rest_tolerance: 200.0,
    v_per_count: 3.3 / 4095.0 * 178.31 / 9.31,
    temperature_c: THERMISTOR_C,
};
