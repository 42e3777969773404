//! Requests that a board with a key accepts on its command line, and those that it refuses.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use dimsart_core::Command;
use dimsart_core::envelope::{Class, seal};
use dimsart_link::auth::{Key, KeyDomain, Opener, Profile, Sealer};
use dimsart_link::carrier::stream;
use dimsart_link::protocol::{
    AccessControl, AccessOutcome, KeyAction, KeyBytes, KeyRefusal, KeyState, LeaseAction, MAX_FRAME_BYTES,
    Receiver, Request, RequestSealer, SchemeAction, encode_request,
};
use proptest::prelude::*;

const KEY: &[u8; 16] = b"sixteen byte key";
const ID: u16 = 0x0703;

fn key() -> Key {
    Key::new(KEY)
}

/// Requests that move or change something.
fn guarded() -> Vec<Request> {
    vec![
        Request::Command(Command::Check),
        Request::Command(Command::Close),
        Request::Lease(LeaseAction::Take),
        Request::Lease(LeaseAction::Renew),
        Request::Lease(LeaseAction::Release),
        Request::Schemes(SchemeAction::Save),
        Request::Schemes(SchemeAction::Confirm),
        Request::Schemes(SchemeAction::RollBack),
        Request::Key(KeyAction::Set { key: KeyBytes(*KEY), salt: u64::MAX }),
        Request::Key(KeyAction::Clear),
        Request::Cycles { place: 0, clears: true },
    ]
}

/// Requests that only read, or stop the device.
fn harmless() -> Vec<Request> {
    vec![
        Request::Identify,
        Request::Status,
        Request::Command(Command::Stop),
        Request::Lease(LeaseAction::Read),
        Request::Schemes(SchemeAction::Read),
        Request::Key(KeyAction::Read),
        Request::Cycles { place: 0, clears: false },
    ]
}

/// A board at the end of a line.
struct Board {
    gate: AccessControl,
    receiver: Receiver,
}

impl Board {
    fn new(gate: AccessControl) -> Self {
        Self { gate, receiver: Receiver::new() }
    }

    fn locked(seed: u64) -> Self {
        Self::new(AccessControl::locked(&key(), seed))
    }

    /// Returns the result of a frame, and the handshake in reply.
    fn take(&mut self, frame: &[u8]) -> (AccessOutcome, Option<Vec<u8>>) {
        let (mut taken, gate) = (AccessOutcome::Nothing, &mut self.gate);
        self.receiver.push_all(frame, |content| taken = gate.check(content));
        let handshake = gate.handshake(&mut [0; MAX_FRAME_BYTES]).unwrap().map(<[u8]>::to_vec);
        assert!(!gate.handshake_is_pending());
        (taken, handshake)
    }

    fn take_plain(&mut self, request: &Request) -> AccessOutcome {
        self.take(encode_request(request, ID, &mut [0; MAX_FRAME_BYTES]).unwrap()).0
    }
}

/// A host with a key, and all its sent frames.
struct Host {
    sealer: RequestSealer,
    sent: Vec<Vec<u8>>,
}

impl Host {
    fn new(key: Key) -> Self {
        static SEEDS: AtomicU64 = AtomicU64::new(1000);
        Self { sealer: RequestSealer::new(&key, SEEDS.fetch_add(1, Relaxed)), sent: Vec::new() }
    }

    fn say(&mut self, frame: Vec<u8>, board: &mut Board) -> AccessOutcome {
        let (taken, answer) = board.take(&frame);
        self.sent.push(frame);
        Receiver::new().push_all(&answer.unwrap_or_default(), |content| {
            self.sealer.receive(content);
        });
        taken
    }

    fn ask(&mut self, request: &Request, board: &mut Board) -> AccessOutcome {
        for _ in 0..3 {
            // A hello, then the response to the challenge.
            let is_known = self.sealer.has_session();
            for _ in usize::from(is_known)..2 {
                let handshake = self.sealer.handshake(&mut [0; MAX_FRAME_BYTES]).unwrap().map(<[u8]>::to_vec);
                if let Some(handshake) = handshake {
                    self.say(handshake, board);
                }
            }
            let sealed =
                self.sealer.encode(request, ID, &mut [0; MAX_FRAME_BYTES]).unwrap().map(<[u8]>::to_vec);
            let Some(sealed) = sealed else { continue };
            match self.say(sealed, board) {
                AccessOutcome::Refused(_, KeyRefusal::NotAccepted) => self.sealer.forget(),
                taken => return taken,
            }
        }
        AccessOutcome::Refused(ID, KeyRefusal::NotAccepted)
    }
}

