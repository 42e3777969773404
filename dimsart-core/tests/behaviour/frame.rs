//! A frame is accepted as a whole or refused, and the device always gets finite numbers.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use crate::common::{Bench, Types};
use dimsart_core::ModuleKinds;
use dimsart_core::{
    AxisKind, Context, DataType, DescriptorError, DeviceDescriptor, Dimsart, FaultCause, Format, FrameError,
    Input, MAX_DEVICE_TYPES, Matrix, Module, Output, ScalarSignal, Shape, Summary, TickResult, Unit, Vector,
    Word,
    limits::{Capacities, MAX_DOF},
    memory, types, words,
};
use dimsart_modules::ALL;

macro_rules! own_types {
    ($($id:literal $name:ident $format:ident $shape:expr;)*) => {
        $(const $name: &DataType = &DataType {
            id: $id, name: stringify!($name), unit: Unit::One, format: Format::$format, shape: $shape,
            summary: Summary::new("A board's own."),
        };)*
    };
}

own_types! {
    0x8000 TEMPERATURES F32 Shape::Vector;
    0x8001 COUNTER      I32 Shape::Scalar;
    0x8002 STATUS_BITS  U32 Shape::Matrix(2, 2);
    0x8003 LIMIT_SWITCH Bool Shape::Vector;
    0x8004 JACOBIAN     F32 Shape::Matrix(2, 3);
    0x8010 HEATING      F32 Shape::Vector;
    0x8011 TARGET       I32 Shape::Scalar;
    0x8012 MASK         U32 Shape::Matrix(2, 2);
    0x8013 BRAKES       Bool Shape::Vector;
    0x8014 TRANSPOSED   F32 Shape::Matrix(3, 2);
    0x8020 IMAGE        F32 Shape::Matrix(16, 20);
}

/// Copies every measured signal to the device, through handles of every format and shape.
#[derive(Debug)]
struct Relay;

words! {
    parameters Settings {
        /// Whether it corrupts a word.
        spoils: bool = flag("SPOILS", false),
        /// With infinity instead of NaN.
        spoils_with_infinity: bool = flag("INFINITY", false),
        /// Float word that it corrupts.
        spoiled_word: u32 = count("WORD", Unit::One, 0..=100, 0),
    }
    ports Signals {
        temperatures: Input = input("TEMPERATURES", TEMPERATURES),
        counter: Input<ScalarSignal<i32>> = input("COUNTER", COUNTER),
        status_bits: Input<Matrix<2, 2, u32>> = input("STATUS_BITS", STATUS_BITS),
        limit_switch: Input<Vector<bool>> = input("LIMIT_SWITCH", LIMIT_SWITCH),
        jacobian: Input<Matrix<2, 3>> = input("JACOBIAN", JACOBIAN),
        heating: Output = output("HEATING", HEATING),
        target: Output<ScalarSignal<i32>> = output("TARGET", TARGET),
        mask: Output<Matrix<2, 2, u32>> = output("MASK", MASK),
        brakes: Output<Vector<bool>> = output("BRAKES", BRAKES),
        transposed: Output<Matrix<3, 2>> = output("TRANSPOSED", TRANSPOSED),
    }
}

impl Module for Relay {
    const NAME: &'static str = "RELAY_MOD";
    const SUMMARY: &'static str = "Hands signals on, one of them spoiled when asked to.";

    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Signals;

    fn compute(context: &Context<'_, Self>) {
        let (data, ports) = (context.data(), context.ports());
        let Settings { spoiled_word, spoils, spoils_with_infinity } = context.settings();
        data.set(ports.target, data.get(ports.counter));
        for axis in 0..data.device().dof() {
            data.set_axis(ports.heating, axis, data.axis(ports.temperatures, axis));
            data.set_axis(ports.brakes, axis, data.axis(ports.limit_switch, axis));
        }
        for row in 0..2 {
            for column in 0..2 {
                data.set_element(ports.mask, row, column, data.element(ports.status_bits, row, column));
            }
            for column in 0..3 {
                data.set_element(ports.transposed, column, row, data.element(ports.jacobian, row, column));
            }
        }
        if spoils {
            let bad = if spoils_with_infinity { f32::NEG_INFINITY } else { f32::NAN };
            let mut words = data.words_out(ports.heating).iter().chain(data.words_out(ports.transposed));
            words.nth(spoiled_word as usize).unwrap().set(bad.to_bits());
        }
    }
}

const RELAYS: ModuleKinds = dimsart_core::kinds![Relay];

const DOF: usize = 3;
/// Indices of the floats in a measured frame, by type, with the number of words before the type.
const FLOATS: [(&DataType, usize, usize); 2] = [(TEMPERATURES, 0, DOF), (JACOBIAN, 2 * DOF + 5, 6)];

fn bench() -> Bench {
    let mut bench = Bench::with_kinds(
        RELAYS,
        DOF,
        &[TEMPERATURES, COUNTER, STATUS_BITS, LIMIT_SWITCH, JACOBIAN],
        &[HEATING, TARGET, MASK, BRAKES, TRANSPOSED],
    );
    bench.run("MOD_ENG MOD_ON RELAY_MOD");
    bench
}

