//! The DBC file of a scheme decodes the frames of the firmware's code.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::collections::BTreeMap;
use std::process::Command;

use can_dbc::{
    AttributeValue, ByteOrder, Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType, ValueType,
};
use dimsart::dbc::{self, FrameFormat};
use dimsart_core::{
    AxisKind, DataType, DeviceDescriptor, Dimsart, Format, Packet, ProvidedMemory, Shape, Summary, Unit,
    Word, types,
};
use dimsart_link::carrier::{can, can_fd};
use dimsart_modules::ALL;
use hil_sim::schemes::device;
use hil_sim::schemes::{self, SchemeText};
use tempfile::TempDir;

const CHANNEL: u16 = 0x123;

/// The built-in scheme on other channels.
fn scheme() -> SchemeText {
    let text = SchemeText::read("builtin:bilateral").unwrap().text;
    let text = text.replace("_CHANNEL     1", &format!("_CHANNEL {CHANNEL}"));
    SchemeText { name: "bus.scheme".to_owned(), text: text.replace("_CHANNEL     2", "_CHANNEL 17") }
}

fn controller(dof: usize) -> Dimsart {
    let mut dimsart =
        Dimsart::new(ProvidedMemory::leak_default(), device("master", dof, 1e-3).unwrap(), ALL).unwrap();
    let loaded = schemes::load(&scheme(), "master", &[], &mut dimsart);
    assert!(loaded.is_valid(), "{loaded:?}");
    dimsart
}

/// A packet of a moving device, and its Data Base when the packet was sent.
fn packet(dof: usize) -> (Packet, Vec<f32>) {
    let mut dimsart = controller(dof);
    let mut commanded = vec![Word(0); dof];
    let mut packet = None;
    for tick in 0..40_u8 {
        let measured: Vec<Word> =
            (1..).take(dof).map(|axis: u8| Word::from(f32::from(tick * axis) * 1e-3)).collect();
        dimsart.tick(&measured, &mut commanded);
        packet = dimsart.take_outgoing(0);
    }
    let engine = dimsart.engine();
    let (slot, _) =
        engine.data_base().signals().find(|(_, entry)| entry.signal == types::CH1_TD_WAVES.first()).unwrap();
    let waves = engine.data_base().words(slot).iter().map(|word| f32::from_bits(*word)).collect();
    (packet.unwrap(), waves)
}

/// Decodes frames as a CAN tool does, only with the DBC: raw bits of every signal.
fn read(dbc: &Dbc, identifier: u16, frames: &[Vec<u8>]) -> BTreeMap<String, u64> {
    let message = dbc.messages.iter().find(|found| found.id == MessageId::Standard(identifier)).unwrap();
    let mut found = BTreeMap::new();
    for frame in frames {
        assert!(frame.len() as u64 <= message.size);
        let bits = |start: u64, size: u64| {
            (0..size).fold(0, |value, bit| {
                let place = usize::try_from(start + bit).unwrap();
                value | u64::from(frame[place / 8] >> (place % 8) & 1) << bit
            })
        };
        let index = message
            .signals
            .iter()
            .find(|signal| matches!(signal.multiplexer_indicator, MultiplexIndicator::Multiplexor));
        let index = index.map(|signal| bits(signal.start_bit, signal.size));
        for signal in &message.signals {
            assert_eq!(signal.byte_order, ByteOrder::LittleEndian);
            match signal.multiplexer_indicator {
                MultiplexIndicator::MultiplexedSignal(only) if Some(only) != index => continue,
                _ => found.insert(signal.name.clone(), bits(signal.start_bit, signal.size)),
            };
        }
    }
    found
}

fn dbc(controller: &mut Dimsart, frames: FrameFormat) -> Dbc {
    let messages = dbc::messages(controller, "master", frames).unwrap();
    Dbc::try_from(dbc::Dbc::new(messages).unwrap().to_string().as_str()).unwrap()
}

fn check(dof: usize, frames: FrameFormat) {
    let dbc = dbc(&mut controller(dof), frames);
    let (packet, waves) = packet(dof);
    let content = packet.to_bytes();
    let data: Vec<Vec<u8>> = match frames {
        FrameFormat::Can => can::frames(&content, CHANNEL).unwrap().map(|frame| frame.to_vec()).collect(),
        FrameFormat::CanFd => vec![can_fd::pack(&content).unwrap().to_vec()],
    };
    let found = read(&dbc, CHANNEL, &data);
    assert!(waves.iter().any(|wave| *wave != 0.0), "something moves");
    for (axis, wave) in (1..).zip(&waves) {
        assert_eq!(found[&format!("CH1_TD_WAVES_{axis}")], u64::from(wave.to_bits()), "axis {axis}");
        let counters = &packet.words[dof + 2 * (axis - 1)..][..2];
        assert_eq!(found[&format!("SENT_WAVES_{axis}")], u64::from(counters[0]));
        assert_eq!(found[&format!("SENT_ENERGY_{axis}")], u64::from(counters[1]));
    }
    assert_eq!(found["CONTENT"], u64::from(packet.content));
    assert_eq!(found["ECHO"], u64::from(packet.echo));
    let counter = match frames {
        FrameFormat::Can => found["COUNTER_HIGH"] << 4 | found["COUNTER_LOW"],
        FrameFormat::CanFd => found["COUNTER"],
    };
    assert_eq!(counter, u64::from(packet.counter));
    let reals = dbc.signal_extended_value_type_list.iter();
    assert!(
        reals.clone().all(|list| list.signal_extended_value_type == SignalExtendedValueType::IEEEfloat32Bit)
    );
    assert_eq!(reals.count(), dof);
    let (format, bus_type) = match frames {
        FrameFormat::Can => (0, None),
        FrameFormat::CanFd => (14, Some("CAN FD")),
    };
    assert_eq!(dbc.attribute_values_message.len(), 1);
    let value = &dbc.attribute_values_message[0];
    assert_eq!((value.name.as_str(), value.message_id), ("VFrameFormat", MessageId::Standard(CHANNEL)));
    assert_eq!(value.value, AttributeValue::Uint(format));
    let found = dbc.attribute_values_database.first().map(|value| (value.name.as_str(), &value.value));
    let expected = bus_type.map(|name| AttributeValue::String(name.to_owned()));
    assert_eq!(found, expected.as_ref().map(|value| ("BusType", value)));
    let unit = &dbc.messages[0].signals.iter().find(|signal| signal.name == "CH1_TD_WAVES_1").unwrap().unit;
    assert_eq!(unit, "sqrt(W)");
}