#[test]
fn a_board_without_a_key_takes_what_anybody_asks() {
    let mut board = Board::new(AccessControl::open());
    assert_eq!(board.gate.state(), KeyState::Open);
    for request in guarded().into_iter().chain(harmless()) {
        assert_eq!(board.take_plain(&request), AccessOutcome::Request(ID, request));
    }
    assert!(matches!(Host::new(key()).ask(&Request::Status, &mut board), AccessOutcome::Refused(..)));
}

#[test]
fn a_locked_board_takes_what_moves_it_from_who_has_the_key_alone() {
    let (mut board, mut host) = (Board::locked(1), Host::new(key()));
    assert_eq!(board.gate.state(), KeyState::Locked);
    for request in guarded() {
        assert_eq!(board.take_plain(&request), AccessOutcome::Refused(ID, KeyRefusal::Locked), "{request:?}");
        assert_eq!(host.ask(&request, &mut board), AccessOutcome::Request(ID, request));
        let mut stranger = Host::new(Key::new(b"another key of16"));
        let refused = AccessOutcome::Refused(ID, KeyRefusal::NotAccepted);
        assert_eq!(stranger.ask(&request, &mut board), refused, "{request:?}");
        assert_eq!(
            host.ask(&request, &mut board),
            AccessOutcome::Request(ID, request),
            "the stranger had no effect"
        );
    }
    for request in harmless() {
        assert_eq!(board.take_plain(&request), AccessOutcome::Request(ID, request));
        assert_eq!(host.ask(&request, &mut board), AccessOutcome::Request(ID, request));
    }
}

