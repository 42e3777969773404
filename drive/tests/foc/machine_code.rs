//! The code of a period as compiled for a board, run on an emulated processor: the same bits as on the host, and cycles by the
//! tables of the crate `cycles`.
//!
//! Without the image the test is skipped with a message; if `DIMSART_FIRMWARE` names a folder of images, the image is required.

use std::collections::BTreeSet;
use std::sync::Arc;

use cycles::bound::{Bound, BoundRequest, Call, Input, Snapshot};
use cycles::image::Image;
use cycles::machine::{Machine, Run};
use cycles::timing::{Column, Flash, Profile, Timing};
use dimsart_core::DriveFault;
use drive::{Configuration, Duties, Encoder, Rotor, Sample};

use crate::bench::{Bench, configuration, motor};

/// Maximum cycles of a period with zero wait states, as in an STM32G4's CCM SRAM.
const MAX_CYCLES: u64 = 700;
/// Maximum bound over all paths, with the upper end of every range in Arm's tables.
const MAX_BOUND_CYCLES: u64 = 985;

/// Memory not used by the image.
const DRIVE: u32 = 0x2100_0000;
const NUMBERS: u32 = 0x2101_0000;
const GIVEN: u32 = 0x2102_0000;
const GIVEN_WORDS: u32 = 9;
const DUTIES: u32 = 0x2103_0000;

fn image() -> Option<Arc<Image>> {
    let bytes = std::fs::read(test_requirements::image("drive-step")?).unwrap();
    Some(Arc::new(Image::read(&bytes).unwrap()))
}

/// A drive on an emulated processor.
struct Emulated {
    machine: Machine,
    step: u32,
}

impl Emulated {
    fn new(image: &Arc<Image>, timing: Timing, told: &Configuration) -> Self {
        let mut machine = Machine::new(Arc::clone(image), timing).unwrap();
        let place = *image.symbols.get("dimsart_drive_bytes").unwrap();
        let mut bytes = [0; 4];
        machine.read(place, &mut bytes).unwrap();
        machine.map(DRIVE, u32::from_le_bytes(bytes).next_multiple_of(4));
        for (address, words) in [(NUMBERS, 24), (GIVEN, GIVEN_WORDS), (DUTIES, 3)] {
            machine.map(address, 4 * words);
        }
        let Configuration { motor, joint, limits, inverter, .. } = told;
        // Memory layout of a `Configuration`.
        let Encoder::Incremental { counts_per_turn } = told.encoder else { panic!("{told:?}") };
        let numbers = [
            told.bandwidth_rad_per_s,
            told.aligning_current_a,
            motor.resistance_ohm,
            motor.direct_inductance_h,
            motor.quadrature_inductance_h,
            motor.flux_linkage_vs,
            f32::from_le_bytes([motor.pole_pairs, motor.is_encoder_reversed.into(), 0, 0]),
            motor.encoder_offset_rad,
            f32::from_bits(0),
            f32::from_bits(counts_per_turn),
            joint.gear_ratio,
            joint.zero_rad,
            limits.current_a,
            limits.trip_current_a,
            limits.min_bus_v,
            limits.max_bus_v,
            limits.derating_c,
            limits.trip_c,
            limits.speed_rad_per_s,
            limits.stall_s,
            inverter.period_s,
            inverter.dead_time_share,
            inverter.dead_time_current_a,
            inverter.max_duty,
        ];
        machine.write(NUMBERS, &numbers.map(f32::to_le_bytes).concat()).unwrap();
        let function = |name: &str| image.function(name).unwrap().address;
        let run = machine.call(function("dimsart_drive_start"), [DRIVE, NUMBERS, 0, 0]).unwrap();
        assert_eq!(run.result, 1);
        Self { machine, step: function("dimsart_drive_step") }
    }

