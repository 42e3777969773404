//! Every format in every shape passes unchanged, bit for bit; mismatches are refused.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use core::num::NonZeroU32;

use crate::common::IDS;
use crate::common::{Bench, DelayedLink, Types};
use dimsart_core::{
    AxisKind, CommandError, Content, Context, Cost, Costs, DataType, DeviceDescriptor, Finding, Format,
    Input, Matrix, Module, ModuleKinds, Output, Packet, ScalarSignal, Shape, Square, Summary, TickResult,
    TypeMismatch, Unit, UnitRelation, Vector, Word, types, words,
};
use dimsart_modules::ALL;

const DOF: usize = 3;

macro_rules! own_types {
    ($($id:literal $name:ident $format:ident $shape:expr;)*) => {
        $(const $name: &DataType = &DataType {
            id: $id, name: stringify!($name), unit: Unit::One, format: Format::$format, shape: $shape,
            summary: Summary::new("A board's own."),
        };)*
    };
}

own_types! {
    0x8000 F32_SCALAR  F32  Shape::Scalar;
    0x8001 F32_VECTOR  F32  Shape::Vector;
    0x8002 F32_MATRIX  F32  Shape::Matrix(2, 3);
    0x8003 F32_SQUARE  F32  Shape::Square;
    0x8004 I32_SCALAR  I32  Shape::Scalar;
    0x8005 I32_VECTOR  I32  Shape::Vector;
    0x8006 I32_MATRIX  I32  Shape::Matrix(2, 3);
    0x8007 I32_SQUARE  I32  Shape::Square;
    0x8008 U32_SCALAR  U32  Shape::Scalar;
    0x8009 U32_VECTOR  U32  Shape::Vector;
    0x800A U32_MATRIX  U32  Shape::Matrix(2, 3);
    0x800B U32_SQUARE  U32  Shape::Square;
    0x800C BOOL_SCALAR Bool Shape::Scalar;
    0x800D BOOL_VECTOR Bool Shape::Vector;
    0x800E BOOL_MATRIX Bool Shape::Matrix(2, 3);
    0x800F BOOL_SQUARE Bool Shape::Square;
    0x8010 FITS        I32  Shape::Matrix(6, 8);
    0x8011 TOO_LONG    I32  Shape::Matrix(7, 7);
}

/// The shapes of a format, as a device's inputs or outputs.
const FORMATS: [Types; 4] = [
    &[F32_SCALAR, F32_VECTOR, F32_MATRIX, F32_SQUARE],
    &[I32_SCALAR, I32_VECTOR, I32_MATRIX, I32_SQUARE],
    &[U32_SCALAR, U32_VECTOR, U32_MATRIX, U32_SQUARE],
    &[BOOL_SCALAR, BOOL_VECTOR, BOOL_MATRIX, BOOL_SQUARE],
];

/// Edge cases of a format; for integers they include the bits of NaN and infinity.
fn edges(format: Format) -> &'static [u32] {
    match format {
        Format::F32 => &[0x8000_0000, 1, 0x7F7F_FFFF, 0xFF7F_FFFF, 0x3EAA_AAAB, 0x0080_0000, 0],
        Format::I32 => &[u32::MAX, 0x8000_0000, 0x7FFF_FFFF, 0x7FC0_0000, 0xFF80_0000, 0x7F80_0001, 0],
        Format::U32 => &[u32::MAX, 0x7FC0_0001, 0x7F80_0000, 0xFFC0_0000, 1, 0],
        Format::Bool => &[1, 0, u32::MAX, 0, 0x7FC0_0000],
    }
}

/// The words of a frame in a tick: over time every edge case occurs at every index.
fn frame(types: Types, tick: usize) -> Vec<Word> {
    let words = types.iter().flat_map(|found| (0..found.shape.words(DOF)).map(|_| found.format));
    let word =
        |(place, format): (usize, Format)| Word(*edges(format).iter().cycle().nth(place + tick).unwrap());
    words.enumerate().map(word).collect()
}

/// Delays every signal by 3 ticks and sends it.
fn sender(types: Types) -> Bench {
    let mut bench = Bench::of(DOF, types, &[]);
    for (number, name) in (1..).zip(types.iter().map(|found| found.name)) {
        bench.rows(&format!(
            "TIMEDELAY_MOD.{number} PORT_SIGNAL_IN {name}
             TIMEDELAY_MOD.{number} PORT_SIGNAL_OUT {name}.2
             TIMEDELAY_MOD.{number} TD_PARAM 3
             COMM_TXMOD CTX_ADD_DATA {name}.2
             MOD_ENG MOD_ON TIMEDELAY_MOD.{number}"
        ));
    }
    bench.run("MOD_ENG MOD_ON COMM_TXMOD");
    bench
}

