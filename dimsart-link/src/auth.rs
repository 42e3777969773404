//! Contents that only who has the key can make, and that nobody can use twice.
//!
//! A layer between [`envelope`](dimsart_core::envelope) and [`carrier`](crate::carrier): contents in, contents out. It is
//! in the build with feature `auth`.
//!
//! ```text
//! content   class + 0x80 u8 | counter u16 | payload | freshness | tag | CRC-32
//! full      freshness u32, tag 8 bytes     UART, CAN FD, UDP: 12 bytes more than without
//! short     freshness u8, tag 7 bytes      classic CAN: 8 bytes more, of which 4 where its frames have room
//! tag       the first bytes of AES-128-CMAC over: line 2 bytes | channel u16 | freshness u64 | class .. payload
//! line      1, number of the link; or 2, 0: the command line
//! ```
//!
//! # Keys
//!
//! Nothing travels under the key that was given. From it follow, one from the other (NIST SP 800-108, counter mode, one
//! block of CMAC: `1 | label | 0 | context | 128 u16, high byte first`):
//!
//! ```text
//! label                   context                                        is
//! "sealer", "opener"      line                                           a key of each role on each line
//! "nonce"                 seed u64, count u32                            of the role's key: its next nonce, 8 bytes
//! "challenge", "taken"    channel u16, sealer's nonce, opener's nonce    of the opener's key: a tag, 8 bytes
//! "proof"                 as before                                      of the sealer's key: a tag, 8 bytes
//! "contents"              as before                                      of the sealer's key: that of contents
//! ```
//! On the command line the host is the sealer, the board the opener. The two directions of a link have different nonces,
//! and so different keys, also where they have one channel. What is moved to another link or line, or sent back, has a
//! wrong tag. Keys are made when ends find together, and never for a content.
//!
//! # Fresh
//!
//! The freshness counts every content of an association from 1; its low bits travel. An [`Opener`] takes only what is
//! newer than all it took before. An association has a nonce of each end, which that end has used for nothing else: what
//! was said before the last start of either is of another one. Ends find together by class
//! [`Handshake`](dimsart_core::envelope::Class::Handshake), on the way back and forth:
//!
//! ```text
//! opener -> sealer   7 u32                        I cannot open this (question)
//! sealer -> opener   3 u32 | nonce u64            I am here (hello)
//! opener -> sealer   4 u32 | nonce u64 | tag      so am I, with the key (challenge)
//! sealer -> opener   5 u32 | nonce u64 | tag      then I seal for you (proof), and contents
//! opener -> sealer   6 u32 | tag                  I take them (taken)
//! ```
//! A sealer says hello in place of each content that it cannot seal, and proves itself before each one that it seals,
//! until it is told that it is taken. So what gets lost costs a content and no more. A [`Guard`] is both ends of one side
//! of a link: the sealer of what leaves, the opener of what comes. It asks when something cannot be opened.
//!
//! # What a forger can do
//!
//! Say what they like, as often as the line carries it, and no genuine content is kept out by it: what changes
//! something has a tag. A sealer changes its association for a challenge to its own last hello, an opener for a proof of
//! its own last challenge, once. Hello and question have no tag, and change nothing. An opener answers every hello and
//! remembers none, so that no flood is in the place of the right one; of what is told to anybody the same, a guard says
//! each once a ms. A [`Guard`] hears neither for [`STANDS_MS`] after it has taken something.
//!
//! When one side starts anew, the other one hears nothing of it for [`STANDS_MS`] and the time there and back. With 1 ms
//! of each way that is 7 ms, and less than the 20 ticks after which a link is lost up to 7 ms of each way. To the side
//! that has started comes the first content after 4 times of one way.
//!
//! # How much a tag is worth
//!
//! An opener looks at every content, at the genuine ones in a flood, too. So at `r` contents a second a tag of `t` bits is
//! guessed `r * 3.2e7 / 2^t` times a year:
//!
//! ```text
//! short   56 bits, 8000/s (more than classic CAN carries)               3.5e-6
//! full    64 bits, 150000/s (100 Mbit/s, in the shortest datagrams)     2.6e-7
//! ```
//! There is no lock-out. With 24 bits it would be 15 000 times a year, and whatever is locked out after a number of wrong
//! tags can be kept locked by whoever sends that many.
//!
//! # What it does not do
//!
//! Contents are not secret. The key lies in the controller's memory as everything else does: a part without a
//! hardware security module gives it to whoever can read its flash; enable the read-out protection.

mod guard;
mod handshake;
mod keys;
mod line;
mod opener;
mod sealer;
mod tag;

pub use guard::{Guard, STANDS_MS};
pub use line::Line;
pub use opener::{AuthError, Opener};
pub use sealer::Sealer;
pub use tag::{Key, Profile};
