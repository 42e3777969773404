//! Media: what a bus or a line does to bytes, frames and their timing, and nothing of what is in them.
//!
//! Time is given in nanoseconds of virtual time; every draw comes from a seed. [`link`](crate::link) puts packets on
//! them.

pub mod can;
mod datagram;
mod delay;
mod line;
mod random;
pub mod time;
mod traffic;
mod uart;

pub use datagram::{DatagramParameters, DatagramPath};
pub use delay::{Delay, DelayFileError};
pub use random::Random;
pub(crate) use traffic::load;
pub use traffic::{MediumReport, Occupation, Timeline, Traffic};
pub use uart::{Uart, UartParameters};
