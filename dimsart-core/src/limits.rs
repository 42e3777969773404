//! Capacities: sizes that the application chooses, and their maxima.
//!
//! They bound the memory and the time of a command. [`Engine::usage`](crate::Engine::usage) reports the
//! current use; an overflow is refused with the sizes.

/// Capacities of a controller, chosen with its [memory](crate::ControllerMemory).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capacities {
    /// Module instances, plugged in or not; maximum [`MAX_MODULES`].
    pub modules: usize,
    /// Ports, and handles, of all modules that are plugged in; maximum [`MAX_BOUND_PORTS`] each.
    pub wires: usize,
    /// Ports of all modules that commands have bound to other signals.
    pub bindings: usize,
    /// Signals and module memories in the Data Base; maximum [`MAX_SLOTS`].
    pub slots: usize,
    /// Links; maximum [`MAX_LINKS`].
    pub links: usize,
    /// [Programs](crate::online).
    pub programs: usize,
    /// Words of the Data Base; maximum [`MAX_WORDS`].
    pub words: usize,
}

impl Capacities {
    /// Capacities for most schemes, 27 KiB.
    pub const DEFAULT: Self = Self {
        modules: MAX_MODULES,
        wires: 240,
        bindings: 64,
        slots: MAX_SLOTS,
        links: 2,
        programs: 4,
        words: DEFAULT_WORDS,
    };

    /// Returns these sizes after checking them against the maxima.
    ///
    /// # Panics
    /// When a size exceeds its maximum; for a constant this is a build error.
    #[must_use]
    pub const fn checked(self) -> Self {
        assert!(self.modules <= MAX_MODULES, "a controller has at most 32 modules");
        assert!(self.wires <= MAX_BOUND_PORTS, "a controller has at most 255 ports");
        assert!(self.slots <= MAX_SLOTS, "a Data Base has at most 64 slots");
        assert!(self.links <= MAX_LINKS, "a controller has at most 8 links");
        assert!(self.words <= MAX_WORDS, "a Data Base has at most 65534 words");
        self
    }

    /// Number of program slots: one more for the program being uploaded.
    #[must_use]
    pub const fn program_slots(self) -> usize {
        if self.programs == 0 { 0 } else { self.programs + 1 }
    }
}

/// Maximum degrees of freedom of a device.
pub const MAX_DOF: usize = 8;
/// Maximum number of a device's input words with [limits](crate::InputLimits), and of its limited output
/// words.
pub const MAX_LIMITED_WORDS: usize = 16;
/// Maximum number of module instances: a set of them has 32 bits.
pub const MAX_MODULES: usize = 32;
/// Maximum number of module calls in a tick: two stages per module.
pub(crate) const MAX_CALLS: usize = 2 * MAX_MODULES;
/// Maximum number of ports of a module instance.
pub const MAX_PORTS: usize = 12;
/// Maximum number of ports, and of handles, of all modules that are plugged in: their indices are bytes.
pub const MAX_BOUND_PORTS: usize = 255;
/// Maximum number of slots in a Data Base: a set of them has 64 bits.
pub const MAX_SLOTS: usize = 64;
/// Maximum number of data types of a COMM channel (`ADD_DATA` commands).
pub const MAX_CHANNEL_TYPES: usize = 4;
/// Maximum number of links.
pub const MAX_LINKS: usize = 8;
/// Maximum number of words of a program.
pub const PROGRAM_WORDS: usize = 120;
/// Maximum payload of a packet in 32-bit words.
pub const MAX_PACKET_WORDS: usize = 48;
/// Maximum number of listed findings of a check; further findings are only counted.
pub const MAX_FINDINGS: usize = 32;
/// Default size of the Data Base in words (8 KiB).
pub const DEFAULT_WORDS: usize = 2048;
/// Maximum size of the Data Base in words: indices have 16 bits.
pub const MAX_WORDS: usize = 65_534;

/// Maximum number of a device's output types, and of its input types.
pub const MAX_DEVICE_TYPES: usize = 8;