/// Passes received signals to its device and records them.
fn receiver(types: Types) -> Bench {
    let mut bench = Bench::of(DOF, &[], types);
    let names = types.iter().map(|found| found.name);
    let added: Vec<String> = names.clone().map(|name| format!("COMM_RXMOD CRX_ADD_DATA {name}")).collect();
    bench.rows(&added.join("\n"));
    bench.rows("MOD_ENG MOD_ON COMM_RXMOD");
    for (number, name) in (1..).zip(names) {
        bench.rows(&format!(
            "RECORDER_MOD.{number} PORT_SIGNAL_IN {name}
             RECORDER_MOD.{number} PORT_ROWS RECORDED_ROWS.{number}
             RECORDER_MOD.{number} LENGTH 5
             MOD_ENG MOD_ON RECORDER_MOD.{number}"
        ));
    }
    bench.run("");
    bench
}

#[test]
fn every_format_and_shape_goes_through_everything_bit_for_bit() {
    for types in FORMATS {
        let (mut a, mut b, mut link) = (sender(types), receiver(types), DelayedLink::new(0));
        let mut taken = Vec::new();
        for tick in 0..30 {
            assert_eq!(a.try_tick(&frame(types, tick)).0, TickResult::Ran);
            link.send(tick, &mut a.dimsart);
            link.deliver(tick, &mut b.dimsart);
            let (ran, commanded) = b.try_tick(&[]);
            assert_eq!(ran, TickResult::Ran);
            let expected = match tick.checked_sub(3) {
                Some(before) => frame(types, before),
                None => vec![Word(0); commanded.len()],
            };
            assert_eq!(commanded, expected, "{} in tick {tick}", types[0].name);
            assert_eq!((b.bits("LINK_REFUSED"), b.bits("LINK_STATE")), (&[0][..], &[1][..]));
            taken.push(commanded);
        }
        let mut start = 0;
        for (number, found) in (1..).zip(types) {
            let module = ALL.module(&format!("RECORDER_MOD.{number}")).unwrap();
            let count = found.shape.words(DOF);
            let rows = taken[25..].iter().flat_map(|row| row[start..start + count].iter().map(|word| word.0));
            let rows: Vec<u32> = rows.collect();
            assert_eq!(b.dimsart.engine().memory(module), Some(rows.as_slice()), "{}", found.name);
            start += count;
        }
    }
}

#[test]
fn a_delay_of_no_ticks_hands_any_signal_through_and_a_reset_empties_any_line() {
    for types in FORMATS {
        for (place, found) in types.iter().enumerate() {
            let name = found.name;
            let mut bench = Bench::of(DOF, types, &[]);
            bench.run(&format!(
                "TIMEDELAY_MOD PORT_SIGNAL_IN {name}\nTIMEDELAY_MOD PORT_SIGNAL_OUT {name}.2
                 MOD_ENG MOD_ON TIMEDELAY_MOD
                 TIMEDELAY_MOD.2 PORT_SIGNAL_IN {name}\nTIMEDELAY_MOD.2 PORT_SIGNAL_OUT {name}.3
                 TIMEDELAY_MOD.2 TD_PARAM 2\nMOD_ENG MOD_ON TIMEDELAY_MOD.2"
            ));
            let start: usize = types[..place].iter().map(|before| before.shape.words(DOF)).sum();
            let sample = |tick| {
                let words = frame(types, tick).into_iter().skip(start).take(found.shape.words(DOF));
                words.map(|word| word.0).collect::<Vec<_>>()
            };
            for tick in 0..15 {
                if tick == 7 {
                    bench.rows("MOD_ENG MOD_RESET TIMEDELAY_MOD.2");
                }
                bench.try_tick(&frame(types, tick));
                assert_eq!(bench.bits(&format!("{name}.2")), sample(tick));
                let is_filling = tick % 7 < 2 && tick < 14;
                let delayed = if is_filling { vec![0; sample(0).len()] } else { sample(tick - 2) };
                assert_eq!(bench.bits(&format!("{name}.3")), delayed, "{name} in tick {tick}");
            }
        }
    }
}

