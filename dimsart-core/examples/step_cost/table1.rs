//! Table 1 compared with a hand-written version: identical results, instructions of each.

use by_hand::{DOF, Master, PACKET_WORDS};
use dimsart_core::{
    AxisKind, DeviceDescriptor, Dimsart, Packet, ProvidedMemory, TickResult, Word, scheme, types,
};
use dimsart_modules::ALL;

const SCHEME: &str = include_str!("../../../schemes/bilateral.scheme");

fn side(name: &'static str) -> Dimsart {
    let axes = [AxisKind::Linear; DOF];
    let device = DeviceDescriptor::new(name, &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device.expect("a sound device"), ALL)
        .expect("an empty Data Base");
    let faults =
        scheme::load(SCHEME, name, &["master", "slave"], &mut dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(faults, 0, "bilateral.scheme does not load");
    dimsart
}

/// Marks the code that callgrind counts: the modular master.
#[inline(never)]
fn counted_table1(master: &mut Dimsart, measured: &[Word; DOF], commanded: &mut [Word; DOF]) -> TickResult {
    master.tick(measured, commanded)
}

/// Runs both masters with the same slave and compares every signal and packet.
///
/// With `packets` a new packet arrives in every tick, otherwise never.
pub(crate) fn run(ticks: u32, packets: bool) {
    let (mut master, mut slave) = (side("master"), side("slave"));
    let mut by_hand = Master::new();
    let mut hand_packet = by_hand::Packet { is_finite: true, ..by_hand::Packet::default() };
    let mut slave_axes = [(0.0_f32, 0.0_f32); DOF];
    for tick in 0..ticks {
        let position = master_position(tick);
        let measured = position.map(Word::from);
        let mut commanded = [Word(0); DOF];
        let mut hand_force = [0.0; DOF];

        let received = slave.take_outgoing(0).filter(|_| packets);
        if let Some(packet) = &received {
            master.receive(0, &packet.to_bytes()).expect("an intact packet");
        }
        let received = received.as_ref().map(to_hand);

        let has_run = counted_table1(&mut master, &measured, &mut commanded) == TickResult::Ran;
        // Without packets both command zero after their timeout.
        assert_eq!(
            has_run,
            by_hand.tick(&position, received.as_ref(), &mut hand_force, &mut hand_packet),
            "{tick}"
        );

        let packet = master.take_outgoing(0).expect("a packet every tick");
        assert_eq!(to_hand(&packet), hand_packet, "packets differ in tick {tick}");
        assert_eq!(commanded, hand_force.map(Word::from), "forces differ in tick {tick}");
        compare(&master, &by_hand, tick);

        slave.receive(0, &packet.to_bytes()).expect("an intact packet");
        let mut slave_force = [Word(0); DOF];
        assert_eq!(slave.tick(&slave_axes.map(|(x, _)| Word::from(x)), &mut slave_force), TickResult::Ran);
        for ((x, velocity), force) in slave_axes.iter_mut().zip(slave_force) {
            *velocity += 1e-3 * (f32::from_bits(force.0) - 5.0 * *velocity);
            *x += 1e-3 * *velocity;
        }
    }
}

/// A hand that moves each axis back and forth at its own frequency.
fn master_position(tick: u32) -> [f32; DOF] {
    let triangle = |period: u32| {
        let phase = u16::try_from(tick % period).unwrap_or_default();
        let phase = f32::from(phase) / f32::from(u16::try_from(period).unwrap_or(1));
        0.1 * (2.0 * phase - 1.0).abs()
    };
    [triangle(1000), triangle(1700), triangle(2300)]
}

fn to_hand(packet: &Packet) -> by_hand::Packet {
    let mut words = [0; PACKET_WORDS];
    assert_eq!(packet.words.len(), PACKET_WORDS);
    for (to, from) in words.iter_mut().zip(&packet.words) {
        *to = *from;
    }
    let is_finite = words.iter().take(DOF).all(|word| f32::from_bits(*word).is_finite());
    by_hand::Packet { content: packet.content, counter: packet.counter, echo: packet.echo, words, is_finite }
}

fn compare(master: &Dimsart, by_hand: &Master, tick: u32) {
    let signals = &by_hand.signals;
    let vectors = [
        (types::POSITION, signals.position),
        (types::CH2_WAVES, signals.wave_in),
        (types::DES_POSITION, signals.desired_position),
        (types::DES_FORCE, signals.force),
        (types::CH1_WAVES, signals.wave_out),
        (types::CH1_TD_WAVES, signals.delayed_wave),
        (types::LINE_FORCE, signals.line_force),
        (types::LINE_VELOCITY, signals.line_velocity),
    ];
    let scalars = [
        (types::LINK_AGE, signals.age_ticks),
        (types::LINK_LOST, signals.lost),
        (types::LINK_ROUND_TRIP, signals.round_trip_ticks),
        (types::LINK_REFUSED, signals.refused),
        (types::LINK_STATE, signals.state as u32),
        (types::LINK_JITTER, signals.jitter_ticks.to_bits()),
    ];
    let data_base = master.engine().data_base();
    let words = |data_type: &dimsart_core::DataType| {
        data_base.slot(data_type.first()).map(|slot| data_base.words(slot)).unwrap_or_default()
    };
    for (data_type, values) in vectors {
        assert_eq!(words(data_type), values.map(f32::to_bits), "{} differs in tick {tick}", data_type.name);
    }
    for (data_type, value) in scalars {
        assert_eq!(words(data_type), [value], "{} differs in tick {tick}", data_type.name);
    }
}
