//! moteus commands and replies against the simulator's drive model; both implement the protocol independently.
#![expect(clippy::unwrap_used, reason = "test helpers")]

mod joint;

use core::f32::consts::TAU;

use drive::{MoteusAddress, MoteusFault, MoteusFrame, MoteusMode, MoteusReplyError, MoteusState};
use hil_sim::plant::MoteusDrive;
use proptest::prelude::*;

const MAX_TORQUE_NM: f64 = 8.0;
const TIMEOUT_S: f32 = 0.02;

fn address() -> MoteusAddress {
    MoteusAddress::new(0, 1).unwrap()
}

fn model() -> MoteusDrive {
    MoteusDrive::new(1, MAX_TORQUE_NM)
}

/// Sends a frame and reads the reply.
fn send(model: &mut MoteusDrive, frame: MoteusFrame) -> MoteusState {
    let (id, reply) = model.receive(address().command_id(), frame.bytes()).unwrap();
    assert_eq!((id, reply.len()), (address().reply_id(), 24));
    MoteusState::from_reply(&reply).unwrap()
}

fn is_near(one: f32, other: f32) -> bool {
    (one - other).abs() <= 1e-6 * other.abs().max(1.0)
}

#[test]
fn ids_and_frames_are_those_of_the_documents() {
    assert_eq!((address().command_id(), address().reply_id()), (0x8001, 0x100));
    for (host, drive) in [(127, 1), (0, 127), (200, 1), (0, 128), (3, 3)] {
        assert_eq!(MoteusAddress::new(host, drive), None, "{host} {drive}");
    }
    assert_eq!(MoteusFrame::query().bytes(), [0x11, 0, 0x1f, 1, 0x13, 0x0d]);
    assert_eq!(MoteusFrame::stop().bytes(), [1, 0, 0, 0x11, 0, 0x1f, 1, 0x13, 0x0d, 0x50, 0x50, 0x50]);
    #[rustfmt::skip]
    assert_eq!(MoteusFrame::torque(-1.5, 0.25).bytes(), [
        0x01, 0x00, 0x0a, 0x02, 0x20, 0x80, 0x00, 0x0d, 0x22, 0, 0, 0xc0, 0xbf, 0x02, 0x23, 0, 0,
        0x0d, 0x27, 0, 0, 0x80, 0x3e, 0x01, 0x2b, 0, 0x11, 0x00, 0x1f, 0x01, 0x13, 0x0d,
    ]);
}

#[test]
fn the_documents_replies_are_read() {
    // The example of docs/protocol/can.md, and the one of the C++ library's test.
    let example = b"\x24\x04\x00\x0a\x00\x50\x00\x00\x01\x70\xff\x23\x0d\x18\x14\x00";
    let state = MoteusState::from_reply(example).unwrap();
    assert_eq!((state.mode, state.fault), (MoteusMode::Position, None));
    assert!(is_near(state.position_rad, 2.88_f32.to_radians()));
    assert!(is_near(state.velocity_rad_per_s, 23.04_f32.to_radians()));
    assert!(is_near(state.torque_nm, -1.44), "{state:?}");
    assert!(is_near(state.voltage_v, 12.0) && is_near(state.temperature_c, 20.0), "{state:?}");
    let example = b"\x24\x04\x00\x0a\x00\x10\x02\x00\xfe\x20\x00\x23\x0d\x20\x30\x40";
    let state = MoteusState::from_reply(example).unwrap();
    assert!(is_near(state.position_rad, 0.0528 * TAU) && is_near(state.velocity_rad_per_s, -0.128 * TAU));
    assert_eq!(state.fault.map(MoteusFault::number), Some(64));
}

#[test]
fn the_model_answers_the_documents_command_as_the_document_has_it() {
    let mut model = model();
    model.set_state(2.88_f64.to_radians(), 23.04_f64.to_radians());
    let command = b"\x01\x00\x0a\x07\x20\x60\x00\x20\x01\x50\xff\x14\x04\x00\x13\x0d";
    assert!(model.receive(0x0001, command).is_none(), "no reply was requested");
    assert!(model.receive(0x8002, command).is_none(), "addressed to another drive");
    let (id, reply) = model.receive(0x8001, command).unwrap();
    assert_eq!((id, reply.len()), (0x100, 16));
    assert_eq!(reply[..9], *b"\x24\x04\x00\x0a\x00\x50\x00\x00\x01");
    assert_eq!(reply[11..13], *b"\x23\x0d");
    // -1.76 N m plus the contribution of its position controller.
    assert!((model.torque_nm() + 1.76 - 4.0 * 0.0016 - 0.05 * 0.008).abs() < 1e-6, "{}", model.torque_nm());
}

