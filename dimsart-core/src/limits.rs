//! Sizes: what the creator of a controller chooses, and what none can go beyond.
//!
//! They bound memory and the time of a command; what is free is reported by
//! [`Engine::usage`](crate::Engine::usage), what does not fit is refused with the sizes.

/// What a controller has room for. Its creator chooses it with the controller's [memory](crate::ControllerMemory).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Module instances, plugged in or not: at most [`MAX_MODULES`].
    pub modules: usize,
    /// Ports, and handles, of all modules that are plugged in: at most [`MAX_WIRES`].
    pub wires: usize,
    /// Ports that commands have bound to other signals, of all modules.
    pub bindings: usize,
    /// Data types and module memories in the Data Base: at most [`MAX_SLOTS`].
    pub slots: usize,
    /// Links to exchange packets over: at most [`MAX_LINKS`].
    pub links: usize,
    /// [Programs](crate::online).
    pub programs: usize,
    /// Words of the Data Base: at most [`MAX_WORDS`].
    pub words: usize,
}

impl Sizes {
    /// Room for most schemes, in 27 KiB.
    pub const DEFAULT: Self = Self {
        modules: MAX_MODULES,
        wires: 240,
        bindings: 64,
        slots: MAX_SLOTS,
        links: 2,
        programs: 4,
        words: DEFAULT_WORDS,
    };

    /// These sizes, none of them beyond its maximum.
    ///
    /// # Panics
    /// Where one is, which fails the build as sizes are constants.
    #[must_use]
    pub const fn checked(self) -> Self {
        assert!(self.modules <= MAX_MODULES, "a controller has at most 32 modules");
        assert!(self.wires <= MAX_WIRES, "a controller has at most 255 ports");
        assert!(self.slots <= MAX_SLOTS, "a Data Base has at most 64 slots");
        assert!(self.links <= MAX_LINKS, "a controller has at most 8 links");
        assert!(self.words <= MAX_WORDS, "a Data Base has at most 65534 words");
        self
    }

    /// Places that programs take: with one for the program that is being uploaded.
    #[must_use]
    pub const fn program_places(self) -> usize {
        if self.programs == 0 { 0 } else { self.programs + 1 }
    }
}

/// Most degrees of freedom a device can have.
pub const MAX_DOF: usize = 8;
/// Most words of a device's inputs that can have [limits](crate::InputLimits).
pub const MAX_LIMITED_WORDS: usize = 16;
/// Most module instances that can exist at the same time: a set of them is 32 bits.
pub const MAX_MODULES: usize = 32;
/// Most calls of modules in a tick: two of a module with two stages.
pub(crate) const MAX_CALLS: usize = 2 * MAX_MODULES;
/// Most ports one module instance can have.
pub const MAX_PORTS: usize = 12;
/// Most ports, and most handles, of all modules that are plugged in: their places are bytes.
pub const MAX_WIRES: usize = 255;
/// Most slots in a Data Base: a set of them is 64 bits.
pub const MAX_SLOTS: usize = 64;
/// Most data types of one COMM channel (`ADD_DATA` commands).
pub const MAX_CHANNEL_TYPES: usize = 4;
/// Most links a controller can exchange packets over.
pub const MAX_LINKS: usize = 8;
/// Most words of a program.
pub const PROGRAM_WORDS: usize = 120;
/// Payload of a packet, 32-bit words.
pub const MAX_PACKET_WORDS: usize = 48;
/// Most findings one matching report lists; further ones are counted.
pub const MAX_FINDINGS: usize = 32;
/// Words of Data Base storage unless the application asks for another size, 8 KiB.
pub const DEFAULT_WORDS: usize = 2048;
/// Most words of a Data Base: their places are 16 bits.
pub const MAX_WORDS: usize = 65_534;

/// Maximum number of types that a device measures, and of types that command it.
pub const MAX_DEVICE_TYPES: usize = 8;
