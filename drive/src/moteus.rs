//! mjbots moteus drives over CAN FD, as far as torque-controlled joints need them: bytes in, bytes out.
//!
//! ```text
//!   torque_nm, timeout_s ─▶ MoteusFrame ─▶ CAN FD ─▶ drive
//!            MoteusState ◀─ from_reply ◀─ CAN FD ◀──┘
//! ```
//! [`MoteusJoint`] combines them to a joint, tick by tick.
//!
//! Source: `docs/protocol/can.md`, `docs/protocol/registers.md` and `docs/guides/control-modes.md` of
//! <https://github.com/mjbots/moteus>. The bus runs at 1 Mbit/s with a data rate of 5 Mbit/s. The drive uses turns of
//! the output, this crate `rad`. A reply shows the drive before the command of the same frame.
//!
//! When a command times out, a drive in factory configuration brakes the joint with up to 5 N m. To release the joint
//! instead, set `servo.timeout_mode` to 0.

mod address;
mod fault;
mod frame;
mod joint;
mod joint_fault;
mod mode;
mod reply;
mod state;

pub use address::MoteusAddress;
pub use fault::MoteusFault;
pub use frame::MoteusFrame;
pub use joint::{MoteusJoint, MoteusReading};
pub use joint_fault::MoteusJointFault;
pub use mode::MoteusMode;
pub use reply::MoteusReplyError;
pub use state::MoteusState;

/// Register numbers.
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

/// No operation; pads a frame.
const NOP: u8 = 0x50;