#[test]
fn a_torque_comes_to_the_joint_and_its_motion_comes_back() {
    for turn in [0.0, 0.3, -0.3, 17.25, -1200.0] {
        for torque_nm in [0.0, 1e-3, -1e-3, 0.7, -2.5, 8.0, -8.0] {
            let mut model = model();
            model.set_state(turn, -3.0 * turn);
            assert_eq!(send(&mut model, MoteusFrame::torque(torque_nm, TIMEOUT_S)).mode, MoteusMode::Stopped);
            // Far from the previous position: no restoring torque.
            model.set_state(turn + 5.0, -3.0 * turn);
            assert!((model.torque_nm() - f64::from(torque_nm)).abs() < 1e-9);
            let state = send(&mut model, MoteusFrame::query());
            assert_eq!((state.mode, state.fault), (MoteusMode::Position, None));
            assert!(is_near(f64_to_f32(turn + 5.0), state.position_rad), "{state:?}");
            assert!(is_near(f64_to_f32(-3.0 * turn), state.velocity_rad_per_s), "{state:?}");
            assert!(is_near(torque_nm, state.torque_nm), "{state:?}");
        }
    }
    for torque_nm in [9.0, f32::MAX, -f32::MAX] {
        let mut model = model();
        send(&mut model, MoteusFrame::torque(torque_nm, TIMEOUT_S));
        assert!((model.torque_nm().abs() - MAX_TORQUE_NM).abs() < 1e-9);
        let limit = send(&mut model, MoteusFrame::query()).fault.unwrap();
        assert!(limit.is_limit() && limit.remedy().contains("max_current_A"), "{limit}");
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the nearest float is wanted")]
fn f64_to_f32(number: f64) -> f32 {
    number as f32
}

#[test]
fn what_is_no_torque_for_a_time_is_a_stop() {
    for bad in [f32::NAN, f32::INFINITY, -f32::INFINITY] {
        assert_eq!(MoteusFrame::torque(bad, TIMEOUT_S), MoteusFrame::stop());
        assert_eq!(MoteusFrame::torque(1.0, bad), MoteusFrame::stop());
    }
    for timeout_s in [0.0, -0.0, -1.0] {
        assert_eq!(MoteusFrame::torque(1.0, timeout_s), MoteusFrame::stop());
    }
    let mut model = model();
    send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    send(&mut model, MoteusFrame::torque(f32::NAN, TIMEOUT_S));
    assert_eq!(send(&mut model, MoteusFrame::query()).mode, MoteusMode::Stopped);
    assert!(model.torque_nm().abs() < 1e-9);
}

#[test]
fn without_commands_the_torque_is_gone_in_time_and_stays_away_until_a_stop() {
    let mut model = model();
    // No timeout while commands arrive.
    for _ in 0..100 {
        send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
        model.advance(0.019);
        assert!((model.torque_nm() - 1.0).abs() < 1e-9);
    }
    send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    for _ in 0..21 {
        model.advance(0.001);
        // A query is not a command.
        send(&mut model, MoteusFrame::query());
    }
    assert!(model.torque_nm().abs() < 1e-9);
    send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    assert_eq!(send(&mut model, MoteusFrame::stop()).mode, MoteusMode::Timeout);
    send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    assert!((model.torque_nm() - 1.0).abs() < 1e-9);
}

#[test]
fn a_fault_is_shown_and_takes_the_torque_until_a_stop() {
    let mut model = model();
    send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    model.raise_fault(40);
    let state = send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    assert_eq!(state.mode, MoteusMode::Fault);
    let fault = state.fault.unwrap();
    assert!(!fault.is_limit() && fault.remedy().contains("supply"));
    assert_eq!(fault.to_string(), "undervoltage (40)");
    assert!(model.torque_nm().abs() < 1e-9);
    send(&mut model, MoteusFrame::stop());
    let state = send(&mut model, MoteusFrame::torque(1.0, TIMEOUT_S));
    assert_eq!((state.mode, state.fault), (MoteusMode::Stopped, None));
    assert!((model.torque_nm() - 1.0).abs() < 1e-9);
}

#[test]
fn integers_of_every_size_are_read_and_the_least_is_no_number() {
    let tail = b"\x50\x2d\x0d\x00\x00\xc0\x41\x29\x0e\x40\x9c\x00\x00\x21\x0f\x00\x50\x50";
    let at = |head: &[u8]| MoteusState::from_reply(&[head, tail].concat()).unwrap();
    let state = at(b"\x20\x04\x00\x0a\xf6\x05\xff");
    assert!(is_near(state.position_rad, -0.1 * TAU) && is_near(state.velocity_rad_per_s, 0.5 * TAU));
    assert!(
        is_near(state.torque_nm, -0.5)
            && is_near(state.voltage_v, 24.0)
            && is_near(state.temperature_c, 40.0)
    );
    let state = at(b"\x2b\x00\x0b\x00\x00\x00\xff\xff\xff\xff\x64\x00\x00\x00\x29\x03\x18\xfc\xff\xff");
    assert_eq!(state.mode, MoteusMode::Timeout);
    assert!(is_near(state.position_rad, -1e-5 * TAU) && is_near(state.velocity_rad_per_s, 1e-3 * TAU));
    assert!(is_near(state.torque_nm, -1.0), "{state:?}");
    let state = at(b"\x21\x00\x00\x21\x01\x80\x25\x02\x00\x80\x29\x03\x00\x00\x00\x80");
    assert!(state.position_rad.is_nan() && state.velocity_rad_per_s.is_nan() && state.torque_nm.is_nan());
}

#[test]
fn a_reply_that_is_cut_or_wrong_says_what_is_wrong() {
    let reply = model().receive(0x8001, MoteusFrame::query().bytes()).unwrap().1;
    assert_eq!((reply.len(), &reply[22..]), (24, &[0x50, 0x50][..]));
    assert!(MoteusState::from_reply(&reply[..22]).is_ok());
    for length in 0..22 {
        let expected = match length {
            0 => MoteusReplyError::Missing { register: 0 },
            3 => MoteusReplyError::Missing { register: 1 },
            17 => MoteusReplyError::Missing { register: 0x0d },
            _ => MoteusReplyError::Truncated,
        };
        assert_eq!(MoteusState::from_reply(&reply[..length]), Err(expected), "{length}");
    }
    let cases: [(&[u8], _); 8] = [
        (b"\x30\x22\x01", MoteusReplyError::Refused { register: 0x22, error: 1 }),
        (b"\x50\x31\xa0\x02\x81\x01", MoteusReplyError::Refused { register: 0x120, error: 129 }),
        (b"\x00", MoteusReplyError::UnknownSubframe { kind: 0 }),
        (b"\x41\x01", MoteusReplyError::UnknownSubframe { kind: 0x41 }),
        (b"\x21\x80\x80\x80\x80\x10\x00", MoteusReplyError::NumberTooLong),
        (b"\x22\xff\xff\xff\xff\x0f\x00\x00", MoteusReplyError::NumberTooLong),
        (b"\x2c\xff\xff\xff\xff\x0f\x01", MoteusReplyError::Truncated),
        (
            b"\x21\x00\xff\x2f\x01\0\0\0\0\0\0\0\0\0\0\0\0\x23\x0d\0\0\0",
            MoteusReplyError::NotAnInteger { register: 0 },
        ),
    ];
    for (reply, expected) in cases {
        assert_eq!(MoteusState::from_reply(reply), Err(expected), "{reply:02x?}");
    }
}

#[test]
fn the_model_refuses_what_no_drive_takes() {
    let mut model = model();
    let mut ask = |bytes: &[u8]| MoteusState::from_reply(&model.receive(0x8001, bytes).unwrap().1);
    assert_eq!(ask(b"\x01\x00\x63"), Err(MoteusReplyError::Refused { register: 0, error: 3 }));
    assert_eq!(ask(b"\x01\x03\x01"), Err(MoteusReplyError::Refused { register: 3, error: 2 }));
    assert_eq!(ask(b"\x01\xff\x07\x01"), Err(MoteusReplyError::Refused { register: 0x3ff, error: 1 }));
    assert_eq!(ask(b"\x12\x03"), Err(MoteusReplyError::Refused { register: 4, error: 1 }));
}

proptest! {
    #[test]
    fn no_bytes_bring_the_reader_or_the_model_down(
        bytes in prop::collection::vec(prop_oneof![any::<u8>(), 0x20..0x32_u8, 0..0x20_u8], 0..80), id in any::<u32>(),
    ) {
        let _ = MoteusState::from_reply(&bytes);
        let mut model = model();
        let _ = model.receive(id, &bytes);
        if let Some((_, reply)) = model.receive(0x8001, &bytes) {
            let _ = MoteusState::from_reply(&reply);
        }
        model.advance(1.0);
    }

    #[test]
    fn no_torque_in_a_frame_is_other_than_finite(torque_nm in any::<f32>(), timeout_s in any::<f32>()) {
        let mut model = model();
        send(&mut model, MoteusFrame::torque(torque_nm, timeout_s));
        prop_assert!(model.torque_nm().abs() <= MAX_TORQUE_NM);
        model.advance(1.01 * f64::from(timeout_s.abs()) + 1e-30);
        prop_assert!(model.torque_nm().abs() <= 0.0);
    }
}
