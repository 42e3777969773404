//! A period of a drive as functions that tools can call: `drive/tests/machine_code.rs` runs this very code in an emulated
//! processor against the simulator's motor, compares its bits with the host's, and bounds its cycles.
//!
//! On a chip the program measures one: the period's cycles by the processor's counter, at the clock after reset, at which
//! flash does not wait.
#![no_std]
#![no_main]
#![expect(unsafe_code, reason = "the names are for a host tool; nothing else of the image has them")]

use core::hint::black_box;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

// For its interrupt table and its way to log.
use boards as _;
use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use drive::{Angle, Configuration, Drive, Limits, Motor, Rotor, Sample};
use semihosting::process::exit;

/// Bytes of a [`Drive`].
#[unsafe(export_name = "dimsart_drive_bytes")]
static DRIVE_BYTES: usize = size_of::<Drive>();

/// What goes into a period: currents U, V, W in `A`, supply in `V`, temperature in `°C`, torque in `N m`; then the rotor's angle,
/// whether there is one, and whether there is a torque.
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

/// Makes a drive of its configuration's numbers, in the order in which they are declared; gives 1, or 0 if it cannot.
#[unsafe(export_name = "dimsart_drive_start")]
#[inline(never)]
extern "C" fn start(drive: &mut MaybeUninit<Drive>, numbers: &[f32; 20]) -> u32 {
    let [
        resistance_ohm,
        direct_inductance_h,
        quadrature_inductance_h,
        flux_linkage_vs,
        pole_pairs,
        reversed,
        encoder_offset_rad,
        current_a,
        trip_current_a,
        least_bus_v,
        most_bus_v,
        derating_c,
        trip_c,
        speed_rad_per_s,
        stall_s,
        period_s,
        bandwidth_rad_per_s,
        dead_time_share,
        dead_time_current_a,
        most_duty,
    ] = *numbers;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let pole_pairs = pole_pairs as u8;
    let motor = Motor {
        resistance_ohm,
        direct_inductance_h,
        quadrature_inductance_h,
        flux_linkage_vs,
        pole_pairs,
        is_encoder_reversed: reversed > 0.5,
        encoder_offset_rad,
    };
    let limits = Limits {
        current_a,
        trip_current_a,
        least_bus_v,
        most_bus_v,
        derating_c,
        trip_c,
        speed_rad_per_s,
        stall_s,
    };
    let configuration = Configuration {
        motor,
        limits,
        period_s,
        bandwidth_rad_per_s,
        dead_time_share,
        dead_time_current_a,
        most_duty,
    };
    match Drive::new(&configuration) {
        Ok(new) => {
            drive.write(new);
            1
        }
        Err(_) => 0,
    }
}

/// One period; gives 1 with the duty cycles, or 0 for a bridge that is off.
#[unsafe(export_name = "dimsart_drive_step")]
#[inline(never)]
extern "C" fn step(drive: &mut Drive, given: &Given, duties: &mut [f32; 3]) -> u32 {
    let Given { phase_a, bus_v, temperature_c, torque_nm, angle, has_angle, has_torque } = *given;
    let rotor = if has_angle != 0 { Rotor::At(Angle(angle)) } else { Rotor::Lost };
    let sample = Sample { phase_a, bus_v, temperature_c, rotor };
    match drive.step(&sample, (has_torque != 0).then_some(torque_nm)) {
        Some(found) => {
            *duties = found;
            1
        }
        None => 0,
    }
}

#[entry]
fn main() -> ! {
    cortex_m::interrupt::disable();
    let Some(mut peripherals) = Peripherals::take() else { exit(1) };
    peripherals.DCB.enable_trace();
    peripherals.DWT.enable_cycle_counter();
    black_box(&DRIVE_BYTES);

    // A small motor at 24 V and 20 kHz.
    let numbers = [
        0.3, 3e-4, 3e-4, 0.008, 10.0, 0.0, 0.4, 20.0, 30.0, 10.0, 30.0, 80.0, 100.0, 400.0, 1.0, 5e-5,
        6283.0, 0.02, 0.2, 0.95,
    ];
    let (mut drive, mut duties) = (MaybeUninit::uninit(), [0.0; 3]);
    if start(&mut drive, black_box(&numbers)) == 0 {
        exit(1)
    }
    // SAFETY: it is written where 1 is given.
    let drive = unsafe { drive.assume_init_mut() };
    let (mut least, mut most) = (u32::MAX, 0);
    for period in 0..1_000_u32 {
        let given = Given {
            phase_a: [1.0, -0.5, -0.5],
            bus_v: 24.0,
            temperature_c: 25.0,
            torque_nm: 0.3,
            angle: period << 18,
            has_angle: 1,
            has_torque: 1,
        };
        let before = DWT::cycle_count();
        if step(drive, black_box(&given), &mut duties) == 0 {
            exit(1)
        }
        let taken = DWT::cycle_count().wrapping_sub(before);
        (least, most) = (least.min(taken), most.max(taken));
    }
    defmt::println!(
        "a period of the drive takes {=u32} to {=u32} cycles, and the reading of them",
        least,
        most
    );
    exit(0)
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    exit(1)
}

mod hard_fault {
    #[cortex_m_rt::exception]
    unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
        super::exit(1)
    }
}