#[test]
fn a_number_with_a_sign_is_read_with_it() {
    const TURNS: &DataType = &DataType {
        id: 0x8000,
        name: "TURNS",
        unit: Unit::Position,
        format: Format::I32,
        shape: Shape::Scalar,
        summary: Summary::new(""),
    };
    let axes = [AxisKind::Linear, AxisKind::Rotary];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[TURNS], &[]).unwrap();
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap();
    let rows = format!(
        "all COMM_TXMOD CTX_ADD_DATA TURNS\nall COMM_TXMOD CTX_COUNTERS OFF\nall COMM_TXMOD CTX_CHANNEL {CHANNEL}\n\
         all MOD_ENG MOD_ON COMM_TXMOD\nall MOD_ENG MATCHING_CHECK"
    );
    let rows = SchemeText { name: "turns.scheme".to_owned(), text: rows };
    let loaded = schemes::load(&rows, "master", &[], &mut dimsart);
    assert!(loaded.is_valid(), "{loaded:?}");
    let dbc = dbc(&mut dimsart, FrameFormat::Can);
    let signal = dbc.messages[0].signals.iter().find(|signal| signal.name == "TURNS").unwrap();
    assert_eq!((signal.value_type, signal.size, signal.unit.as_str()), (ValueType::Signed, 32, "m or rad"));
    for turns in [-7, 0, 7, i32::MIN, i32::MAX] {
        dimsart.tick(&[turns.into()], &mut []);
        let content = dimsart.take_outgoing(0).unwrap().to_bytes();
        let frames: Vec<_> = can::frames(&content, CHANNEL).unwrap().map(|frame| frame.to_vec()).collect();
        let bits = u32::try_from(read(&dbc, CHANNEL, &frames)["TURNS"]).unwrap();
        assert_eq!(bits.cast_signed(), turns);
    }
}

#[test]
fn classic_can_frames_are_read_by_the_dbc() {
    (1..=5).for_each(|dof| check(dof, FrameFormat::Can));
}

#[test]
fn can_fd_frames_are_read_by_the_dbc() {
    (1..=4).for_each(|dof| check(dof, FrameFormat::CanFd));
}

#[test]
fn what_does_not_fit_is_said() {
    let error = dbc::messages(&mut controller(6), "master", FrameFormat::Can).unwrap_err().to_string();
    assert!(error.contains("18 words") && error.contains("maximum 16"), "{error}");
}

#[test]
fn the_command_writes_both_sides_and_says_what_is_missing() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("bus.scheme");
    std::fs::write(&path, scheme().text).unwrap();
    let dimsart = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_dimsart")).arg("dbc").args(arguments).output().unwrap();
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        (output.status.success(), text)
    };
    let (is_done, [written, _]) = dimsart(&[path.to_str().unwrap()]);
    assert!(is_done);
    let dbc = Dbc::try_from(written.as_str()).unwrap();
    assert_eq!(
        dbc.messages.iter().map(|message| message.id).collect::<Vec<_>>(),
        [MessageId::Standard(CHANNEL), MessageId::Standard(17)]
    );
    let text = scheme().text.replace("CTX_CHANNEL 17", &format!("CTX_CHANNEL {CHANNEL}"));
    std::fs::write(&path, text).unwrap();
    let (is_done, [_, error]) = dimsart(&[path.to_str().unwrap()]);
    let both = "duplicate channel 291: master_COMM_TXMOD and slave_COMM_TXMOD";
    assert!(!is_done && error.contains(both), "{error}");
    let text = scheme().text.replace("CTX_CHANNEL 17", "CTX_CHANNEL 0");
    std::fs::write(&path, text).unwrap();
    let (is_done, [_, error]) = dimsart(&[path.to_str().unwrap()]);
    assert!(!is_done && error.contains("CTX_CHANNEL n`, n from 1 to 2047"), "{error}");
}

#[test]
fn a_rigs_controllers_give_a_dbc_together_or_one_alone() {
    let dbc = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_dimsart")).arg("dbc").args(arguments).output().unwrap()
    };
    let messages = |arguments: &[&str]| {
        let output = dbc(arguments);
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        Dbc::try_from(text.as_str()).unwrap().messages.len()
    };
    assert_eq!(messages(&["arm_bus"]), 12, "six messages of the coordinator, and one per joint");
    assert_eq!(messages(&["arm_bus", "--controller", "coordinator"]), 6);
    for (arguments, status, expected) in [
        (
            &["arm_bus", "--controller", "finger"][..],
            2,
            "arm_bus has no controller finger: select one with --controller: coordinator, ",
        ),
        (&["arm_bus", "--dof", "1"], 2, "a rig defines"),
        (&["builtin:bilateral", "--controller", "joint"], 2, "--controller applies to rigs only"),
        (&["joint"], 1, "the scheme sends nothing on the joint"),
    ] {
        let output = dbc(arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(status), "{message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}
