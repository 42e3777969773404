//! Line errors: noise, damage, cuts, and clients that write at the same time.

use dimsart_core::{Command, Value};
use dimsart_link::protocol::{
    Counters, Receiver, Request, Response, decode_request, request_client, request_id,
};
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

use super::served::{ServedDevice, frame, module};

#[test]
fn a_valid_request_is_answered_after_ten_million_bytes_of_noise() {
    let mut served = ServedDevice::new();
    let before = served.state();
    let mut noise = vec![0; 1 << 20];
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    for _ in 0..10 {
        random.fill_bytes(&mut noise);
        assert_eq!(served.send(&noise), []);
    }
    assert_eq!(served.send(&vec![0xAA; 100_000]), []);
    assert_eq!(served.state(), before);
    unwrap!(Identity, served.ask(Request::Identify));
    let Counters { frames, damaged, too_long } = served.device.counters();
    assert_eq!(frames, 1);
    assert!(damaged > 10_000 && too_long > 1_000, "{damaged} {too_long}");
}

#[test]
fn every_single_bit_error_costs_one_frame_and_changes_nothing() {
    let mut served = ServedDevice::new();
    let before = served.state();
    let good = frame(Request::Identify, 7);
    let pd = module("PDCTRL_MOD");
    for request in [
        Request::Command(Command::PlugIn(pd)),
        Request::Command(Command::set(pd, 0, Value::Real(3000.0))),
        Request::Status,
    ] {
        let whole = frame(request, 0x0100);
        for bit in 0..whole.len() * 8 {
            let mut damaged = whole.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(served.send(&damaged), [], "bit {bit} of {request:?}");
            assert_eq!(served.send(&good).len(), 1, "after bit {bit} of {request:?}");
        }
    }
    assert_eq!(served.state(), before);
}

#[test]
fn a_truncated_frame_costs_nothing_but_itself() {
    let mut served = ServedDevice::new();
    let before = served.state();
    let whole = frame(Request::Command(Command::PlugIn(module("PDCTRL_MOD"))), 1);
    // The last byte is the zero that ends the frame; the first zero of the next frame does that, too.
    for length in 0..whole.len() - 1 {
        assert_eq!(served.send(&whole[..length]), [], "cut to {length}");
        assert_eq!(served.send(&frame(Request::Status, 2)).len(), 1, "after a cut to {length}");
    }
    assert_eq!(served.state(), before);
}

#[test]
fn frames_one_behind_the_other_are_answered_in_order_however_they_arrive() {
    let mut served = ServedDevice::new();
    let bytes: Vec<u8> = (0..300).flat_map(|id| frame(Request::Identify, id)).collect();
    for size in [1, 2, 3, 7, 100, bytes.len()] {
        let ids = bytes.chunks(size).flat_map(|chunk| served.send(chunk)).map(|(id, _)| id);
        assert!(ids.eq(0..300), "in pieces of {size}");
    }
    let counters = Counters { frames: 1800, damaged: 0, too_long: 0 };
    assert_eq!(served.device.counters(), counters);
}

#[test]
fn eight_clients_on_one_line_get_their_own_answers() {
    const CLIENTS: u8 = 8;
    let mut served = ServedDevice::new();
    let requests =
        (1..=CLIENTS).flat_map(|client| (0..=u8::MAX).map(move |number| request_id(client, number)));
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    let mut ids: Vec<u16> = requests.collect();
    for place in (1..ids.len()).rev() {
        ids.swap(place, usize::try_from(random.next_u64()).unwrap() % (place + 1));
    }
    let bytes: Vec<u8> = ids.iter().flat_map(|id| frame(Request::Identify, *id)).collect();
    let mut rest = bytes.as_slice();
    let mut answered = Vec::new();
    while !rest.is_empty() {
        let size = usize::try_from(random.next_u32() % 20).unwrap().clamp(1, rest.len());
        answered.extend(served.send(&rest[..size]).into_iter().map(|(id, _)| id));
        rest = &rest[size..];
    }
    assert_eq!(answered, ids);
}

/// Clients that write into each other's frames destroy frames, but cause no other error: a received frame is
/// one that was sent.
#[test]
fn eight_clients_that_cut_into_each_other_s_frames_lose_some_and_forge_none() {
    const CLIENTS: u8 = 8;
    const FRAMES: u8 = 200;
    let request = |client| Request::Get { module: module("PDCTRL_MOD"), parameter: client, entry: client };
    let mut waiting: Vec<Vec<u8>> = (1..=CLIENTS)
        .map(|client| {
            (0..FRAMES).flat_map(|number| frame(request(client), request_id(client, number))).collect()
        })
        .collect();
    let mut random = TestRng::deterministic_rng(RngAlgorithm::XorShift);
    let (mut receiver, mut taken) = (Receiver::new(), 0_u32);
    while waiting.iter().any(|bytes| !bytes.is_empty()) {
        let client = usize::try_from(random.next_u32()).unwrap() % waiting.len();
        let bytes = &mut waiting[client];
        let size = usize::try_from(random.next_u32() % 60).unwrap().min(bytes.len());
        let piece: Vec<u8> = bytes.drain(..size).collect();
        receiver.push_all(&piece, |content| {
            let (id, found) = decode_request(content).unwrap();
            assert_eq!(found, request(request_client(id)));
            taken += 1;
        });
    }
    let Counters { frames, damaged, .. } = receiver.counters();
    assert_eq!(frames, taken);
    assert!(frames > 400 && damaged > 100, "{frames} whole, {damaged} damaged");
    receiver.push_all(&frame(request(1), 7), |_| taken += 1);
    assert_eq!(taken, frames + 1, "the next whole frame is found");
}