#[test]
fn a_board_that_cannot_read_its_key_takes_nothing_that_moves_it_from_anybody() {
    let mut board = Board::new(AccessControl::damaged());
    assert_eq!(board.gate.state(), KeyState::Damaged);
    for request in guarded() {
        assert_eq!(
            board.take_plain(&request),
            AccessOutcome::Refused(ID, KeyRefusal::Damaged),
            "{request:?}"
        );
    }
    for request in harmless() {
        assert_eq!(board.take_plain(&request), AccessOutcome::Request(ID, request));
    }
    // As sealed when the key was readable.
    let (mut before, mut host) = (Board::locked(1), Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    assert_eq!(host.ask(&take, &mut before), AccessOutcome::Request(ID, take));
    for frame in &host.sent {
        assert!(!matches!(board.take(frame).0, AccessOutcome::Request(..)));
    }
}

#[test]
fn a_start_of_the_board_is_found_out_and_what_was_sealed_before_it_is_worth_nothing() {
    let (mut board, mut host) = (Board::locked(1), Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    assert_eq!(host.ask(&take, &mut board), AccessOutcome::Request(ID, take));
    let recorded = host.sent.clone();
    let mut board = Board::locked(2);
    for frame in &recorded {
        assert!(!matches!(board.take(frame).0, AccessOutcome::Request(..)));
    }
    assert_eq!(host.ask(&take, &mut board), AccessOutcome::Request(ID, take));
    for frame in &recorded {
        assert!(!matches!(board.take(frame).0, AccessOutcome::Request(..)));
    }
}

#[test]
fn a_board_answers_no_handshake_to_who_has_said_none() {
    let mut board = Board::locked(1);
    let mut frame = [0; MAX_FRAME_BYTES];
    for request in guarded().into_iter().chain(harmless()) {
        let frame = encode_request(&request, ID, &mut frame).unwrap();
        assert_eq!(board.take(frame).1, None, "{request:?}");
    }
}

#[test]
fn hosts_that_all_have_the_key_can_take_turns() {
    let mut board = Board::locked(1);
    let mut hosts = [(); 3].map(|()| Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    for _ in 0..10 {
        for host in &mut hosts {
            assert_eq!(host.ask(&take, &mut board), AccessOutcome::Request(ID, take));
        }
    }
}

/// Whatever a forger sends on the command line, the key holder gets through at the first attempt, before and
/// after it is known.
#[test]
fn a_flood_of_false_handshakes_keeps_no_host_from_its_board() {
    let (mut board, mut host) = (Board::locked(1), Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    let mut stranger = Host::new(Key::new(b"another key of16"));
    for _ in 0..20 {
        for _ in 0..50 {
            stranger.sealer.forget();
            assert!(matches!(stranger.ask(&take, &mut board), AccessOutcome::Refused(..)));
            // Repetition of a genuine frame.
            for said in host.sent.clone() {
                assert!(!matches!(board.take(&said).0, AccessOutcome::Request(..)));
            }
        }
        let before = host.sent.len();
        assert_eq!(host.ask(&take, &mut board), AccessOutcome::Request(ID, take));
        assert!(host.sent.len() - before <= 3, "a hello, a proof and the request");
        host.sent.truncate(3);
    }
}

/// A host can distinguish a board with another key from one that does not answer, and a forged reply does not
/// block a board with the right key.
#[test]
fn a_challenge_of_another_key_is_told_and_does_not_count() {
    let (mut board, mut other) =
        (Board::locked(1), Board::new(AccessControl::locked(&Key::new(&[1; 16]), 1)));
    let mut host = Host::new(key());
    let hello = host.sealer.handshake(&mut [0; MAX_FRAME_BYTES]).unwrap().unwrap().to_vec();
    host.say(hello.clone(), &mut other);
    assert!(host.sealer.is_rejected() && !host.sealer.has_session());
    host.say(hello, &mut board);
    assert!(host.sealer.has_session());
    assert!(host.sealer.handshake(&mut [0; MAX_FRAME_BYTES]).unwrap().is_some());
    assert!(!host.sealer.is_rejected());
}

/// Packets and handshakes of a link are not requests, and vice versa, even on one channel.
#[test]
fn what_was_sealed_for_a_link_is_worth_nothing_on_the_command_line() {
    let gate = AccessControl::locked(&key(), 1);
    let (mut board, line) = (Board::new(gate), KeyDomain::Link(0));
    let mut sealer = Sealer::new(&key(), line, Profile::Full, 0, 2);
    let mut opener = Opener::new(&key(), line, Profile::Full, 0, 1);
    let mut frame = [0; MAX_FRAME_BYTES];
    let hello = sealer.handshake().unwrap().to_vec();
    // The board's challenge does not belong to a link.
    let (_, challenge) = board.take(stream::encode(&hello, &mut frame).unwrap());
    Receiver::new().push_all(&challenge.unwrap(), |content| {
        let whole = seal_content(content);
        assert!(!sealer.receive(&whole));
    });
    assert_eq!(opener.open(&hello, &mut [0; 256]), Ok(None));
    assert!(sealer.receive(opener.handshake().unwrap()));
    let proof = sealer.handshake().unwrap().to_vec();
    assert_eq!(board.take(stream::encode(&proof, &mut frame).unwrap()), (AccessOutcome::Nothing, None));
    let request = encode_request(&Request::Lease(LeaseAction::Take), ID, &mut frame).unwrap().to_vec();
    let mut plain = Vec::new();
    Receiver::new().push_all(&request, |content| plain = seal_content(content));
    let mut sealed = [0; 256];
    let sealed = sealer.seal(&plain, &mut sealed).unwrap();
    let taken = board.take(stream::encode(sealed, &mut frame).unwrap()).0;
    assert_eq!(taken, AccessOutcome::Refused(ID, KeyRefusal::NotAccepted));
    assert!(opener.open(&proof, &mut [0; 256]).is_ok());
    assert!(matches!(opener.open(sealed, &mut [0; 256]), Ok(Some(_))), "on its link it is right");
}

/// Appends the checksum that a receiver has removed.
fn seal_content(content: &[u8]) -> Vec<u8> {
    let mut buffer = [0; 256];
    let (header, payload) = content.split_first_chunk::<3>().unwrap();
    buffer.get_mut(3..content.len()).unwrap().copy_from_slice(payload);
    let class = if header[0] == Class::Handshake as u8 { Class::Handshake } else { Class::Request };
    seal(class, 0, u16::from_le_bytes([header[1], header[2]]), payload.len(), &mut buffer).unwrap().to_vec()
}

proptest! {
    /// An attacker has recorded everything sent to the board and replays it at will.
    #[test]
    fn a_sealed_request_is_taken_once(
        steps in prop::collection::vec((0_u8..4, any::<prop::sample::Index>(), any::<u8>()), 1..200),
    ) {
        let (mut board, mut host) = (Board::locked(1), Host::new(key()));
        let take = Request::Lease(LeaseAction::Take);
        for (action, place, change) in steps {
            if action == 0 || host.sent.is_empty() {
                prop_assert_eq!(host.ask(&take, &mut board), AccessOutcome::Request(ID, take));
            } else {
                let mut frame = place.get(&host.sent).clone();
                if action == 1 {
                    let index = place.index(frame.len());
                    *frame.get_mut(index).unwrap() ^= change;
                }
                prop_assert!(!matches!(board.take(&frame).0, AccessOutcome::Request(..)));
            }
        }
    }
}
