//! Sensor limits: implausible measurements are refused in the same tick, plausible ones never.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use dimsart_core::{
    AxisKind, Command, DataType, DescriptorError, DeviceDescriptor, Dimsart, DriveState, Format, FrameError,
    OutputLimits, ProvidedMemory, SafetyReason, Shape, TickResult, Unit, Word, types,
};
use dimsart_modules::ALL;
use proptest::prelude::*;

const PERIOD_S: f32 = 1e-3;
/// 2 mm per tick.
const LIMITS: OutputLimits = OutputLimits { min: -1.0, max: 3.0, rate_per_s: 2.0 };
const STEP_M: f32 = LIMITS.rate_per_s * PERIOD_S;
const DOF: usize = 2;

fn device() -> DeviceDescriptor {
    let axes = [AxisKind::Linear; DOF];
    let outputs = &[types::POSITION, types::FORCE];
    DeviceDescriptor::new("arm", &axes, PERIOD_S, outputs, &[types::DES_FORCE]).unwrap()
}

/// A P controller on a device with limits on its positions and none on its forces.
struct Arm {
    dimsart: Dimsart,
    position_m: [f32; DOF],
    measured_n: f32,
}

impl Arm {
    fn new() -> Self {
        let mut dimsart = Dimsart::new(
            ProvidedMemory::leak_default(),
            device().with_output_limits(&[LIMITS]).unwrap(),
            ALL,
        )
        .unwrap();
        let p = dimsart_modules::ALL.module("PCTRL_MOD").unwrap();
        dimsart.command(Command::bind(p, 1, types::POSITION.first())).unwrap();
        dimsart.command(Command::bind(p, 0, types::POSITION.first())).unwrap();
        dimsart.command(Command::PlugIn(p)).unwrap();
        dimsart.command(Command::Check).unwrap();
        Self { dimsart, position_m: [0.5, -0.25], measured_n: 0.0 }
    }

    fn tick(&mut self) -> TickResult {
        let position = self.position_m.map(Word::from);
        let measured = [position, [Word::from(self.measured_n); DOF]].concat();
        self.dimsart.tick(&measured, &mut [Word(0); DOF])
    }

    fn position_in_data_base(&self) -> Vec<Word> {
        self.dimsart.signals(&[types::POSITION.first()]).collect()
    }

    fn refusal(&self, axis: u16) -> TickResult {
        let bits = self.position_m[usize::from(axis)].to_bits();
        let signal = types::POSITION.first();
        TickResult::MeasurementRefused(FrameError::Implausible { signal, word: axis, bits })
    }
}

proptest! {
    #[test]
    fn what_a_sensor_can_show_is_never_refused(
        start_m in LIMITS.min..LIMITS.max,
        steps in prop::collection::vec(-1.0_f32..1.0, 1..200),
    ) {
        let mut arm = Arm::new();
        arm.position_m = [start_m; DOF];
        for share in steps {
            // Minus the rounding of a sum.
            let moved_m = arm.position_m[0] + share * (STEP_M - 1e-6);
            arm.position_m[0] = moved_m.clamp(LIMITS.min, LIMITS.max);
            arm.measured_n += 1e6 * share;
            prop_assert_eq!(arm.tick(), TickResult::Ran);
        }
    }

    #[test]
    fn a_jump_is_refused_in_that_very_tick_until_a_reset_and_then_it_is_where_it_is(
        jump_m in prop_oneof![-1.0_f32..-1.01 * STEP_M, 1.01 * STEP_M..2.0],
        axis in 0..DOF,
        ticks in 1_usize..30,
    ) {
        let mut arm = Arm::new();
        arm.position_m = [0.0; DOF];
        prop_assert_eq!(arm.tick(), TickResult::Ran);
        let before = arm.position_in_data_base();
        arm.position_m[axis] += jump_m;
        let refusal = arm.refusal(axis.try_into().unwrap());
        for _ in 0..ticks {
            prop_assert_eq!(arm.tick(), refusal);
            prop_assert_eq!(arm.position_in_data_base(), before.clone());
            prop_assert_eq!(arm.dimsart.safety().reason(), SafetyReason::MeasurementRefused);
        }
        prop_assert_eq!(arm.dimsart.safety().state(), DriveState::Fault);
        arm.dimsart.command(Command::Reset).unwrap();
        prop_assert_eq!(arm.tick(), TickResult::Ran);
    }
}

