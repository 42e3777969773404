//! Message authentication and replay protection with a shared key.
//!
//! A layer between [`envelope`](dimsart_core::envelope) and [`carrier`](crate::carrier): a content goes in, a
//! content comes out. Requires feature `auth`. [`Sealer`] is the sending end, [`Opener`] the receiving end.
//!
//! ```text
//! content   class + 0x80 u8 | counter u16 | payload | freshness | tag | CRC-32
//! full      freshness u32, tag 8 bytes     UART, CAN FD, UDP: 12 bytes of overhead
//! short     freshness u8, tag 7 bytes      classic CAN: 8 bytes of overhead, 4 of them in unused bytes of its frames
//! tag       the first bytes of AES-128-CMAC over: line 2 bytes | channel u16 | freshness u64 | class .. payload
//! line      1, number of the link; or 2, 0: the command line
//! ```
//!
//! # Keys
//!
//! The configured key is never used directly. All other keys are derived from it (NIST SP 800-108, counter
//! mode, one block of CMAC: `1 | label | 0 | context | 128 u16, high byte first`):
//!
//! ```text
//! label                   context                                        result
//! "sealer", "opener"      line                                           a key for each role on each line
//! "nonce"                 seed u64, count u32                            from the role's key: its next nonce, 8 bytes
//! "challenge", "taken"    channel u16, sealer's nonce, opener's nonce    from the opener's key: a tag, 8 bytes
//! "proof"                 as above                                       from the sealer's key: a tag, 8 bytes
//! "contents"              as above                                       from the sealer's key: the session's key
//! ```
//! On the command line the host is the sealer and the board the opener. The two directions of a link have
//! different nonces and therefore different keys, even on one channel. A message that is reflected, or
//! replayed on another link or line, has an invalid tag. Keys are derived in handshakes only, never per
//! message.
//!
//! # Freshness and handshake
//!
//! The freshness counts the messages of a session from 1; only its low bits are transmitted. An [`Opener`]
//! accepts a message only if it is newer than every accepted message. A session is identified by one nonce
//! from each end; an end never reuses a nonce, so messages from before a restart belong to another session. A
//! session is set up by messages of class [`Handshake`](dimsart_core::envelope::Class::Handshake) in both
//! directions:
//!
//! ```text
//! opener -> sealer   7 u32                        question: no session, send a hello
//! sealer -> opener   3 u32 | nonce u64            hello: the sealer's nonce
//! opener -> sealer   4 u32 | nonce u64 | tag      challenge: the opener's nonce, authenticated
//! sealer -> opener   5 u32 | nonce u64 | tag      proof, followed by sealed messages
//! opener -> sealer   6 u32 | tag                  taken: proof accepted
//! ```
//! Without a session, a sealer sends a hello instead of each message. With a session, it sends the proof
//! before each message until the opener acknowledges it. A lost handshake message therefore costs one
//! message. A [`SecureChannel`] combines both ends for one side of a link: it seals outgoing messages, opens incoming
//! ones, and sends a question when it cannot open a message.
//!
//! # Attacks
//!
//! Forged messages cannot block genuine ones: only a message with a valid tag changes state. A sealer starts
//! a new session only for a challenge to its own last hello, an opener only for a proof of its own last
//! challenge, and each only once. Hello and question have no tag and change no state. An opener answers every
//! hello without storing it, so a flood cannot displace the genuine one. A guard limits replies that do not
//! depend on the request to one per ms, and ignores hello and question for [`SESSION_HOLD_MS`] after each accepted
//! message.
//!
//! After one side restarts, its peer ignores it for [`SESSION_HOLD_MS`] plus one round trip: 7 ms at a one-way
//! delay of 1 ms. Up to a one-way delay of 7 ms this is shorter than the 20 ticks after which a link is lost.
//! The restarted side receives its first message after 4 one-way delays.
//!
//! # Strength of a tag
//!
//! An opener checks every message, including genuine ones during a flood. At `r` messages per second, a tag
//! of `t` bits is guessed `r * 3.2e7 / 2^t` times a year:
//!
//! ```text
//! short   56 bits, 8000/s (more than classic CAN carries)               3.5e-6
//! full    64 bits, 150000/s (100 Mbit/s, in the shortest datagrams)     2.6e-7
//! ```
//! There is no lock-out. A 24-bit tag would be guessed 15 000 times a year, and a lock-out after a number of
//! invalid tags would let an attacker block the link.
//!
//! # Limits
//!
//! Messages are authenticated, not encrypted. The key is stored in the controller's flash; enable read-out
//! protection on parts without a hardware security module.

mod guard;
mod handshake;
mod keys;
mod line;
mod opener;
mod sealer;
mod tag;

pub use guard::{SESSION_HOLD_MS, SecureChannel};
pub use line::KeyDomain;
pub use opener::{AuthError, Opener};
pub use sealer::Sealer;
pub use tag::{Key, Profile};
