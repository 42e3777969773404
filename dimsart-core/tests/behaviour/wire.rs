//! The examples in docs/wire.md match the code, byte by byte.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use dimsart_core::Packet;
use dimsart_link::auth;
use dimsart_link::carrier::{can, can_fd, stream};
use dimsart_link::protocol::{
    AccessControl, Heartbeat, LeaseAction, LeaseStatus, MAX_FRAME_BYTES, PROTOCOL_VERSION, Receiver, Request,
    RequestSealer, Sample, encode_heartbeat, encode_request, encode_sample, request_id,
};

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

fn packet() -> Packet {
    let words = [1.0_f32, -0.5].iter().map(|value| value.to_bits()).collect();
    Packet { channel: 0x123, counter: 0x0201, echo: 0x0403, content: 0xBEEF, words }
}

/// All examples of the page: name and bytes.
fn examples() -> Vec<(&'static str, Vec<u8>)> {
    let mut out = [0; 300];
    let content = packet().to_bytes().to_vec();
    let mut examples = vec![
        ("packet", content.clone()),
        ("packet, stream", stream::encode(&content, &mut out).unwrap().to_vec()),
        ("packet, CAN FD", can_fd::pack(&content).unwrap().to_vec()),
    ];
    let names = ["packet, CAN frame 0", "packet, CAN frame 1", "packet, CAN frame 2"];
    examples.extend(names.into_iter().zip(can::frames(&content, 0x123).unwrap().map(|frame| frame.to_vec())));
    let request = Request::Lease(LeaseAction::Take);
    examples
        .push(("request, stream", encode_request(&request, request_id(7, 1), &mut out).unwrap().to_vec()));
    let lease = LeaseStatus { holder: 7, ticks_left: 200 };
    let heartbeat =
        Heartbeat { ticks: 1000, blocked: None, first_fault: None, lease, dropped: 0, damaged: 2, events: 5 };
    examples.push(("heartbeat, stream", encode_heartbeat(&heartbeat, 10, &mut out).unwrap().to_vec()));
    let sample = Sample {
        counter: 3,
        id: request_id(7, 2),
        tick: 1001,
        words: packet().words.iter().copied().collect(),
    };
    examples.push(("telemetry, stream", encode_sample(&sample, &mut out).unwrap().to_vec()));

    let (key, line, full) =
        (auth::Key::new(b"sixteen byte key"), auth::KeyDomain::Link(0), auth::Profile::Full);
    let mut opener = auth::Opener::new(&key, line, full, 0x123, 1);
    let mut sealer = auth::Sealer::new(&key, line, full, 0x123, 2);
    let mut open = |content: &[u8]| {
        assert_eq!(opener.open(content, &mut [0; 256]), Ok(None));
        opener.handshake().unwrap().to_vec()
    };
    let hello = sealer.handshake().unwrap().to_vec();
    let challenge = open(&hello);
    assert!(sealer.receive(&challenge));
    let proof = sealer.handshake().unwrap().to_vec();
    let taken = open(&proof);
    assert!(sealer.receive(&taken));
    examples.extend([("hello", hello), ("challenge", challenge), ("proof", proof), ("taken", taken)]);
    examples.push(("packet, authenticated", sealer.seal(&content, &mut out).unwrap().to_vec()));
    examples.extend(authenticated_can_frames(&key, &content));
    examples.push(("request, sealed", sealed_request(&request, &key)));
    examples
}

/// Examples with a tag.
fn authenticated_can_frames(key: &auth::Key, content: &[u8]) -> [(&'static str, Vec<u8>); 3] {
    let (line, short) = (auth::KeyDomain::Link(0), auth::Profile::Short);
    let mut opener = auth::Opener::new(key, line, short, 0x123, 1);
    let mut sealer = auth::Sealer::new(key, line, short, 0x123, 2);
    opener.open(sealer.handshake().unwrap(), &mut [0; 256]).unwrap();
    assert!(sealer.receive(opener.handshake().unwrap()));
    let mut sealed = [0; 256];
    let sealed = sealer.seal(content, &mut sealed).unwrap();
    let frames: Vec<_> = can::frames(sealed, 0x123).unwrap().map(|frame| frame.to_vec()).collect();
    let [_, _, second, third, fourth] = <[Vec<u8>; 5]>::try_from(frames).unwrap();
    [("tag, CAN frame 2", second), ("tag, CAN frame 3", third), ("tag, CAN frame 4", fourth)]
}

/// For a board that has just answered.
fn sealed_request(request: &Request, key: &auth::Key) -> Vec<u8> {
    let (mut gate, mut sealer) = (AccessControl::locked(key, 1), RequestSealer::new(key, 2));
    let mut frame = [0; MAX_FRAME_BYTES];
    let hello = sealer.handshake(&mut frame).unwrap().unwrap();
    Receiver::new().push_all(hello, |content| {
        gate.check(content);
    });
    let challenge = gate.handshake(&mut frame).unwrap().unwrap();
    Receiver::new().push_all(challenge, |content| assert!(sealer.receive(content)));
    sealer.encode(request, request_id(7, 1), &mut frame).unwrap().unwrap().to_vec()
}

#[test]
fn the_page_shows_the_bytes_that_travel() {
    let page = include_str!("../../../docs/wire.md");
    let lines = examples().into_iter().map(|(name, bytes)| format!("{name:22} {}", hex(&bytes)));
    let missing: Vec<String> = lines.filter(|line| !page.lines().any(|found| found == line)).collect();
    assert!(missing.is_empty(), "docs/wire.md lacks the lines\n{}", missing.join("\n"));
    let version = format!("Version of requests and responses: {PROTOCOL_VERSION} (");
    assert!(page.contains(&version), "docs/wire.md lacks: {version}");
}
