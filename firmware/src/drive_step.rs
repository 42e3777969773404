//! A drive's period as functions for tools: `drive/tests/foc/machine_code.rs` runs this code in an emulated
//! processor against the simulator's motor, compares the results with the host's bit by bit, and bounds the
//! cycles.
//!
//! On a chip the program measures the cycles of one period at the clock after reset, which needs no flash
//! wait states.
#![no_std]
#![no_main]
#![expect(unsafe_code, reason = "exported names for a host tool, unique in the image")]

mod stopping;

use core::hint::black_box;
use core::mem::MaybeUninit;

// For its interrupt table and log transport.
use boards as _;
use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use drive::{Angle, Configuration, Drive, Encoder, Inverter, Joint, Limits, Motor, Rotor, Sample};
use semihosting::process::exit;

/// Size of a [`Drive`], bytes.
#[unsafe(export_name = "dimsart_drive_bytes")]
static DRIVE_BYTES: usize = size_of::<Drive>();

/// Inputs of a period: currents U, V, W in `A`, supply in `V`, temperature in `°C`, torque in `N m`; the
/// rotor's angle; whether angle and torque are valid.
#[repr(C)]
struct Given {
    phase_a: [f32; 3],
    bus_v: f32,
    temperature_c: f32,
    torque_nm: f32,
    angle: u32,
    has_angle: u32,
    has_torque: u32,
}

/// Creates a drive; returns 1, or 0 on failure.
#[unsafe(export_name = "dimsart_drive_start")]
#[inline(never)]
extern "C" fn start(drive: &mut MaybeUninit<Drive>, configuration: &Configuration) -> u32 {
    match Drive::new(configuration) {
        Ok(new) => {
            drive.write(new);
            1
        }
        Err(_) => 0,
    }
}

/// Runs one period; returns 1 and the duty cycles, or 0 if the bridge is off.
#[unsafe(export_name = "dimsart_drive_step")]
#[inline(never)]
extern "C" fn step(drive: &mut Drive, given: &Given, duties: &mut [f32; 3]) -> u32 {
    let Given { phase_a, bus_v, temperature_c, torque_nm, angle, has_angle, has_torque } = *given;
    let rotor = if has_angle != 0 { Rotor::Angle(Angle(angle)) } else { Rotor::Lost };
    let sample = Sample { phase_a, bus_v, temperature_c, rotor };
    match drive.step(&sample, (has_torque != 0).then_some(torque_nm)) {
        Some(found) => {
            *duties = found;
            1
        }
        None => 0,
    }
}

/// A small motor at 24 V and 20 kHz.
const CONFIGURATION: Configuration = Configuration {
    motor: Motor {
        resistance_ohm: 0.3,
        direct_inductance_h: 3e-4,
        quadrature_inductance_h: 3e-4,
        flux_linkage_vs: 0.008,
        pole_pairs: 10,
        is_encoder_reversed: false,
        encoder_offset_rad: 0.4,
    },
    limits: Limits {
        current_a: 20.0,
        trip_current_a: 30.0,
        min_bus_v: 10.0,
        max_bus_v: 30.0,
        derating_c: 80.0,
        trip_c: 100.0,
        speed_rad_per_s: 400.0,
        stall_s: 1.0,
    },
    bandwidth_rad_per_s: 6283.0,
    aligning_current_a: 5.0,
    encoder: Encoder::Incremental { counts_per_turn: 4096 },
    joint: Joint { gear_ratio: 1.0, zero_rad: 0.0 },
    inverter: Inverter { period_s: 5e-5, dead_time_share: 0.02, dead_time_current_a: 0.2, max_duty: 0.95 },
};

#[entry]
fn main() -> ! {
    cortex_m::interrupt::disable();
    let Some(mut peripherals) = Peripherals::take() else { exit(1) };
    peripherals.DCB.enable_trace();
    peripherals.DWT.enable_cycle_counter();
    black_box(&DRIVE_BYTES);

    let (mut drive, mut duties) = (MaybeUninit::uninit(), [0.0; 3]);
    if start(&mut drive, black_box(&CONFIGURATION)) == 0 {
        exit(1)
    }
    // SAFETY: initialised if the function returned 1.
    let drive = unsafe { drive.assume_init_mut() };
    let (mut least, mut most) = (u32::MAX, 0);
    for period in 0..1_000_u32 {
        let given = Given {
            // Currents that do not follow the d-axis voltage would be a fault.
            phase_a: [0.0; 3],
            bus_v: 24.0,
            temperature_c: 25.0,
            torque_nm: 0.3,
            angle: period << 18,
            has_angle: 1,
            has_torque: 1,
        };
        let before = DWT::cycle_count();
        let is_on = step(drive, black_box(&given), &mut duties) == 1;
        let taken = DWT::cycle_count().wrapping_sub(before);
        // During alignment the bridge is off and the period is shorter.
        if is_on {
            (least, most) = (least.min(taken), most.max(taken));
        }
    }
    if drive.fault().is_some() || least > most {
        exit(1)
    }
    defmt::println!("drive period: {=u32} to {=u32} cycles, including the counter read", least, most);
    exit(0)
}
