//! Eight clients at a hundred times the line's rate, in lockstep: cost of a tick, and received heartbeats and answers.
//!
//! The emulator's time counts instructions, and the host sees the tick of each sent byte: both are exact.

use std::collections::BTreeMap;

use dimsart_core::{Command, ModuleRef, TickResult, types};
use dimsart_link::protocol::{
    Heartbeat, MAX_FRAME_BYTES, NO_CLIENT, Receiver, Request, decode_heartbeat, decode_response,
    encode_request, request_client, request_id,
};
use dimsart_modules::ALL;
use hil_sim::experiment::Experiment;
use hil_sim::rig_file::RigFile;

use crate::common::image;

const CLIENTS: u8 = 8;
/// Bytes of 115 200 baud per tick of 1 ms, times 100.
const FLOOD_BYTES: usize = 1_152;
const TICKS: u64 = 3_000;
const HEARTBEAT_TICKS: u64 = 100;
/// Maximum instructions of a tick with a request in this scheme: a quarter of a tick at 170 MHz.
const COMMANDS_BUDGET: u32 = 42_500;

/// Output of a board during the flood.
struct Heard {
    /// Heartbeats and the ticks of their transmission.
    heartbeats: Vec<(u64, Heartbeat)>,
    /// Answers by client.
    answers: BTreeMap<u8, u32>,
    instructions: Vec<u32>,
}

/// Steps the master on a board with `bytes` on its command line in every tick.
fn run(bytes: &[u8]) -> Option<Heard> {
    let image = image()?;
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &[]).unwrap()).unwrap();
    experiment.emulate("master", &image, None).unwrap();
    let rig = experiment.rig_mut();
    let mut heard = Heard { heartbeats: Vec::new(), answers: BTreeMap::new(), instructions: Vec::new() };
    let mut receiver = Receiver::new();
    for tick in 0..TICKS {
        rig.stations_mut()[0].board_mut().unwrap().send_command_bytes(bytes);
        rig.step();
        assert!(rig.take_board_error().is_none());
        let board = rig.stations_mut()[0].board_mut().unwrap();
        heard.instructions.push(board.instructions().unwrap());
        for bytes in board.command_bytes() {
            receiver.push_all(bytes, |content| {
                if let Ok((_, heartbeat)) = decode_heartbeat(content) {
                    heard.heartbeats.push((tick, heartbeat));
                } else if let Ok((id, _)) = decode_response(content) {
                    *heard.answers.entry(request_client(id)).or_default() += 1;
                }
            });
        }
    }
    Some(heard)
}

fn mean(instructions: &[u32]) -> f64 {
    let sum: u64 = instructions.iter().copied().map(u64::from).sum();
    sum as f64 / instructions.len() as f64
}

fn frame(request: &Request, client: u8, number: u8) -> Vec<u8> {
    encode_request(request, request_id(client, number), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

/// A request repeated by each client in turn.
fn flood(request: &Request) -> Vec<u8> {
    let mut bytes = Vec::new();
    for number in 0.. {
        (1..=CLIENTS).for_each(|client| bytes.extend(frame(request, client, number)));
        if bytes.len() >= FLOOD_BYTES {
            break;
        }
    }
    bytes
}

/// Cheap requests, and the most expensive read-only request: a tick handles at most one, however many there are.
#[test]
fn eight_clients_at_a_hundred_times_the_line_s_rate_cost_a_tick_no_more_than_one_request_does() {
    let receiver = ALL.module("COMM_RXMOD").unwrap();
    let second = ModuleRef { number: 2, ..receiver };
    let requests = [
        ("signal", Request::Signal { signal: types::POSITION.first(), from: 0 }),
        ("status", Request::Status),
        ("finding", Request::Finding { index: 0 }),
        ("check", Request::Command(Command::Check)),
        ("refused plug-in", Request::Command(Command::PlugIn(second))),
    ];
    let mut damaged = 0;
    for (name, request) in requests {
        // One more than a tick handles: the lease is lost then, too, so that both drives are in the same state.
        let Some(one) = run(&[frame(&request, 1, 0), frame(&request, 1, 1)].concat()) else { return };
        let heard = run(&flood(&request)).unwrap();
        let (expected, found) = (mean(&one.instructions), mean(&heard.instructions));
        println!("{name}: {expected:.0} instructions per tick with a request each, {found:.0} in the flood");
        assert!(
            found <= 1.05 * expected,
            "{name}: {found} instructions per tick, {expected} with a request each"
        );
        let most = |heard: &Heard| heard.instructions.iter().copied().max().unwrap();
        assert!(f64::from(most(&heard)) <= 1.05 * f64::from(most(&one)), "{name}");
        assert!(most(&heard) <= COMMANDS_BUDGET, "{name}: {} instructions", most(&heard));
        hears_the_device(name, &heard);
        assert!(
            heard.answers.values().sum::<u32>() > 2_000,
            "{name}: one per tick or so: {:?}",
            heard.answers
        );
        assert!(heard.answers.keys().all(|client| (1..=CLIENTS).contains(client)), "{:?}", heard.answers);
        damaged += heard.heartbeats.last().unwrap().1.damaged;
        // A holder whose renewals are lost in the flood loses the lease, and the device stops.
        assert_eq!(heard.heartbeats.last().unwrap().1.lease.holder, NO_CLIENT, "{name}");
    }
    // Frames of some lengths are lost completely.
    assert!(damaged > 300, "truncated frames are counted: {damaged}");
}

/// As many requests as a tick handles: the drive continues under its lease.
#[test]
fn a_request_in_every_tick_stops_nobody() {
    let Some(heard) = run(&frame(&Request::Status, 1, 0)) else { return };
    hears_the_device("a request each", &heard);
    let (_, last) = heard.heartbeats.last().unwrap();
    assert_eq!((last.damaged, last.blocked), (0, None));
}

fn hears_the_device(name: &str, heard: &Heard) {
    let beats: Vec<u64> = heard.heartbeats.iter().map(|(tick, _)| *tick).collect();
    assert!(beats.len() as u64 >= TICKS / HEARTBEAT_TICKS - 1, "{name}: {beats:?}");
    for pair in beats.windows(2) {
        assert!((pair[1] - pair[0]).abs_diff(HEARTBEAT_TICKS) <= 1, "{name}: {beats:?}");
    }
}

#[test]
fn a_host_in_lockstep_holds_the_lease_by_the_command_line() {
    let Some(image) = image() else { return };
    let mut experiment = Experiment::new(&RigFile::from_shipped("bilateral", &[]).unwrap()).unwrap();
    experiment.emulate("slave", &image, None).unwrap();
    let rig = experiment.rig_mut();
    let mut receiver = Receiver::new();
    let mut leases = Vec::new();
    for _ in 0..1_000 {
        rig.step();
        let slave = &mut rig.stations_mut()[1];
        assert_eq!(slave.last_tick, TickResult::Ran);
        for bytes in slave.board_mut().unwrap().command_bytes() {
            receiver.push_all(bytes, |content| {
                leases.extend(decode_heartbeat(content).map(|(_, heartbeat)| heartbeat.lease));
            });
        }
    }
    assert!(leases.len() >= 9 && leases.iter().all(|lease| lease.holder == 1), "{leases:?}");
    assert!(leases.iter().all(|lease| lease.ticks_left >= 99), "{leases:?}");
}
