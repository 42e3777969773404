//! The sizes everything static is built with.
//!
//! They bound memory and the time of a command; what is free is reported by
//! [`Engine::usage`](crate::Engine::usage), what does not fit is refused with the sizes.

/// Most degrees of freedom a device can have.
pub const MAX_DOF: usize = 8;
/// Most words of a device's inputs that can have [limits](crate::InputLimits).
pub const MAX_LIMITED_WORDS: usize = 16;
/// Most module instances that can exist at the same time, plugged in or not.
pub const MAX_MODULES: usize = 32;
/// Most calls of modules in a tick: two of a module with two stages.
pub const MAX_CALLS: usize = 2 * MAX_MODULES;
/// Most ports one module instance can have.
pub const MAX_PORTS: usize = 12;
/// Most ports, and most handles, that all modules which are plugged in can have together.
pub const MAX_WIRES: usize = 240;
/// Most ports that commands can have bound to other signals, of all modules together.
pub const MAX_BINDINGS: usize = 64;
/// Most slots (data types and module memories) in a Data Base at the same time.
pub const MAX_SLOTS: usize = 64;
/// Most data types of one COMM channel (`ADD_DATA` commands).
pub const MAX_CHANNEL_TYPES: usize = 4;
/// Links a controller can exchange packets over; with the feature `host-sizes` a coordinator has one for every joint.
pub const MAX_LINKS: usize = if cfg!(feature = "host-sizes") { 8 } else { BOARD_LINKS };
/// Clients, or parts of what one client looks at, that a controller sends [telemetry](crate::protocol::Sample) to.
pub const TELEMETRY_STREAMS: usize = if cfg!(feature = "host-sizes") { 16 } else { 1 };
/// Links of a controller on a board.
pub const BOARD_LINKS: usize = 2;
/// Payload of a packet, 32-bit words.
pub const MAX_PACKET_WORDS: usize = 48;
/// Most findings one matching report lists; further ones are counted.
pub const MAX_FINDINGS: usize = 32;
/// Words of Data Base storage unless the application asks for another size, 8 KiB.
pub const DEFAULT_WORDS: usize = 2048;
