//! What two ends of a link must agree on: a packet of another content is refused, and fits the channel.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]
#![expect(clippy::float_cmp, reason = "compared to the bit on purpose")]

use crate::common::{Bench, H, Types};
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, types};

/// A sender and a receiver of these types, and whether the receiver takes what is sent.
fn is_taken(sent: &[&str], received: &[&str], [from, to]: [&[AxisKind]; 2]) -> bool {
    let bench = |axes, rows: &str, outputs| {
        let device = DeviceDescriptor::new("bench", axes, H, outputs, &[]).unwrap();
        let mut bench: Bench = Bench { dimsart: Dimsart::new(device).unwrap() };
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
    receiver.dimsart.receive(0, &sender.dimsart.outgoing(0).unwrap().to_bytes()).unwrap();
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
        let mut sender: Bench = Bench::of(1, &[types::CH1_WAVES], &[]);
        sender.run("COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD");
        let mut receiver: Bench = Bench::of(1, &[], &[]);
        receiver.run(&format!(
            "COMM_RXMOD STALE {policy}\nCOMM_RXMOD CRX_ADD_DATA CH2_WAVES\nMOD_ENG MOD_ON COMM_RXMOD"
        ));
        // Refused, lost and age after a packet with this word changed.
        let mut pass = |word: usize, bits: Option<u32>| {
            sender.tick(&[1.0]);
            let mut packet = sender.dimsart.outgoing(0).unwrap();
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
        // Counters may be any number; the packets in between were lost for the scheme.
        assert_eq!(pass(1, Some(f32::NAN.to_bits())), [3, 3, 0], "{policy}");
    }
}

#[test]
fn three_axes_of_waves_fit_the_channel_of_rokviss() {
    // 245 kbit/s up at 500 Hz (Preusche et al., ROKVISS, 2006): 61 bytes a packet.
    const UP_BITS_PER_S: usize = 245_000;
    let mut bench: Bench = Bench::of(3, &[types::CH1_WAVES], &[]);
    bench.run("COMM_TXMOD CTX_ADD_DATA CH1_WAVES\nMOD_ENG MOD_ON COMM_TXMOD");
    bench.tick(&[1.0; 3]);
    let bytes = bench.dimsart.outgoing(0).unwrap().to_bytes().len();
    // With what COBS and its delimiter take on a byte stream.
    assert!((bytes + 2) * 8 * 500 <= UP_BITS_PER_S, "{bytes} bytes");
}