/// A wave among other types, so that its index and its counters' index are not multiples of the axes.
const MIXED: Types = &[I32_MATRIX, types::CH1_WAVES, BOOL_SCALAR, F32_SQUARE];

fn mixed(policy: &str) -> (Bench, Bench) {
    let (mut a, mut b) = (Bench::of(DOF, MIXED, &[]), Bench::of(DOF, &[], MIXED));
    for name in MIXED.iter().map(|found| found.name) {
        a.rows(&format!("COMM_TXMOD CTX_ADD_DATA {name}"));
        b.rows(&format!("COMM_RXMOD CRX_ADD_DATA {name}"));
    }
    a.run("MOD_ENG MOD_ON COMM_TXMOD");
    b.run(&format!("COMM_RXMOD STALE {policy}\nMOD_ENG MOD_ON COMM_RXMOD"));
    (a, b)
}

fn mixed_frame(tick: u8) -> Vec<Word> {
    let wave = [0.5, -0.25, 2.0].map(|share| Word::from(share * f32::from(tick + 1)));
    let integers = [-1, i32::MIN, 0x7FC0_0000, i32::from(tick), -2, 0].map(Word::from);
    let square = [1.0; 9].map(|one| Word::from(one / f32::from(tick + 1)));
    integers.into_iter().chain(wave).chain([Word(u32::from(tick) % 2)]).chain(square).collect()
}

#[test]
fn a_wave_among_other_types_keeps_its_counters_and_the_others_hold_what_came_last() {
    let (mut a, mut b) = mixed("INTEGRAL");
    let mut before = vec![Word(0); 19];
    let mut owed = [0.0; DOF];
    for tick in 0..30 {
        let measured = mixed_frame(tick);
        a.try_tick(&measured);
        let packet = a.dimsart.take_outgoing(0).unwrap();
        assert_eq!(packet.words.len(), 19 + 2 * DOF);
        let is_lost = tick % 5 == 3;
        if !is_lost {
            b.dimsart.receive(0, &packet.to_bytes()).unwrap();
        }
        let (_, commanded) = b.try_tick(&[]);
        let expected = if is_lost { &before } else { &measured };
        assert_eq!(commanded[..6], expected[..6]);
        assert_eq!(commanded[9..], expected[9..]);
        for axis in 0..DOF {
            let value = |words: &[Word]| f32::from_bits(words[6 + axis].0);
            owed[axis] += value(&measured) - value(&commanded);
        }
        before = commanded;
    }
    // The counters make up for a lost packet, except for the last digit.
    assert!(owed.iter().all(|owed: &f32| owed.abs() < 1e-3), "{owed:?}");
    assert_eq!(b.bits("LINK_REFUSED"), [0]);
}

#[test]
fn a_packet_is_refused_for_a_float_that_is_not_finite_and_for_no_other_word() {
    for place in 0..19 {
        let (mut a, mut b) = mixed("ZERO");
        a.try_tick(&mixed_frame(0));
        let mut packet = a.dimsart.take_outgoing(0).unwrap();
        packet.words[place] = f32::NAN.to_bits();
        b.dimsart.receive(0, &packet.to_bytes()).unwrap();
        let (ran, commanded) = b.try_tick(&[]);
        assert_eq!(ran, TickResult::Ran);
        let is_float = (6..9).contains(&place) || place >= 10;
        assert_eq!(b.bits("LINK_REFUSED"), [u32::from(is_float)], "word {place}");
        let expected = if is_float { 0 } else { f32::NAN.to_bits() };
        assert_eq!(commanded[place], Word(expected), "word {place}");
    }
}

#[test]
fn contents_of_different_formats_or_shapes_differ_and_their_packets_are_refused() {
    let all: Vec<&DataType> = FORMATS.iter().copied().flatten().copied().collect();
    let axes = [AxisKind::Linear; DOF];
    let ids = all.iter().map(|found| Content::of_channel(0, &[*found], &axes, 1, true).id());
    let mut ids: Vec<u16> = ids.collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 16);

    let mut a = Bench::of(DOF, &[I32_VECTOR], &[]);
    a.run("COMM_TXMOD CTX_ADD_DATA I32_VECTOR\nMOD_ENG MOD_ON COMM_TXMOD");
    let mut b = Bench::of(DOF, &[], &[U32_VECTOR]);
    b.run("COMM_RXMOD CRX_ADD_DATA U32_VECTOR\nMOD_ENG MOD_ON COMM_RXMOD");
    a.try_tick(&[1, 2, 3].map(Word));
    b.dimsart.receive(0, &a.dimsart.take_outgoing(0).unwrap().to_bytes()).unwrap();
    assert_eq!(b.try_tick(&[]).1, [Word(0); DOF]);
    assert_eq!(b.bits("LINK_REFUSED"), [1]);
}

