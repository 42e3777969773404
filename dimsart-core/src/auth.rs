//! Contents that only who has the key can make, and that nobody can use twice.
//!
//! A layer between [`envelope`](crate::envelope) and [`carrier`](crate::carrier): contents in, contents out. It is
//! in the build with feature `auth`.
//!
//! ```text
//! content   class + 0x80 u8 | counter u16 | payload | freshness | tag | CRC-32
//! full      freshness u32, tag 8 bytes     UART, CAN FD, UDP: 12 bytes more than without
//! short     freshness u8, tag 3 bytes      classic CAN: 4 bytes more
//! tag       the first bytes of AES-128-CMAC over: channel u16 | nonce u64 | freshness u64 | class .. payload
//! ```
//!
//! # Fresh
//!
//! The freshness counts every content that a [`Sealer`] ever sealed; its low bits travel. An [`Opener`] takes only
//! what is newer than all it took before. The nonce is the opener's: what was recorded before its last start, or was
//! meant for the other direction, has another one. Ends that have lost each other find together by class
//! [`Handshake`](crate::envelope::Class::Handshake), on the way back and forth:
//!
//! ```text
//! sealer -> opener   0 u32                                 I have no nonce (hello)
//! opener -> sealer   1 u32 | nonce u64                     use this one (challenge)
//! sealer -> opener   2 u32 | freshness u64 | tag 8 bytes   this is where I am (proof)
//! ```
//! A [`Guard`] is both ends of one side of a link: the sealer of what leaves, the opener of what comes.
//!
//! Until the proof, an opener goes on with the nonce it had, so a false hello or a replay does not interrupt anybody.
//! A false challenge does, until the next true one, at most [`CHALLENGE_MS`] later: who can write to the line can
//! also cut it. What it cannot do is to have something of its own accepted.
//!
//! # How much a tag is worth
//!
//! 64 bits are out of reach of trying. 24 bits are not: 2^24 tries at 8000 frames/s take 35 minutes. An opener of
//! [`Profile::Short`] therefore takes nothing for [`LOCKOUT_MS`] after [`LOCKOUT_TAGS`] wrong tags within that time,
//! and counts it: at 10 tries a second the expected time is 19 days. A repetition of what is more than 128 contents old
//! looks like a wrong tag to it.
//!
//! # What it does not do
//!
//! Contents are not secret. The key lies in the controller's memory as everything else does: a part without a
//! hardware security module gives it to whoever can read its flash; enable the read-out protection.

mod guard;
mod handshake;
mod lockout;
mod opener;
mod sealer;
mod tag;

pub use guard::Guard;
pub use lockout::{LOCKOUT_MS, LOCKOUT_TAGS};
pub use opener::{AuthError, CHALLENGE_MS, Opener};
pub use sealer::Sealer;
pub use tag::{Key, Profile};
