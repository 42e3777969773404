//! The sizes everything static is built with.
//!
//! They bound memory and the time of a command; what is free is reported by
//! [`Engine::usage`](crate::Engine::usage), what does not fit is refused with the sizes.

/// What a scheme can have of what a controller holds whether it is used or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// See [`MAX_MODULES`].
    pub modules: usize,
    /// See [`MAX_WIRES`].
    pub wires: usize,
    /// See [`MAX_BINDINGS`].
    pub bindings: usize,
    /// See [`MAX_SLOTS`].
    pub slots: usize,
    /// See [`MAX_LINKS`].
    pub links: usize,
    /// See [`MAX_PROGRAMS`].
    pub programs: usize,
}

impl Sizes {
    /// Of a controller on a board.
    pub const BOARD: Self = Self { modules: 32, wires: 240, bindings: 64, slots: 64, links: 2, programs: 4 };
    /// Of one on a board for one joint, which has less memory; with the feature `small-sizes`.
    pub const SMALL: Self = Self { modules: 16, wires: 120, bindings: 32, slots: 48, links: 1, programs: 2 };
    /// Of one on a host, where a coordinator has a link for every joint; with the feature `host-sizes`.
    pub const HOST: Self = Self { links: 8, programs: 8, ..Self::BOARD };
}

/// What this build has.
pub const SIZES: Sizes = if cfg!(feature = "host-sizes") {
    Sizes::HOST
} else if cfg!(feature = "small-sizes") {
    Sizes::SMALL
} else {
    Sizes::BOARD
};

/// Most degrees of freedom a device can have.
pub const MAX_DOF: usize = 8;
/// Most words of a device's inputs that can have [limits](crate::InputLimits).
pub const MAX_LIMITED_WORDS: usize = 16;
/// Most module instances that can exist at the same time, plugged in or not.
pub const MAX_MODULES: usize = SIZES.modules;
/// Most calls of modules in a tick: two of a module with two stages.
pub const MAX_CALLS: usize = 2 * MAX_MODULES;
/// Most ports one module instance can have.
pub const MAX_PORTS: usize = 12;
/// Most ports, and most handles, that all modules which are plugged in can have together.
pub const MAX_WIRES: usize = SIZES.wires;
/// Most ports that commands can have bound to other signals, of all modules together.
pub const MAX_BINDINGS: usize = SIZES.bindings;
/// Most slots (data types and module memories) in a Data Base at the same time.
pub const MAX_SLOTS: usize = SIZES.slots;
/// Most data types of one COMM channel (`ADD_DATA` commands).
pub const MAX_CHANNEL_TYPES: usize = 4;
/// Links a controller can exchange packets over.
pub const MAX_LINKS: usize = SIZES.links;
/// Most [programs](crate::online) at the same time; none without the feature `online`.
pub const MAX_PROGRAMS: usize = if cfg!(feature = "online") { SIZES.programs } else { 0 };
/// Most words of a program.
pub const PROGRAM_WORDS: usize = 120;
/// Clients, or parts of what one client looks at, that a controller sends telemetry to.
pub const TELEMETRY_STREAMS: usize = if cfg!(feature = "host-sizes") { 16 } else { 1 };
/// Payload of a packet, 32-bit words.
pub const MAX_PACKET_WORDS: usize = 48;
/// Most findings one matching report lists; further ones are counted.
pub const MAX_FINDINGS: usize = 32;
/// Words of Data Base storage unless the application asks for another size, 8 KiB.
pub const DEFAULT_WORDS: usize = 2048;
