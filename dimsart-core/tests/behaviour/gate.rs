//! What a board that holds a key takes of its command line, and what it does not.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use dimsart_core::Command;
use dimsart_core::auth::{CHALLENGE_MS, Key};
use dimsart_core::protocol::{
    Gate, KeyAction, KeyBytes, KeyRefusal, KeyState, LeaseAction, MAX_FRAME_BYTES, Receiver, Request,
    RequestSealer, SchemeAction, Taken, encode_request,
};
use proptest::prelude::*;

const KEY: &[u8; 16] = b"sixteen byte key";
const ID: u16 = 0x0703;

fn key() -> Key {
    Key::new(KEY)
}

/// What moves or changes something.
fn guarded() -> Vec<Request> {
    vec![
        Request::Command(Command::Check),
        Request::Command(Command::Close),
        Request::Lease(LeaseAction::Take),
        Request::Lease(LeaseAction::Renew),
        Request::Lease(LeaseAction::GiveBack),
        Request::Schemes(SchemeAction::Save),
        Request::Schemes(SchemeAction::Confirm),
        Request::Schemes(SchemeAction::RollBack),
        Request::Key(KeyAction::Set { key: KeyBytes(*KEY), salt: u64::MAX }),
        Request::Key(KeyAction::Clear),
        Request::Cycles { place: 0, begins_anew: true },
    ]
}

/// What only looks, or brings the device to rest.
fn harmless() -> Vec<Request> {
    vec![
        Request::Identify,
        Request::Status,
        Request::Command(Command::Stop),
        Request::Lease(LeaseAction::Look),
        Request::Schemes(SchemeAction::Look),
        Request::Key(KeyAction::Look),
        Request::Cycles { place: 0, begins_anew: false },
    ]
}

/// A board at the end of a line.
struct Board {
    gate: Gate,
    receiver: Receiver,
    now_ms: u32,
}

impl Board {
    fn new(gate: Gate) -> Self {
        Self { gate, receiver: Receiver::new(), now_ms: 0 }
    }

    fn locked(seed: u64) -> Self {
        Self::new(Gate::locked(key(), seed))
    }

    /// What comes of a frame, and the challenge that goes back.
    fn take(&mut self, frame: &[u8]) -> (Taken, Option<Vec<u8>>) {
        self.now_ms += 1;
        let (mut taken, now_ms, gate) = (Taken::Nothing, self.now_ms, &mut self.gate);
        self.receiver.take_all(frame, |content| taken = gate.take(now_ms, content));
        let challenge = gate.challenge(now_ms, &mut [0; MAX_FRAME_BYTES]).unwrap().map(<[u8]>::to_vec);
        (taken, challenge)
    }

    fn take_plain(&mut self, request: &Request) -> Taken {
        self.take(encode_request(request, ID, &mut [0; MAX_FRAME_BYTES]).unwrap()).0
    }
}

/// A host with a key, and all that it ever sent.
struct Host {
    sealer: RequestSealer,
    sent: Vec<Vec<u8>>,
}

impl Host {
    fn new(key: Key) -> Self {
        Self { sealer: RequestSealer::new(key), sent: Vec::new() }
    }

    fn say(&mut self, frame: Vec<u8>, board: &mut Board) -> Taken {
        let (taken, challenge) = board.take(&frame);
        self.sent.push(frame);
        Receiver::new().take_all(&challenge.unwrap_or_default(), |content| {
            assert!(self.sealer.take(content));
        });
        taken
    }

    fn ask(&mut self, request: &Request, board: &mut Board) -> Taken {
        for _ in 0..3 {
            board.now_ms += CHALLENGE_MS;
            // A hello, and then the answer to the challenge that came back.
            let is_known = self.sealer.is_answered();
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
                Taken::Refused(_, KeyRefusal::NotAccepted) => self.sealer.forget(),
                taken => return taken,
            }
        }
        Taken::Refused(ID, KeyRefusal::NotAccepted)
    }
}