#[test]
fn a_channel_that_does_not_fit_a_packet_is_not_plugged_in() {
    let mut bench = Bench::of(8, &[FITS, TOO_LONG], &[F32_SQUARE]);
    for (signal, words) in [("TOO_LONG", 49), ("F32_SQUARE", 64)] {
        for (module, add) in [("COMM_TXMOD", "CTX_ADD_DATA"), ("COMM_RXMOD", "CRX_ADD_DATA")] {
            bench.rows(&format!("{module} {add} {signal}"));
            let before = bench.snapshot();
            let refused = bench.order(&format!("MOD_ENG MOD_ON {module}"));
            assert_eq!(refused, Err(CommandError::PacketTooLong { words }));
            assert_eq!(bench.snapshot(), before);
            bench.rows(&format!("MOD_ENG MOD_CLOSE {module}"));
        }
    }
    bench.rows("COMM_TXMOD CTX_ADD_DATA FITS\nMOD_ENG MOD_ON COMM_TXMOD");
    // A wave adds counters: 48 and 8 of the wave, 16 of its counters.
    bench
        .rows("COMM_TXMOD.2 CTX_ADD_DATA FITS\nCOMM_TXMOD.2 CTX_ADD_DATA CH1_WAVES\nCOMM_TXMOD.2 CTX_LINK 1");
    let refused = bench.order("MOD_ENG MOD_ON COMM_TXMOD.2");
    assert_eq!(refused, Err(CommandError::PacketTooLong { words: 72 }));
}

#[test]
fn what_does_not_fit_a_port_is_a_fault_and_what_does_is_none() {
    let all: Vec<&DataType> = FORMATS.iter().copied().flatten().copied().collect();
    let device = || {
        let (outputs, inputs) = (
            &[F32_SCALAR, F32_VECTOR, F32_MATRIX, F32_SQUARE, I32_SCALAR, I32_VECTOR, I32_MATRIX, I32_SQUARE],
            &[
                U32_SCALAR,
                U32_VECTOR,
                U32_MATRIX,
                U32_SQUARE,
                BOOL_SCALAR,
                BOOL_VECTOR,
                BOOL_MATRIX,
                BOOL_SQUARE,
            ],
        );
        Bench::of(DOF, outputs, inputs)
    };
    for expected in &all {
        let mut bench = device();
        bench.rows(&format!("COMM_TXMOD CTX_COUNTERS OFF\nCOMM_TXMOD CTX_ADD_DATA {}", expected.name));
        for found in &all {
            bench.rows(&format!("COMM_TXMOD PORT_DATA_1 {}.2\nMOD_ENG MOD_ON COMM_TXMOD", found.name));
            let report = bench.dimsart.engine().check();
            let difference = report.findings().iter().find_map(|finding| match finding {
                Finding::Mismatch { mismatch, .. } => Some(*mismatch),
                _ => None,
            });
            let wanted = if expected.format != found.format {
                Some(TypeMismatch::Format)
            } else {
                (expected.shape != found.shape).then_some(TypeMismatch::Shape)
            };
            assert_eq!(difference, wanted, "{} where {} is expected", found.name, expected.name);
            bench.rows("MOD_ENG MOD_OFF COMM_TXMOD");

            bench.rows(&format!(
                "TIMEDELAY_MOD PORT_SIGNAL_IN {}.2\nTIMEDELAY_MOD PORT_SIGNAL_OUT {}.3\nTIMEDELAY_MOD TD_PARAM 1
                 MOD_ENG MOD_ON TIMEDELAY_MOD",
                expected.name, found.name
            ));
            let report = bench.dimsart.engine().check();
            let differ = report.findings().iter().filter(|finding| {
                matches!(
                    finding,
                    Finding::UnitsDiffer { port: 1, other_port: 0, relation: UnitRelation::SameType, .. }
                )
            });
            assert_eq!(differ.count(), usize::from(wanted.is_some()), "{} of {}", found.name, expected.name);
            bench.rows("MOD_ENG MOD_OFF TIMEDELAY_MOD");
        }
    }
}