#[test]
fn a_sensor_that_jumps_and_comes_back_leaves_a_fault_behind() {
    let mut arm = Arm::new();
    arm.tick();
    arm.position_m[1] += 0.1;
    let refusal = arm.refusal(1);
    assert_eq!(arm.tick(), refusal);
    arm.position_m[1] -= 0.1;
    assert_eq!(arm.tick(), refusal, "the fault latches");
    assert_eq!(arm.dimsart.safety().refused_ticks(), 1, "the next value is accepted");
}

#[test]
fn what_is_beyond_the_range_is_refused_after_a_reset_too() {
    let mut arm = Arm::new();
    for beyond_m in [LIMITS.max + 0.001, LIMITS.min - 0.001, f32::MAX, f32::MIN] {
        arm.position_m = [0.5; DOF];
        arm.dimsart.command(Command::Reset).unwrap();
        assert_eq!(arm.tick(), TickResult::Ran);
        arm.position_m[0] = beyond_m;
        for _ in 0..3 {
            assert_eq!(arm.tick(), arm.refusal(0));
            arm.dimsart.command(Command::Reset).unwrap();
        }
    }
}

#[test]
fn while_nothing_moves_a_jump_costs_one_tick() {
    let mut arm = Arm::new();
    arm.dimsart.set_motion_allowed(false);
    assert_eq!(arm.tick(), TickResult::Disarmed);
    arm.position_m = [2.0; DOF];
    assert_eq!(arm.tick(), arm.refusal(0));
    assert_eq!(arm.tick(), TickResult::Disarmed);
    arm.dimsart.set_motion_allowed(true);
    assert_eq!(arm.tick(), TickResult::Ran);
}

#[test]
fn limits_that_no_sensor_can_keep_are_refused() {
    static COUNT: DataType = DataType {
        id: 0x8000,
        name: "COUNT",
        unit: Unit::One,
        format: Format::U32,
        shape: Shape::Scalar,
        summary: dimsart_core::Summary::new("A count."),
    };
    static COUNTS: &[&DataType] = &[&COUNT];
    let refused = |limits: &'static [OutputLimits]| device().with_output_limits(limits).unwrap_err();
    assert_eq!(refused(&[LIMITS; 3]), DescriptorError::LimitsCount { expected: 2, found: 3 });
    let wrong = DescriptorError::OutputLimits { output: 1 };
    assert_eq!(refused(&[LIMITS, OutputLimits { min: 4.0, ..LIMITS }]), wrong);
    assert_eq!(refused(&[LIMITS, OutputLimits { max: f32::INFINITY, ..LIMITS }]), wrong);
    assert_eq!(refused(&[LIMITS, OutputLimits { rate_per_s: 0.0, ..LIMITS }]), wrong);
    assert_eq!(refused(&[LIMITS, OutputLimits { rate_per_s: f32::NAN, ..LIMITS }]), wrong);
    let axes = [AxisKind::Rotary; 8];
    let outputs = &[types::POSITION, types::VELOCITY, types::FORCE];
    let device = DeviceDescriptor::new("arm", &axes, PERIOD_S, outputs, &[]).unwrap();
    assert!(device.clone().with_output_limits(&[LIMITS; 2]).is_ok());
    let too_many = DescriptorError::TooManyLimits { wanted: 24 };
    assert_eq!(device.with_output_limits(&[LIMITS; 3]).unwrap_err(), too_many);
    let counts = DeviceDescriptor::new("arm", &axes, PERIOD_S, COUNTS, &[]).unwrap();
    let wrong = DescriptorError::OutputLimits { output: 0 };
    assert_eq!(counts.with_output_limits(&[LIMITS]).unwrap_err(), wrong);
}
