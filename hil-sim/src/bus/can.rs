//! CAN bus.

mod bus;
mod frame;
mod node;
mod response_time;

pub use bus::{CanBus, CanParameters, Response};
pub use frame::{CLASSIC_BYTES, CanFrame, Format, INTERFRAME_BITS, Identifier, WireBits};
pub use node::{ErrorState, Node};
pub use response_time::{Message, worst_response_ns};

#[cfg(test)]
mod tests;
