//! The bytes of every transmitted variant. A change breaks devices in the field: add new variants at the end
//! of their enum and increase `PROTOCOL_VERSION`.

mod refusals;
mod requests;
mod responses;

use core::fmt::Debug;
use std::format;
use std::string::String;
use std::vec::Vec;

use serde::{Deserialize, Serialize};

use super::LawAction;
use super::frame::{decode, encode};
use super::*;
use crate::saved_scheme::LoadError;
use crate::*;
use dimsart_core::envelope::Class;
use dimsart_core::limits::MAX_DOF;
use dimsart_core::online::{LawRefusal, LawReport, ProgramError};
use dimsart_core::*;

const MODULE: ModuleRef = ModuleRef::new("WAVEIMP_MOD", 2);
const SIGNAL: TypeRef = TypeRef { id: 300, number: 1 };
const MODULE_FAULT: ModuleFault = ModuleFault {
    module: MODULE,
    cause: FaultCause::InvalidOutput { signal: SIGNAL, word: 2, bits: 0x7F80_0000 },
};
const FINDING: Finding = Finding::NoWriter { signal: SIGNAL, reader: Endpoint::Frame };

/// Encodes a value in a frame, checks that it decodes to the same value, and returns the payload.
fn round_trip<T: Serialize + Deserialize<'static> + PartialEq + Debug>(value: &T) -> String {
    let mut frame = [0; MAX_FRAME_BYTES];
    let length = encode(Class::Response, 7, value, &mut frame).ok().unwrap();
    let mut receiver = Receiver::new();
    let mut contents = Vec::new();
    receiver.push_all(&frame[..length], |content| contents.push(content.to_vec()));
    // Leaked, because texts in the value borrow from it.
    let content = contents.pop().unwrap().leak();
    let (id, decoded) = decode::<T>(Class::Response, content).unwrap();
    assert_eq!((id, &decoded), (7, value));
    let payload: Vec<_> = content[3..].iter().map(|byte| format!("{byte:02x}")).collect();
    payload.join(" ")
}

#[track_caller]
fn assert_bytes<T: Serialize + Deserialize<'static> + PartialEq + Debug>(values: &[T], expected: &[&str]) {
    assert_eq!(values.iter().map(round_trip).collect::<Vec<_>>(), expected);
}

#[cfg(feature = "auth")]
#[test]
fn keys() {
    let bytes = core::array::from_fn(|index| u8::try_from(index).unwrap());
    let requests = [
        Request::Key(KeyAction::Read),
        Request::Key(KeyAction::Set { key: KeyBytes(bytes), salt: 300 }),
        Request::Key(KeyAction::Clear),
    ];
    let expected = ["11 00", "11 01 00 01 02 03 04 05 06 07 08 09 0a 0b 0c 0d 0e 0f ac 02", "11 02"];
    assert_bytes(&requests, &expected);
    let states = [KeyState::Open, KeyState::Locked, KeyState::Damaged].map(Response::Key);
    assert_bytes(&states, &["12 00", "12 01", "12 02"]);
    let refusals = [KeyRefusal::Locked, KeyRefusal::Damaged, KeyRefusal::NotAccepted, KeyRefusal::InUse]
        .map(Refusal::Key);
    assert_bytes(&refusals, &["07 00", "07 01", "07 02", "07 03"]);
}

/// Requests about keys are unknown; the numbers of later variants are unchanged.
#[cfg(not(feature = "auth"))]
#[test]
fn keys() {
    for payload in [(17_u8, 0_u8), (17, 2)] {
        let mut frame = [0; MAX_FRAME_BYTES];
        let length = encode(Class::Request, 7, &payload, &mut frame).ok().unwrap();
        let mut decoded = Vec::new();
        Receiver::new().push_all(&frame[..length], |content| decoded.push(decode_request(content)));
        assert_eq!(decoded, [Err(DecodeError::Unsupported { id: 7 })]);
    }
}

/// The content without its CRC.
fn content(frame: &[u8]) -> Vec<u8> {
    let (mut receiver, mut contents) = (Receiver::new(), Vec::new());
    receiver.push_all(frame, |content| contents.push(content.to_vec()));
    contents.pop().unwrap()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn heartbeats() {
    let lease = LeaseStatus { holder: 3, ticks_left: 199 };
    let first_fault = Some(FirstFault { tick: 300, reason: NotCommandedReason::Tick(TickResult::Idle) });
    let heartbeat = |blocked, first_fault| Heartbeat {
        ticks: 300,
        blocked,
        first_fault,
        lease,
        dropped: 1,
        damaged: 2,
        events: 300,
    };
    for (heartbeat, expected) in [
        (heartbeat(None, None), "05 07 00 ac 02 00 00 03 c7 01 01 02 ac 02"),
        (
            heartbeat(Some(NotCommandedReason::Tick(TickResult::Disarmed)), first_fault),
            "05 07 00 ac 02 01 01 04 01 ac 02 01 01 03 c7 01 01 02 ac 02",
        ),
    ] {
        let content = content(encode_heartbeat(&heartbeat, 7, &mut [0; MAX_FRAME_BYTES]).unwrap());
        assert_eq!(hex(&content), expected);
        assert_eq!(decode_heartbeat(&content), Ok((7, heartbeat)));
        assert_eq!(decode_response(&content), Err(DecodeError::UnexpectedClass));
    }
}

#[test]
fn samples() {
    let words = heapless::Vec::from_slice(&[0x3F80_0000, 1]).unwrap();
    let sample = Sample { counter: 258, id: request_id(3, 4), tick: 300, words };
    let content = content(encode_sample(&sample, &mut [0; MAX_FRAME_BYTES]).unwrap());
    assert_eq!(hex(&content), "04 02 01 04 03 2c 01 00 00 00 00 80 3f 01 00 00 00");
    assert_eq!(decode_sample(&content), Ok(sample));
    assert_eq!(decode_sample(&content[..11]), Err(DecodeError::Unsupported { id: 258 }));
    assert_eq!(decode_heartbeat(&content), Err(DecodeError::UnexpectedClass));
}

#[test]
fn units() {
    // The first and the last unit: detects additions and removals in between.
    assert_eq!(
        (Unit::ALL.first(), Unit::ALL.get(15), Unit::ALL.get(24)),
        (Some(&Unit::Any), Some(&Unit::Celsius), Some(&Unit::Radian))
    );
    for (number, unit) in (0..).zip(Unit::ALL) {
        assert_eq!(postcard::to_slice(unit, &mut [0; 4]).unwrap(), [number]);
    }
}
