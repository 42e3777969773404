use dimsart_core::envelope::{Class, HEADER_BYTES, seal};

use super::*;
use crate::link::InProcessParameters;

const MEDIA: [&str; 4] = ["uart", "can", "can_fd", "udp"];

fn rig(carrier: &str, sets: &[&str]) -> RigFile {
    let none = ["link.forward_delay_ticks=0", "link.backward_delay_ticks=0"];
    let carrier = format!("link.carrier={carrier}");
    let sets: Vec<String> =
        sets.iter().chain(&none).copied().chain([carrier.as_str()]).map(str::to_owned).collect();
    RigFile::from_shipped("bilateral", &sets).unwrap()
}

/// The links from master to slave and back.
fn connect(file: &RigFile) -> [Box<dyn Link>; 2] {
    let mut buses = Buses::new(&file.buses, file.sample_period_s, file.seed, &file.folder).unwrap();
    [(0, true), (1, false)].map(|(number, is_forward)| {
        let link = &file.links[usize::from(!is_forward)];
        let route = Route {
            bus: link.bus.as_deref().unwrap(),
            from: &link.from,
            to: &link.to,
            is_forward,
            channel: 0,
            number,
            is_authenticated: false,
        };
        buses.link(route, InProcess::new(InProcessParameters::default(), number)).unwrap()
    })
}

/// A packet of Table 1 for 3 axes: 47 bytes.
fn packet(counter: u16) -> Vec<u8> {
    let mut bytes = [0; 64];
    bytes[HEADER_BYTES..HEADER_BYTES + 40].fill(counter.to_le_bytes()[0]);
    seal(Class::Packet, 0, counter, 40, &mut bytes).unwrap().to_vec()
}

/// Arrivals with their ticks.
type Arrivals = Vec<(u64, Vec<u8>)>;

/// Sends a packet a tick both ways, and gives what arrived at the slave, with its tick, and the links.
fn run(file: &RigFile, ticks: u16) -> (Arrivals, [Box<dyn Link>; 2]) {
    let [mut forward, mut backward] = connect(file);
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
        let (arrived, [forward, _]) = run(&rig(carrier, &["can.bits_per_s=4000000"]), 200);
        let expected: Vec<_> = (1..200).map(|counter| (u64::from(counter), packet(counter))).collect();
        assert_eq!(arrived, expected, "{carrier}");
        let traffic = forward.report(200).unwrap().traffic;
        assert_eq!((traffic.packets, traffic.dropped, traffic.errors), (200, 0, 0), "{traffic:?}");
        assert!(traffic.load > 0.0 && traffic.load < 1.0 && traffic.longest_s < 1e-3, "{traffic:?}");
    }
}

/// 50 bytes of 10 bits at 921 600 baud are 0.5425 ms a tick.
#[test]
fn the_load_of_a_uart_is_that_of_its_bytes() {
    let (_, [forward, backward]) = run(&rig("uart", &[]), 1000);
    for link in [forward, backward] {
        let load = link.report(1000).unwrap().traffic.load;
        assert!((load - 500.0 / 921.6).abs() < 1e-3, "{load}");
    }
}

#[test]
fn a_full_line_is_a_figure_and_a_fault() {
    for (carrier, set) in [
        ("uart", "uart.bits_per_s=115200"),
        ("can", "can.bits_per_s=500000"),
        ("can_fd", "can.other_nodes=20"),
        ("udp", "udp.forward_bits_per_s=100000"),
    ] {
        let more = "udp.queue_bytes=600";
        let (_, [forward, _]) = run(&rig(carrier, &[set, more]), 500);
        let report = forward.report(500).unwrap();
        assert!(report.traffic.load > 0.9, "{:?}", report.traffic);
        let is_told = report.faults.iter().any(|fault| fault.contains("queue full"));
        assert_eq!(is_told, report.traffic.dropped > 0, "{report:?}");
        assert!(is_told || carrier == "can_fd", "{report:?}");
    }
}

#[test]
fn what_other_nodes_lose_is_a_fault() {
    let faults = |file: &RigFile| {
        let [mut forward, _] = connect(file);
        for now in 0..500 {
            forward.send(now, &packet(1));
        }
        forward.report(500).unwrap().faults
    };
    let crowded = faults(&rig("can_fd", &["can.other_nodes=20"]));
    assert!(crowded.iter().any(|fault| fault.contains("packets of the other nodes")), "{crowded:?}");
    assert_eq!(faults(&rig("can_fd", &[])), [""; 0]);
}

#[test]
fn a_packet_that_no_frame_carries_is_a_fault() {
    let [mut forward, _] = connect(&rig("can_fd", &[]));
    forward.send(0, &[0; 64]);
    let report = forward.report(1).unwrap();
    assert_eq!(report.traffic.dropped, 1);
    assert!(report.faults[0].contains("too long for this carrier"), "{:?}", report.faults);
}

#[test]
fn errors_lose_packets_and_damage_none_unseen_and_the_seed_decides_them() {
    for (carrier, set) in [
        ("uart", "uart.bit_error_rate=1e-3"),
        ("uart", "uart.byte_drop=0.01"),
        ("uart", "uart.byte_insert=0.01"),
        ("can_fd", "can.bit_error_rate=1e-4"),
        ("udp", "udp.burst_entry_probability=0.1"),
    ] {
        let file = rig(carrier, &[set]);
        let (arrived, [forward, _]) = run(&file, 500);
        assert!(forward.report(500).unwrap().traffic.errors > 10, "{set}");
        assert_eq!(run(&file, 500).0, arrived, "{set}");
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
        let file = rig(carrier, &sets);
        let planned = round_trip_ticks(&file, ["master", "slave"]).unwrap();
        let (arrived, _) = run(&file, 300);
        let counter = |bytes: &[u8]| u64::from(u16::from_le_bytes([bytes[1], bytes[2]]));
        let longest = arrived.iter().map(|(now, bytes)| now + 1 - counter(bytes)).max().unwrap();
        assert!(2 * longest <= u64::from(planned), "{carrier}: {longest} twice, {planned} planned");
    }
}