#[test]
fn a_delay_says_what_it_wants_and_is_not_bound_anew_while_it_is_plugged_in() {
    let mut bench = Bench::of(DOF, &[I32_SQUARE, I32_VECTOR], &[]);
    bench.rows(
        "TIMEDELAY_MOD PORT_SIGNAL_IN I32_SQUARE\nTIMEDELAY_MOD PORT_SIGNAL_OUT I32_VECTOR.2
         TIMEDELAY_MOD TD_PARAM 4\nMOD_ENG MOD_ON TIMEDELAY_MOD",
    );
    assert_eq!(
        bench.findings(),
        [
            "TIMEDELAY_MOD has SIGNAL_IN bound to I32_SQUARE and SIGNAL_OUT bound to I32_VECTOR.2, but the second port must \
          have the unit, format and shape of the first: bind one of these ports to a compatible signal (PORT_... command)"
        ]
    );
    let module = ALL.module("TIMEDELAY_MOD").unwrap();
    let memory = |bench: &Bench| bench.dimsart.engine().memory(module).map(<[u32]>::len);
    assert_eq!(memory(&bench), Some(4 * 9));
    assert_eq!(bench.order("TIMEDELAY_MOD PORT_SIGNAL_IN I32_VECTOR"), Err(CommandError::PluggedIn(module)));
    bench.run(
        "MOD_ENG MOD_OFF TIMEDELAY_MOD\nTIMEDELAY_MOD PORT_SIGNAL_IN I32_VECTOR\nMOD_ENG MOD_ON TIMEDELAY_MOD",
    );
    assert_eq!(memory(&bench), Some(4 * 3));
}

#[test]
fn a_wide_signal_costs_what_one_of_as_many_axes_does() {
    const LINES: [Cost; 1 + ALL.list().len()] = [Cost::new(10, 1); 1 + ALL.list().len()];
    let mut bench = Bench::of(DOF, &[FITS], &[]);
    let limit = |cycles| NonZeroU32::new(cycles);
    bench.dimsart.engine_mut().set_costs(Some(Costs::new(&LINES, &IDS)));
    bench.dimsart.engine_mut().set_cycle_limit(limit(13 + 58 - 1));
    bench.rows("TIMEDELAY_MOD PORT_SIGNAL_IN FITS\nTIMEDELAY_MOD PORT_SIGNAL_OUT FITS.2");
    let before = bench.snapshot();
    let module = ALL.module("TIMEDELAY_MOD").unwrap();
    let too_slow = CommandError::TooSlow { module, cycles: 58, tick_cycles: 71, limit_cycles: 70 };
    assert_eq!(bench.order("MOD_ENG MOD_ON TIMEDELAY_MOD"), Err(too_slow));
    assert_eq!(bench.snapshot(), before);
    bench.dimsart.engine_mut().set_cycle_limit(limit(71));
    bench.rows("MOD_ENG MOD_ON TIMEDELAY_MOD");
    assert_eq!(bench.dimsart.engine().tick_cycles(), Some(71));
}

words! {
    ports Ports {
        real: Input = input("REAL", F32_VECTOR),
        integer: Input<Vector<i32>> = input("INTEGER", I32_VECTOR),
        count: Input<Vector<u32>> = input("COUNT", U32_VECTOR),
        flag: Input<Vector<bool>> = input("FLAG", BOOL_VECTOR),
        square: Input<Square<i32>> = input("SQUARE", I32_SQUARE),
        number: Input<ScalarSignal<u32>> = input("NUMBER", U32_SCALAR),
        real_out: Output = output("REAL_OUT", types::SIGNAL_OUT),
        integer_out: Output<Vector<i32>> = output("INTEGER_OUT", I32_VECTOR_OUT),
        count_out: Output<Vector<u32>> = output("COUNT_OUT", U32_VECTOR_OUT),
        flag_out: Output<Vector<bool>> = output("FLAG_OUT", BOOL_VECTOR_OUT),
        square_out: Output<Square<i32>> = output("SQUARE_OUT", I32_SQUARE_OUT),
        matrix_out: Output<Matrix<2, 3>> = output("MATRIX_OUT", F32_MATRIX),
    }
}

/// Converts every format into another one, and transposes a square matrix.
#[derive(Debug)]
struct Turn;

