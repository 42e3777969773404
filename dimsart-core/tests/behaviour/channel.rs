//! Agreement of two ends of a link: a packet of another content is refused.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::float_cmp, reason = "compared to the bit on purpose")]

use crate::common::{Bench, H, Types};
use dimsart_core::{
    AxisKind, CommandError, DeviceDescriptor, Dimsart, ParameterError, ProvidedMemory, types,
};
use dimsart_modules::ALL;

/// A sender and a receiver of these types; returns whether the receiver accepts the packets.
fn is_taken(sent: &[&str], received: &[&str], [from, to]: [&[AxisKind]; 2]) -> bool {
    let bench = |axes, rows: &str, outputs| {
        let device = DeviceDescriptor::new("bench", axes, H, outputs, &[]).unwrap();
        let mut bench: Bench =
            Bench { dimsart: Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap() };
        bench.run(rows);
        bench
    };
    let add = |module: &str, command: &str, types: &[&str]| {
        let adds: String = types.iter().map(|name| format!("{module} {command} {name}\n")).collect();
        adds + "MOD_ENG MOD_ON " + module
    };
    let measured: Types = &[types::POSITION, types::VELOCITY, types::FORCE, types::CH1_WAVES];
    let mut sender = bench(from, &add("COMM_TXMOD", "CTX_ADD_DATA", sent), measured);
    let mut receiver = bench(to, &add("COMM_RXMOD", "CRX_ADD_DATA", received), &[]);
    sender.tick(&vec![0.5; 4 * from.len()]);
    receiver.dimsart.receive(0, &sender.dimsart.take_outgoing(0).unwrap().to_bytes()).unwrap();
    receiver.tick(&[]);
    let refused = receiver.bits("LINK_REFUSED")[0];
    let values = received.iter().flat_map(|name| receiver.signal(name));
    let expected = if refused == 0 { 0.5 } else { 0.0 };
    assert!(values.into_iter().all(|value| value == expected), "{sent:?}, {received:?}");
    assert_eq!(refused + (1 - receiver.bits("LINK_AGE")[0]), 1);
    refused == 0
}

#[test]
fn a_packet_of_other_units_or_axes_is_refused_and_counted() {
    use AxisKind::{Linear, Rotary};
    let same = [&[Linear; 3][..]; 2];
    assert!(is_taken(&["POSITION", "CH1_WAVES"], &["DES_POSITION", "CH2_WAVES"], same));
    for (sent, received) in [
        (&["POSITION"][..], &["DES_VELOCITY"][..]),
        (&["FORCE", "POSITION"], &["DES_POSITION", "FORCE"]),
        (&["POSITION", "CH1_WAVES"], &["CH2_WAVES", "DES_POSITION"]),
        (&["POSITION", "FORCE", "VELOCITY"], &["CH2_WAVES"]),
        (&["POSITION"], &["SIGNAL"]),
        (&["POSITION"], &["DES_POSITION", "FORCE"]),
    ] {
        assert!(!is_taken(sent, received, same), "{sent:?}, {received:?}");
    }
    let positions = |from, to| is_taken(&["POSITION"], &["DES_POSITION"], [from, to]);
    assert!(positions(&[Rotary, Linear], &[Rotary, Linear]));
    assert!(!positions(&[Rotary, Linear], &[Linear, Rotary]));
    assert!(!is_taken(&["POSITION", "POSITION"], &["DES_POSITION"], [&[Linear], &[Linear; 2]]));
}

#[test]
fn a_packet_with_a_sample_that_is_no_number_never_came() {
    for policy in ["ZERO", "HOLD", "LIMITED", "INTEGRAL"] {
        let mut sender = Bench::of(1, &[types::CH1_WAVES], &[]);
        sender.run("COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD");
        let mut receiver = Bench::of(1, &[], &[]);
        receiver.run(&format!(
            "COMM_RXMOD STALE {policy}\nCOMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD"
        ));
        // Refused, lost and age after a packet with this word changed.
        let mut pass = |word: usize, bits: Option<u32>| {
            sender.tick(&[1.0]);
            let mut packet = sender.dimsart.take_outgoing(0).unwrap();
            packet.words[word] = bits.unwrap_or(packet.words[word]);
            receiver.dimsart.receive(0, &packet.to_bytes()).unwrap();
            receiver.tick(&[]);
            assert!(receiver.signal("CH2_WAVES")[0].is_finite(), "{policy}");
            ["LINK_REFUSED", "LINK_LOST", "LINK_AGE"].map(|name| receiver.bits(name)[0])
        };
        assert_eq!(pass(0, None), [0, 0, 0]);
        for (count, bad) in (1..).zip([f32::NAN, f32::INFINITY, f32::NEG_INFINITY]) {
            assert_eq!(pass(0, Some(bad.to_bits())), [count, 0, count], "{policy}");
        }
        // Counters may have any value; the packets in between count as lost.
        assert_eq!(pass(1, Some(f32::NAN.to_bits())), [3, 3, 0], "{policy}");
    }
}

#[test]
fn three_axes_of_waves_fit_the_channel_of_rokviss() {
    // 245 kbit/s up at 500 Hz (Preusche et al., ROKVISS, 2006): 61 bytes a packet.
    const UP_BITS_PER_S: usize = 245_000;
    let mut bench = Bench::of(3, &[types::CH1_WAVES], &[]);
    bench.run("COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD");
    bench.tick(&[1.0; 3]);
    let bytes = bench.dimsart.take_outgoing(0).unwrap().to_bytes().len();
    // Including COBS overhead and delimiter on a byte stream.
    assert!((bytes + 2) * 8 * 500 <= UP_BITS_PER_S, "{bytes} bytes");
}

