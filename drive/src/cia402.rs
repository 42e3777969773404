//! CiA 402 drives on a `CANopen` bus, as far as torque-controlled joints need them: bytes in, bytes out.
//!
//! ```text
//!   torque_nm ─▶ Cia402Joint ─▶ RPDO 1 ─┬▶ bus, in this order ─▶ drives
//!                Cia402Host ──▶ SYNC ───┘                          │
//!   position, ... ◀─ Cia402Joint ◀─ TPDO 1, 2, 3, EMCY, heartbeat ─┘
//! ```
//! After CiA 301 (communication), CiA 402-2 and -3 (equal to IEC 61800-7-201 and -301: state machine, objects) and
//! drive manuals. The bus is classic CAN; the drives run in mode *cyclic synchronous torque*.

mod abort;
mod emergency;
mod frame;
mod host;
mod joint;
mod joint_fault;
mod node;
mod settings;
mod setup;
mod state;

pub use abort::Cia402Abort;
pub use emergency::Cia402Emergency;
pub use frame::Cia402Frame;
pub use host::Cia402Host;
pub use joint::{Cia402Joint, Cia402Reading};
pub use joint_fault::Cia402JointFault;
pub use node::Cia402Node;
pub use settings::Cia402Settings;
pub use state::{Cia402Command, Cia402State};

/// NMT states in heartbeats.
const OPERATIONAL: u8 = 0x05;
const BOOTING: u8 = 0x00;

/// The mode of operation *cyclic synchronous torque*.
const TORQUE_MODE: i8 = 10;
