//! Drives of CiA 402 on a `CANopen` bus, as far as a joint under torque needs them: bytes in, bytes out.
//!
//! ```text
//!   torque_nm ─▶ Cia402Joint ─▶ RPDO 1 ─┬▶ bus, in this order ─▶ drives
//!                Cia402Host ──▶ SYNC ───┘                          │
//!   position, ... ◀─ Cia402Joint ◀─ TPDO 1, 2, 3, EMCY, heartbeat ─┘
//! ```
//! From CiA 301 (communication), CiA 402-2 and -3 (the same as IEC 61800-7-201 and -301: state machine, objects), and from
//! what manuals of drives say of these. The bus is classic CAN; the drive torques in the mode *cyclic synchronous torque*.

mod abort;
mod emergency;
mod frame;
mod host;
mod joint;
mod node;
mod settings;
mod setup;
mod state;
mod trouble;

pub use abort::Cia402Abort;
pub use emergency::Cia402Emergency;
pub use frame::Cia402Frame;
pub use host::Cia402Host;
pub use joint::{Cia402Joint, Cia402Reading};
pub use node::Cia402Node;
pub use settings::Cia402Settings;
pub use state::{Cia402Command, Cia402State};
pub use trouble::Cia402Trouble;

/// NMT states as heartbeats have them.
const OPERATIONAL: u8 = 0x05;
const BOOTING: u8 = 0x00;

/// The mode of operation *cyclic synchronous torque*.
const TORQUE_MODE: i8 = 10;
