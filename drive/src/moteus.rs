//! The registers of a mjbots moteus drive over CAN FD, as far as a joint under torque needs them: bytes in, bytes out.
//!
//! ```text
//!   torque_nm, timeout_s ─▶ MoteusFrame ─▶ CAN FD ─▶ drive
//!            MoteusState ◀─ from_reply ◀─ CAN FD ◀──┘
//! ```
//! [`MoteusJoint`] makes a joint of them, tick by tick.
//!
//! From the documents `docs/protocol/can.md`, `docs/protocol/registers.md` and `docs/guides/control-modes.md` of
//! <https://github.com/mjbots/moteus>. The bus runs at 1 Mbit/s and its data at 5 Mbit/s. The drive counts turns of the
//! output; here is `rad`. A reply shows the drive as it was before the command of the same frame.
//!
//! When a command's timeout runs out, a drive as delivered brakes the joint with up to 5 N m. One that is to let go has
//! `servo.timeout_mode` 0 in its configuration.

mod address;
mod fault;
mod frame;
mod joint;
mod mode;
mod reply;
mod state;
mod trouble;

pub use address::MoteusAddress;
pub use fault::MoteusFault;
pub use frame::MoteusFrame;
pub use joint::{MoteusJoint, MoteusReading};
pub use mode::MoteusMode;
pub use reply::MoteusReplyError;
pub use state::MoteusState;
pub use trouble::MoteusTrouble;

/// Numbers of the registers that are used.
mod register {
    pub(super) const MODE: u8 = 0x00;
    pub(super) const POSITION: u8 = 0x01;
    pub(super) const VELOCITY: u8 = 0x02;
    pub(super) const TORQUE: u8 = 0x03;
    pub(super) const VOLTAGE: u8 = 0x0d;
    pub(super) const TEMPERATURE: u8 = 0x0e;
    pub(super) const FAULT: u8 = 0x0f;
    pub(super) const COMMAND_POSITION: u8 = 0x20;
    pub(super) const COMMAND_TORQUE: u8 = 0x22;
    pub(super) const PROPORTIONAL_SCALE: u8 = 0x23;
    pub(super) const TIMEOUT: u8 = 0x27;
    pub(super) const INTEGRAL_SCALE: u8 = 0x2b;
}

/// No operation: what fills a frame up.
const NOP: u8 = 0x50;