#[test]
fn a_board_without_a_key_takes_what_anybody_asks() {
    let mut board = Board::new(Gate::open());
    assert_eq!(board.gate.state(), KeyState::Open);
    for request in guarded().into_iter().chain(harmless()) {
        assert_eq!(board.take_plain(&request), Taken::Request(ID, request));
    }
    assert!(matches!(Host::new(key()).ask(&Request::Status, &mut board), Taken::Refused(..)));
}

#[test]
fn a_locked_board_takes_what_moves_it_from_who_has_the_key_alone() {
    let (mut board, mut host) = (Board::locked(1), Host::new(key()));
    assert_eq!(board.gate.state(), KeyState::Locked);
    for request in guarded() {
        assert_eq!(board.take_plain(&request), Taken::Refused(ID, KeyRefusal::Locked), "{request:?}");
        assert_eq!(host.ask(&request, &mut board), Taken::Request(ID, request));
        let mut stranger = Host::new(Key::new(b"another key of16"));
        let refused = Taken::Refused(ID, KeyRefusal::NotAccepted);
        assert_eq!(stranger.ask(&request, &mut board), refused, "{request:?}");
        assert_eq!(
            host.ask(&request, &mut board),
            Taken::Request(ID, request),
            "the stranger was no trouble"
        );
    }
    for request in harmless() {
        assert_eq!(board.take_plain(&request), Taken::Request(ID, request));
        assert_eq!(host.ask(&request, &mut board), Taken::Request(ID, request));
    }
}

#[test]
fn a_board_that_cannot_read_its_key_takes_nothing_that_moves_it_from_anybody() {
    let mut board = Board::new(Gate::damaged());
    assert_eq!(board.gate.state(), KeyState::Damaged);
    for request in guarded() {
        assert_eq!(board.take_plain(&request), Taken::Refused(ID, KeyRefusal::Damaged), "{request:?}");
    }
    for request in harmless() {
        assert_eq!(board.take_plain(&request), Taken::Request(ID, request));
    }
    // As it was sealed while the key could be read.
    let (mut before, mut host) = (Board::locked(1), Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    assert_eq!(host.ask(&take, &mut before), Taken::Request(ID, take));
    for frame in &host.sent {
        assert!(!matches!(board.take(frame).0, Taken::Request(..)));
    }
}

#[test]
fn a_start_of_the_board_is_found_out_and_what_was_sealed_before_it_is_worth_nothing() {
    let (mut board, mut host) = (Board::locked(1), Host::new(key()));
    let take = Request::Lease(LeaseAction::Take);
    assert_eq!(host.ask(&take, &mut board), Taken::Request(ID, take));
    let recorded = host.sent.clone();
    let mut board = Board::locked(2);
    for frame in &recorded {
        assert!(!matches!(board.take(frame).0, Taken::Request(..)));
    }
    assert_eq!(host.ask(&take, &mut board), Taken::Request(ID, take));
    for frame in &recorded {
        assert!(!matches!(board.take(frame).0, Taken::Request(..)));
    }
}

#[test]
fn a_board_challenges_nobody_who_has_not_asked() {
    let mut board = Board::locked(1);
    let mut frame = [0; MAX_FRAME_BYTES];
    for request in guarded().into_iter().chain(harmless()) {
        board.now_ms += CHALLENGE_MS;
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
            assert_eq!(host.ask(&take, &mut board), Taken::Request(ID, take));
        }
    }
}

proptest! {
    /// Somebody has all that was ever said to the board, and says it again whenever they like.
    #[test]
    fn a_sealed_request_is_taken_once(
        steps in prop::collection::vec((0_u8..4, any::<prop::sample::Index>(), any::<u8>()), 1..200),
    ) {
        let (mut board, mut host) = (Board::locked(1), Host::new(key()));
        let take = Request::Lease(LeaseAction::Take);
        for (action, place, change) in steps {
            if action == 0 || host.sent.is_empty() {
                prop_assert_eq!(host.ask(&take, &mut board), Taken::Request(ID, take));
            } else {
                let mut frame = place.get(&host.sent).clone();
                if action == 1 {
                    let index = place.index(frame.len());
                    *frame.get_mut(index).unwrap() ^= change;
                }
                board.now_ms += u32::from(change);
                prop_assert!(!matches!(board.take(&frame).0, Taken::Request(..)));
            }
        }
    }
}