/// Edge cases of every format.
fn measurement() -> Vec<Word> {
    let temperatures = [f32::MAX, -0.0, f32::MIN_POSITIVE].map(Word::from);
    let status = [u32::MAX, 0, 0x7FC0_0000, 0xFF80_0000].map(Word::from);
    let switches = [true, false, true].map(Word::from);
    let jacobian = [0.0, 0.1, 0.2, 1.0, 1.1, 1.2].map(Word::from);
    [&temperatures[..], &[Word::from(i32::MIN)], &status, &switches, &jacobian].concat()
}

#[test]
fn every_format_and_shape_goes_through_bit_by_bit() {
    let (tick, commanded) = bench().try_tick(&measurement());
    assert_eq!(tick, TickResult::Ran);
    let mut expected = measurement();
    let jacobian = expected.split_off(2 * DOF + 5);
    expected.extend([0, 3, 1, 4, 2, 5].map(|word| jacobian[word]));
    assert_eq!(commanded, expected);
}

#[test]
fn a_frame_of_the_wrong_length_changes_nothing_and_the_device_gets_zero() {
    let mut bench = bench();
    bench.try_tick(&measurement());
    let before = bench.snapshot();
    let expected = measurement().len();
    for found in [0, 1, expected - 1, expected + 1, 100] {
        bench.dimsart.set_motion_allowed(false);
        let (tick, commanded) = bench.try_tick(&vec![Word::from(1.0); found]);
        assert_eq!(tick, TickResult::MeasurementRefused(FrameError::Length { expected, found }));
        assert!(commanded.iter().all(|word| *word == Word(0)));
        assert_eq!(bench.snapshot(), before);
    }
    assert_eq!(bench.dimsart.refused_ticks(), 5);
}

#[test]
fn a_command_frame_of_the_wrong_length_is_filled_with_zero() {
    let mut bench = bench();
    let expected = bench.dimsart.frame().input_words();
    for found in [0, 1, expected - 1, expected + 1] {
        bench.rows("MOD_ENG RESET");
        bench.try_tick(&measurement());
        let mut commanded = vec![Word(0xDEAD); found];
        let tick = bench.dimsart.tick(&measurement(), &mut commanded);
        assert_eq!(tick, TickResult::CommandRefused(FrameError::Length { expected, found }));
        assert!(commanded.iter().all(|word| *word == Word(0)));
    }
}

#[test]
fn a_number_that_is_not_finite_is_named_wherever_it_stands() {
    let mut bench = bench();
    bench.try_tick(&measurement());
    let before = bench.snapshot();
    for (data_type, start, length) in FLOATS {
        for word in 0..length {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::from_bits(0xFFFF_FFFF)] {
                let mut measured = measurement();
                measured.iter_mut().for_each(|word| word.0 ^= 1);
                measured[start + word] = Word::from(bad);
                bench.dimsart.set_motion_allowed(false);
                let (tick, commanded) = bench.try_tick(&measured);
                let error =
                    FrameError::NotFinite { signal: data_type.first(), word: word.try_into().unwrap() };
                assert_eq!(tick, TickResult::MeasurementRefused(error));
                assert!(commanded.iter().all(|word| *word == Word(0)));
                assert_eq!(bench.snapshot(), before);
            }
        }
    }
    assert_eq!(
        bench.try_tick(&measurement()).0,
        TickResult::Disarmed,
        "without motion it ends with the next frame"
    );
    bench.dimsart.set_motion_allowed(true);
    assert_eq!(bench.try_tick(&measurement()).0, TickResult::Ran);
    let mut measured = measurement();
    measured[0] = Word::from(f32::NAN);
    bench.try_tick(&measured);
    let (tick, _) = bench.try_tick(&measurement());
    assert!(
        matches!(tick, TickResult::MeasurementRefused(_)),
        "in motion, the first one is a fault until a reset"
    );
    bench.rows("MOD_ENG RESET");
    assert_eq!(bench.try_tick(&measurement()).0, TickResult::Ran);
}

#[test]
fn what_a_module_spoils_never_reaches_the_device() {
    let mut bench = bench();
    let names = (0..3).map(|word| (HEATING, word)).chain((0..6).map(|word| (TRANSPOSED, word)));
    for (place, (data_type, word)) in names.enumerate() {
        for infinity in ["OFF", "ON"] {
            bench.rows("RELAY_MOD SPOILS ON");
            bench.rows(&format!("RELAY_MOD WORD {place}\nRELAY_MOD INFINITY {infinity}"));
            let (tick, commanded) = bench.try_tick(&measurement());
            let fault = bench.dimsart.engine().module_fault().unwrap();
            assert_eq!(tick, TickResult::ModuleFailed(fault.module));
            let FaultCause::InvalidOutput { signal, word: found, bits } = fault.cause else {
                panic!("{fault:?}")
            };
            assert_eq!((signal, found), (data_type.first(), word));
            assert!(!f32::from_bits(bits).is_finite());
            assert!(commanded.iter().all(|word| *word == Word(0)));
            bench.rows("RELAY_MOD SPOILS OFF");
            assert_eq!(bench.try_tick(&measurement()).0, tick, "until a reset");
            bench.rows("MOD_ENG RESET");
            assert_eq!(bench.try_tick(&measurement()).0, TickResult::Ran);
        }
    }
    assert_eq!(bench.dimsart.refused_ticks(), 0);
}

