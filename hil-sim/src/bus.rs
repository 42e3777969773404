//! Media: effects of buses and lines on bytes, frames and timing, independent of content.
//!
//! Time is virtual, in nanoseconds; random numbers are seeded. [`link`](crate::link) sends packets over media.

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
pub use traffic::{BusyInterval, MediumReport, Timeline, Traffic};
pub use uart::{Uart, UartParameters};
