use super::*;
use dimsart_core::envelope::{Class, HEADER_BYTES, seal};

const MEDIA: [CarrierKind; 4] = [CarrierKind::Uart, CarrierKind::Can, CarrierKind::CanFd, CarrierKind::Udp];

fn scenario(carrier: CarrierKind, sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let mut scenario = Scenario::load(None, &sets).unwrap();
    scenario.link.carrier = carrier;
    (scenario.link.forward_delay_ticks, scenario.link.backward_delay_ticks) = (0, 0);
    scenario
}

/// A packet of Table 1 for 3 axes: 47 bytes.
fn packet(counter: u16) -> Vec<u8> {
    let mut bytes = [0; 64];
    bytes[HEADER_BYTES..HEADER_BYTES + 40].fill(counter.to_le_bytes()[0]);
    seal(Class::Packet, 0, counter, 40, &mut bytes).unwrap().to_vec()
}

/// What arrived, with its tick.
type Arrivals = Vec<(u64, Vec<u8>)>;

/// Sends a packet a tick both ways, and gives what arrived at the slave, with its tick, and the links.
fn run(scenario: &Scenario, ticks: u16) -> (Arrivals, [Box<dyn Link>; 2]) {
    let ends = Ends { forward_channel: 0, backward_channel: 0 };
    let [mut forward, mut backward] = Carrier::new(scenario).unwrap().connect(ends);
    let mut arrived = Vec::new();
    for counter in 1..=ticks {
        let now = u64::from(counter) - 1;
        backward.receive(now, &mut |_| {});
        forward.send(now, &packet(counter));
        forward.receive(now, &mut |bytes| arrived.push((now, bytes.to_vec())));
        backward.send(now, &packet(counter));
    }
    (arrived, [forward, backward])
}

#[test]
fn what_goes_into_a_clean_medium_comes_out_of_it_a_tick_later() {
    for carrier in MEDIA {
        let (arrived, [forward, _]) = run(&scenario(carrier, &["can.bits_per_s=4000000"]), 200);
        let expected: Vec<_> = (1..200).map(|counter| (u64::from(counter), packet(counter))).collect();
        assert_eq!(arrived, expected, "{carrier:?}");
        let traffic = forward.report(200).unwrap().traffic;
        assert_eq!((traffic.packets, traffic.dropped, traffic.errors), (200, 0, 0), "{traffic:?}");
        assert!(traffic.load > 0.0 && traffic.load < 1.0 && traffic.longest_s < 1e-3, "{traffic:?}");
    }
}

/// 50 bytes of 10 bits at 921 600 baud are 0.5425 ms a tick.
#[test]
fn the_load_of_a_uart_is_that_of_its_bytes() {
    let (_, [forward, backward]) = run(&scenario(CarrierKind::Uart, &[]), 1000);
    for link in [forward, backward] {
        let load = link.report(1000).unwrap().traffic.load;
        assert!((load - 500.0 / 921.6).abs() < 1e-3, "{load}");
    }
}

#[test]
fn a_full_line_is_a_figure_and_a_fault() {
    for (carrier, set) in [
        (CarrierKind::Uart, "uart.bits_per_s=115200"),
        (CarrierKind::Can, "can.bits_per_s=500000"),
        (CarrierKind::CanFd, "can.other_nodes=20"),
        (CarrierKind::Udp, "udp.forward_bits_per_s=100000"),
    ] {
        let more = "udp.queue_bytes=600";
        let (_, [forward, _]) = run(&scenario(carrier, &[set, more]), 500);
        let report = forward.report(500).unwrap();
        assert!(report.traffic.load > 0.9, "{:?}", report.traffic);
        let is_told = report.faults.iter().any(|fault| fault.contains("the line is full"));
        assert_eq!(is_told, report.traffic.dropped > 0, "{report:?}");
        assert!(is_told || carrier == CarrierKind::CanFd, "{report:?}");
    }
}

#[test]
fn what_other_nodes_lose_and_a_shared_identifier_are_faults() {
    let faults = |scenario: &Scenario, channel| {
        let ends = Ends { forward_channel: channel, backward_channel: channel };
        let [mut forward, _] = Carrier::new(scenario).unwrap().connect(ends);
        for now in 0..500 {
            forward.send(now, &packet(1));
        }
        forward.report(500).unwrap().faults
    };
    let crowded = faults(&scenario(CarrierKind::CanFd, &["can.other_nodes=20"]), 0);
    assert!(crowded.iter().any(|fault| fault.contains("packets of the other nodes")), "{crowded:?}");
    let shared = faults(&scenario(CarrierKind::CanFd, &[]), 16);
    assert!(shared.iter().any(|fault| fault.contains("both sides send on channel 16")), "{shared:?}");
    assert_eq!(faults(&scenario(CarrierKind::CanFd, &[]), 0), [""; 0]);
}

#[test]
fn a_packet_that_no_frame_carries_is_a_fault() {
    let scenario = scenario(CarrierKind::CanFd, &[]);
    let ends = Ends { forward_channel: 0, backward_channel: 0 };
    let [mut forward, _] = Carrier::new(&scenario).unwrap().connect(ends);
    forward.send(0, &[0; 64]);
    let report = forward.report(1).unwrap();
    assert_eq!(report.traffic.dropped, 1);
    assert!(report.faults[0].contains("longer than it can carry"), "{:?}", report.faults);
}

#[test]
fn errors_lose_packets_and_damage_none_unseen_and_the_seed_decides_them() {
    for (carrier, set) in [
        (CarrierKind::Uart, "uart.bit_error_rate=1e-3"),
        (CarrierKind::Uart, "uart.byte_drop=0.01"),
        (CarrierKind::Uart, "uart.byte_insert=0.01"),
        (CarrierKind::CanFd, "can.bit_error_rate=1e-4"),
        (CarrierKind::Udp, "udp.burst_start=0.1"),
    ] {
        let scenario = scenario(carrier, &[set]);
        let (arrived, [forward, _]) = run(&scenario, 500);
        assert!(forward.report(500).unwrap().traffic.errors > 10, "{set}");
        assert_eq!(run(&scenario, 500).0, arrived, "{set}");
        let is_sent = |bytes: &[u8]| (1..=500).any(|counter| packet(counter) == bytes);
        let sealed = arrived
            .iter()
            .filter_map(|(_, bytes)| dimsart_core::envelope::open(bytes, 0).is_ok().then_some(bytes));
        assert!(sealed.clone().count() > 100 && sealed.clone().all(|bytes| is_sent(bytes)), "{set}");
    }
}

#[test]
fn the_planned_round_trip_is_not_exceeded() {
    let sets = ["udp.delay=uniform", "udp.delay_s=0.01", "udp.spread_s=0.005", "can.bits_per_s=2000000"];
    for carrier in MEDIA {
        let scenario = scenario(carrier, &sets);
        let planned = Carrier::new(&scenario).unwrap().round_trip_ticks();
        let (arrived, _) = run(&scenario, 300);
        let counter = |bytes: &[u8]| u64::from(u16::from_le_bytes([bytes[1], bytes[2]]));
        let longest = arrived.iter().map(|(now, bytes)| now + 1 - counter(bytes)).max().unwrap();
        assert!(2 * longest <= u64::from(planned), "{carrier:?}: {longest} twice, {planned} planned");
    }
}