#[test]
fn a_scheme_that_does_not_run_gives_the_safe_output() {
    let mut bench = bench();
    bench.rows("MOD_ENG STOP");
    let (tick, commanded) = bench.try_tick(&measurement());
    assert_eq!(tick, TickResult::Idle);
    assert!(commanded.iter().all(|word| *word == Word(0)));
    assert_eq!(bench.bits("COUNTER"), [i32::MIN.cast_unsigned()], "measurements are still visible");
    assert_eq!(bench.dimsart.refused_ticks(), 0);
}

#[test]
fn a_type_of_more_words_than_a_byte_counts_is_checked_to_its_end() {
    let mut bench = Bench::of(1, &[IMAGE], &[]);
    let mut measured = vec![Word::from(1.0); 320];
    assert_eq!(bench.try_tick(&measured).0, TickResult::Idle);
    measured[319] = Word::from(f32::NAN);
    let error = FrameError::NotFinite { signal: IMAGE.first(), word: 319 };
    assert_eq!(bench.try_tick(&measured).0, TickResult::MeasurementRefused(error));
}

#[test]
fn impossible_devices_are_refused_with_what_was_asked_for() {
    let describe = |dof, period| {
        DeviceDescriptor::new("arm", &vec![AxisKind::Rotary; dof], period, &[], &[])
            .map(|device| device.dof())
    };
    for dof in 1..=MAX_DOF {
        assert_eq!(describe(dof, 1e-3), Ok(dof));
    }
    for wanted in [0, MAX_DOF + 1, 100] {
        assert_eq!(describe(wanted, 1e-3), Err(DescriptorError::Dof { wanted }));
    }
    for wanted_s in [0.0, -1e-3, f32::INFINITY] {
        assert_eq!(describe(3, wanted_s), Err(DescriptorError::SamplePeriod { wanted_s }));
    }
    assert!(matches!(describe(3, f32::NAN), Err(DescriptorError::SamplePeriod { .. })));
}

#[test]
fn too_many_types_and_one_type_twice_are_refused_with_the_numbers() {
    let all: Types = types::ALL.iter().collect::<Vec<_>>().leak();
    let (most, nine) = (&all[..MAX_DEVICE_TYPES], &all[..=MAX_DEVICE_TYPES]);
    let twice: Types = &[types::FORCE, types::POSITION, types::VELOCITY, types::POSITION];
    let describe = |outputs, inputs| {
        DeviceDescriptor::new("arm", &[AxisKind::Linear], 1e-3, outputs, inputs).map(|device| device.dof())
    };
    assert_eq!(describe(most, &[]), Ok(1));
    assert_eq!(describe(&[], most), Ok(1));
    let too_many = Err(DescriptorError::TooManyTypes { wanted: MAX_DEVICE_TYPES + 1 });
    let same = Err(DescriptorError::DuplicateType { id: types::POSITION.id, first: 1, second: 3 });
    for (types, refused) in [(nine, too_many), (twice, same)] {
        assert_eq!(describe(types, &[]), refused);
        assert_eq!(describe(&[], types), refused);
        assert!(refused.unwrap_err().to_string().contains(['9', '3']));
    }
}

#[test]
fn a_type_that_is_measured_and_commanded_or_is_taken_for_another_one_is_refused() {
    let describe = |outputs, inputs| {
        DeviceDescriptor::new("arm", &[AxisKind::Linear], 1e-3, outputs, inputs).map(|device| device.dof())
    };
    let id = types::FORCE.id;
    let both = describe(&[types::POSITION, types::FORCE], &[types::FORCE]);
    assert_eq!(both, Err(DescriptorError::DuplicateType { id, first: 1, second: 2 }));
    const fn own(id: u16, name: &'static str) -> DataType {
        DataType { id, name, ..*types::FORCE }
    }
    const FORCE_OF_THE_GRIPPER: &DataType = &own(types::FORCE.id, "GRIP");
    const HEAT: &DataType = &own(0x8000, "HEAT");
    const OTHER_HEAT: &DataType = &own(0x8001, "HEAT");
    assert_eq!(describe(&[FORCE_OF_THE_GRIPPER], &[]), Err(DescriptorError::ReservedTypeId { id }));
    assert_eq!(
        describe(&[HEAT], &[OTHER_HEAT]),
        Err(DescriptorError::DuplicateType { id: 0x8001, first: 0, second: 1 })
    );
    assert_eq!(describe(&[HEAT], &[types::FORCE]), Ok(1));
}

#[test]
fn a_device_whose_types_do_not_fit_is_refused() {
    let axes = [AxisKind::Linear; 3];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[IMAGE, TEMPERATURES], &[]).unwrap();
    type TooSmall = memory!(Capacities { words: 322, ..Capacities::DEFAULT });
    assert!(Dimsart::new(Box::leak(Box::new(TooSmall::new())), device, ALL).is_err());
}