    fn step(&mut self, sample: &Sample, torque_nm: Option<f32>) -> (Option<Duties>, Run) {
        let (angle, has_angle) = match sample.rotor {
            Rotor::Angle(angle) => (angle.0, 1),
            Rotor::NotSampled | Rotor::Lost | Rotor::BadMagnet => (0, 0),
        };
        let [u, v, w] = sample.phase_a.map(f32::to_bits);
        let [bus, temperature, torque] =
            [sample.bus_v, sample.temperature_c, torque_nm.unwrap_or(0.0)].map(f32::to_bits);
        let words = [u, v, w, bus, temperature, torque, angle, has_angle, u32::from(torque_nm.is_some())];
        self.machine.write(GIVEN, &words.map(u32::to_le_bytes).concat()).unwrap();
        let run = self.machine.call(self.step, [DRIVE, GIVEN, DUTIES, 0]).unwrap();
        let mut bytes = [[0; 4]; 3];
        for (word, address) in bytes.iter_mut().zip((DUTIES..).step_by(4)) {
            self.machine.read(address, word).unwrap();
        }
        ((run.result == 1).then_some(bytes.map(f32::from_le_bytes)), run)
    }

    /// Returns the bound of every period, whatever the state before.
    fn bound(&self, timing: &Timing) -> Bound {
        let image = self.machine.image();
        let mut call = Call::new(self.step, [DRIVE, GIVEN, DUTIES, 0]);
        call.inputs = vec![Input::words(GIVEN..GIVEN + 4 * GIVEN_WORDS)];
        let question = BoundRequest {
            image,
            timing,
            memory: &Snapshot::from(&self.machine),
            stack_top: *image.symbols.get("_stack_start").unwrap(),
            calls: &[call],
            marked: &BTreeSet::new(),
        };
        Bound::for_repeated_execution(&question).unwrap().remove(0)
    }
}

#[test]
fn a_period_has_the_host_s_bits_on_a_cortex_m_and_its_cycles_are_bounded() {
    let Some(image) = image() else { return };
    let motor = motor();
    let told = configuration(&motor);
    println!("| memory | a period, mean | most | bound | stack, bytes |");
    let flash = Profile::Flash(Flash::STM32G4);
    for (memory, profile) in
        [("does not wait, as CCM SRAM", Profile::ZeroWait), ("flash of an STM32G4", flash)]
    {
        let [typical, upper] = [Column::Likely, Column::Upper].map(|column| Timing::new(profile, column));
        let mut emulated = Emulated::new(&image, typical, &told);
        let bound = emulated.bound(&upper);
        let mut bench = Bench::new(&motor, told);
        bench.motor.set_rotor(1.0, 0.0);
        let (mut most, mut sum, mut on) = (0, 0, 0);
        let periods = 4_000_u16;
        for period in 0..periods {
            // Above the voltage limit, and a fault at the end.
            let state = bench.motor.state();
            bench.motor.set_rotor(state.angle_rad, f64::from(period) * 0.035);
            let mut sample = bench.sample();
            if period % 50 == 49 {
                sample.rotor = Rotor::Lost;
            }
            if period == periods - 5 {
                sample.bus_v = 0.0;
            }
            let torque_nm = (period % 1_000 > 20).then_some(f32::from(period).sin());
            let (found, run) = emulated.step(&sample, torque_nm);
            on += u16::from(found.is_some());
            let bits = |duties: Option<Duties>| duties.map(|duties| duties.map(f32::to_bits));
            let mut host = bench.drive.clone();
            assert_eq!(bits(found), bits(host.step(&sample, torque_nm)), "period {period}");
            bench.step_with(&sample, torque_nm);
            (most, sum) = (run.cycles.max(most), sum + run.cycles);
        }
        assert_eq!(bench.drive.fault(), Some(DriveFault::Undervoltage));
        assert!(on > periods - 250, "the bridge was on in {on} of {periods} periods");
        let mean = sum / u64::from(periods);
        println!("| {memory} | {mean} | {most} | {} | {} |", bound.cycles, bound.stack_bytes);
        assert!(most <= bound.cycles, "{most} of {}", bound.cycles);
        if profile == Profile::ZeroWait {
            assert!(most <= MAX_CYCLES, "{most} of {MAX_CYCLES}");
            assert!(bound.cycles <= MAX_BOUND_CYCLES, "{} of {MAX_BOUND_CYCLES}", bound.cycles);
        }
    }
}