impl Module for Turn {
    const NAME: &'static str = "TURN_MOD";
    const SUMMARY: &'static str = "Turns formats into each other.";
    type Settings = ();
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    #[expect(clippy::cast_precision_loss, reason = "small numbers")]
    fn compute(context: &Context<'_, Self>) {
        let ports = context.ports();
        let inputs = (ports.real, ports.integer, ports.count, ports.flag);
        let outputs = (ports.real_out, ports.integer_out, ports.count_out, ports.flag_out);
        context.map_axes(inputs, outputs, |(), (), (real, integer, count, flag)| {
            (integer as f32, count.cast_signed(), u32::from(flag), real > 0.0)
        });
        context.map_axes([], (ports.real_out,), |(), (), []| (context.get(ports.number) as f32,));
        for row in 0..DOF {
            for column in 0..DOF {
                let element = context.element(ports.square, row, column);
                context.set_element(ports.square_out, column, row, element);
                context.set_element(ports.matrix_out, row, column, element as f32);
            }
        }
        assert_eq!(context.element(ports.square, DOF, 0), 0, "outside the matrix");
    }
}

own_types! {
    0x8020 I32_VECTOR_OUT  I32  Shape::Vector;
    0x8021 U32_VECTOR_OUT  U32  Shape::Vector;
    0x8022 BOOL_VECTOR_OUT Bool Shape::Vector;
    0x8023 I32_SQUARE_OUT  I32  Shape::Square;
}

const TURNS: ModuleKinds = dimsart_core::kinds![Turn];

#[test]
fn a_module_reads_and_writes_axes_of_mixed_formats_and_square_matrices() {
    let outputs = &[F32_VECTOR, I32_VECTOR, U32_VECTOR, BOOL_VECTOR, I32_SQUARE, U32_SCALAR];
    let inputs =
        &[I32_VECTOR_OUT, U32_VECTOR_OUT, BOOL_VECTOR_OUT, I32_SQUARE_OUT, F32_MATRIX, types::SIGNAL_OUT];
    let mut bench = Bench::with_kinds(TURNS, DOF, outputs, inputs);
    bench.run("MOD_ENG MOD_ON TURN_MOD");
    let mut measured: Vec<Word> = [1.5, -2.0, 0.0].map(Word::from).into();
    measured.extend([-1, 2, i32::MIN].map(Word::from));
    measured.extend([u32::MAX, 7, 0].map(Word::from));
    measured.extend([true, false, true].map(Word::from));
    measured.extend([1, 2, 3, 4, 5, 6, 7, 8, 9].map(|element: i32| Word::from(element)));
    measured.push(Word(12));
    let (tick, commanded) = bench.try_tick(&measured);
    assert_eq!(tick, TickResult::Ran);
    let mut expected: Vec<Word> = [-1, 7, 0].map(|value: i32| Word::from(value)).into();
    expected.extend([1, 0, 1].map(|value: u32| Word::from(value)));
    expected.extend([true, false, false].map(Word::from));
    expected.extend([1, 4, 7, 2, 5, 8, 3, 6, 9].map(|element: i32| Word::from(element)));
    expected.extend([1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|element: f32| Word::from(element)));
    expected.extend([12.0; DOF].map(|number: f32| Word::from(number)));
    assert_eq!(commanded, expected);
}

#[test]
fn a_square_has_a_row_and_a_column_for_each_axis() {
    for dof in 1..=8 {
        let device =
            DeviceDescriptor::new("arm", &vec![AxisKind::Linear; dof], 1e-3, &[I32_SQUARE], &[]).unwrap();
        assert_eq!(I32_SQUARE.shape.words(device.dof()), dof * dof);
        let mut bench = Bench::of(dof, &[I32_SQUARE], &[]);
        bench.run("MOD_ENG MATCHING_CHECK");
        let words: Vec<Word> = (0..u32::try_from(dof * dof).unwrap()).map(|word| Word(!word)).collect();
        assert_eq!(bench.try_tick(&words).0, TickResult::Ran);
        assert!(bench.bits("I32_SQUARE").iter().copied().eq(words.iter().map(|word| word.0)));
    }
}

#[test]
fn a_packet_of_every_word_of_integers_survives_its_bytes() {
    let words = edges(Format::I32).iter().copied().collect();
    let packet = Packet { channel: 3, counter: 9, echo: 1, content: 77, words };
    assert_eq!(Packet::from_bytes(&packet.to_bytes(), 3), Ok(packet));
}