/// A coordinator of three axes, and joints of one axis each.
#[test]
fn one_axis_goes_to_a_device_of_one_axis_and_comes_back() {
    use AxisKind::{Linear, Rotary};
    let axes = [Rotary, Linear, Rotary];
    let device = DeviceDescriptor::new(
        "coordinator",
        &axes,
        H,
        &[types::POSITION, types::FORCE, types::CH1_WAVES, types::TICK_CYCLES],
        &[],
    );
    for axis in 0..3 {
        let mut coordinator: Bench = Bench {
            dimsart: Dimsart::new(ProvidedMemory::leak_default(), device.clone().unwrap(), ALL).unwrap(),
        };
        let adds = |module: &str, command: &str, types: &[&str]| {
            types.iter().map(|name| format!("{module} {command} {name}\n")).collect::<String>()
        };
        let sent = adds("COMM_TXMOD", "CTX_ADD_DATA", &["POSITION", "CH1_WAVES", "TICK_CYCLES"]);
        let back = adds("COMM_RXMOD", "CRX_ADD_DATA", &["DES_POSITION", "LINK_LOST.2", "CH2_WAVES"]);
        coordinator.run(&format!(
            "COMM_TXMOD CTX_AXIS {axis}\n{sent}MOD_ENG MOD_ON COMM_TXMOD\n\
             COMM_RXMOD CRX_AXIS {axis}\n{back}MOD_ENG MOD_ON COMM_RXMOD"
        ));
        let joint = DeviceDescriptor::new("joint", &axes[axis..=axis], H, &[types::POSITION], &[]).unwrap();
        let mut joint: Bench =
            Bench { dimsart: Dimsart::new(ProvidedMemory::leak_default(), joint, ALL).unwrap() };
        let taken = adds("COMM_RXMOD", "CRX_ADD_DATA", &["DES_POSITION", "CH2_WAVES", "LINK_LOST.2"]);
        let sent = adds("COMM_TXMOD", "CTX_ADD_DATA", &["POSITION", "LINK_LOST.2", "CH2_WAVES"]);
        joint.run(&format!(
            "COMM_RXMOD CRX_COUNTERS OFF\n{taken}MOD_ENG MOD_ON COMM_RXMOD\n\
             COMM_TXMOD CTX_COUNTERS OFF\n{sent}MOD_ENG MOD_ON COMM_TXMOD"
        ));
        for tick in 1..4_u8 {
            let value = |place: u8| f32::from(10 * tick + place);
            let measured: Vec<f32> = (0..9).map(value).chain([f32::from_bits(77)]).collect();
            coordinator.tick(&measured);
            let packet = coordinator.dimsart.take_outgoing(0).unwrap();
            assert_eq!(packet.words.len(), 3);
            joint.dimsart.receive(0, &packet.to_bytes()).unwrap();
            joint.tick(&[0.25]);
            let axis_value = measured[axis];
            assert_eq!(joint.signal("DES_POSITION"), [axis_value]);
            assert_eq!(joint.signal("CH2_WAVES"), [measured[6 + axis]]);
            assert_eq!(joint.bits("LINK_LOST.2"), [77]);
            coordinator.dimsart.receive(0, &joint.dimsart.take_outgoing(0).unwrap().to_bytes()).unwrap();
            coordinator.tick(&measured);
            let alone =
                |value: f32| (0..3).map(|place| if place == axis { value } else { 0.0 }).collect::<Vec<_>>();
            assert_eq!(coordinator.signal("DES_POSITION"), alone(0.25));
            assert_eq!(coordinator.signal("CH2_WAVES"), alone(measured[6 + axis]));
            assert_eq!(coordinator.bits("LINK_REFUSED"), [0]);
        }
    }
}

#[test]
fn an_axis_that_the_device_has_not_is_refused() {
    let mut bench = Bench::of(3, &[types::POSITION], &[]);
    bench.run("COMM_TXMOD CTX_ADD_DATA POSITION\nCOMM_TXMOD CTX_AXIS 3");
    let refused = bench.order("MOD_ENG MOD_ON COMM_TXMOD");
    assert_eq!(refused, Err(CommandError::Parameter(ParameterError::NoSuchEntry)));
    bench.run("COMM_TXMOD CTX_AXIS 2\nMOD_ENG MOD_ON COMM_TXMOD");
    // Loss compensation needs counters, which apply to all axes.
    bench.run("COMM_RXMOD CRX_AXIS 1");
    let refused = bench.order("COMM_RXMOD STALE LIMITED");
    assert_eq!(refused, Err(CommandError::Parameter(ParameterError::NeedsCounters)));
}

/// Schemes are the same for all controllers, but some have fewer links.
#[test]
fn a_link_that_the_controller_has_not_is_refused() {
    let mut bench = Bench::of(3, &[types::POSITION], &[]);
    bench.rows("COMM_TXMOD CTX_ADD_DATA POSITION");
    for link in 0..8 {
        bench.rows(&format!("COMM_TXMOD CTX_LINK {link}"));
        let plugged_in = bench.order("MOD_ENG MOD_ON COMM_TXMOD");
        if link < dimsart_core::limits::Capacities::DEFAULT.links {
            assert_eq!(plugged_in, Ok(()), "{link}");
            bench.rows("MOD_ENG MOD_OFF COMM_TXMOD");
        } else {
            assert_eq!(plugged_in, Err(CommandError::Parameter(ParameterError::OutOfRange)), "{link}");
        }
    }
}
