//! Commands: how a scheme is built and changed while one image runs.

use crate::data_type::TypeRef;
use crate::limits::{MAX_BINDINGS, MAX_CHANNEL_TYPES, MAX_DOF, MAX_MODULES, MAX_PORTS, MAX_SLOTS, MAX_WIRES};
use crate::matching::Finding;
use crate::parameter::{ParameterError, Value};
use crate::storage::StorageError;

/// One instance of a kind of module, written `PDCTRL_MOD`, `PDCTRL_MOD.2`, ...
///
/// An instance comes into being with the first command that names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModuleRef {
    /// Place in [`ModuleList::KINDS`](crate::ModuleList::KINDS).
    pub kind: u8,
    /// 1 for the plain name.
    pub number: u8,
}

/// Who a command is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Target {
    /// The Module Engine, `MOD_ENG`.
    Engine,
    /// A module.
    Module(ModuleRef),
}

/// What the engine can be told; the number is `Command::param`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Verb {
    /// Plugs the module in, behind those already plugged in.
    ModOn = 1,
    /// Unplugs the module; it keeps its parameters.
    ModOff = 2,
    /// The next `MOD_ON` puts its module before this one instead of at the end. Forgotten as soon as this
    /// one is unplugged, plugged in again or not.
    PlaceBefore = 3,
    /// The module forgets its state and keeps its parameters.
    ModReset = 4,
    /// The module's parameters go back to their defaults. Only while it is not plugged in.
    ModInit = 5,
    /// Ends the module's existence and gives its place back.
    ModClose = 6,
    /// Checks the scheme and, when it is sound, lets it run.
    MatchingCheck = 16,
    /// Stops the scheme; the device gets its safe input.
    Stop = 17,
    /// Every module that is plugged in forgets its state.
    Reset = 18,
    /// Stops, unplugs every module and ends its existence.
    Close = 19,
    /// As `CLOSE`: the state after power-up.
    Init = 20,
}

impl Verb {
    /// Every verb with its name in schemes and whether it needs a module as its value.
    pub const ALL: &'static [(Self, &'static str, bool)] = &[
        (Self::ModOn, "MOD_ON", true),
        (Self::ModOff, "MOD_OFF", true),
        (Self::PlaceBefore, "PLACE_BEFORE", true),
        (Self::ModReset, "MOD_RESET", true),
        (Self::ModInit, "MOD_INIT", true),
        (Self::ModClose, "MOD_CLOSE", true),
        (Self::MatchingCheck, "MATCHING_CHECK", false),
        (Self::Stop, "STOP", false),
        (Self::Reset, "RESET", false),
        (Self::Close, "CLOSE", false),
        (Self::Init, "INIT", false),
    ];

    pub(crate) fn from_number(number: u8) -> Option<Self> {
        Self::ALL.iter().map(|(verb, ..)| *verb).find(|verb| *verb as u8 == number)
    }
}

/// `param` of a command that binds port `n` of a module is `PORT + n`.
pub const PORT: u8 = 128;

/// A command to the engine or to a module.
#[doc(alias = "ModuleCmd")]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Command {
    /// Who it is for.
    pub module: Target,
    /// A [`Verb`] of the engine, the number of a parameter, or [`PORT`] + the number of a port.
    pub param: u8,
    /// Axis of a parameter that each axis has its own of; none for all axes.
    pub axis: Option<u8>,
    /// The value.
    pub value: Value,
}

impl Command {
    /// A command to the engine about a module.
    #[must_use]
    pub const fn engine(verb: Verb, module: ModuleRef) -> Self {
        Self { module: Target::Engine, param: verb as u8, axis: None, value: Value::Module(module) }
    }

    /// A command to the engine that needs no value.
    #[must_use]
    pub const fn plain(verb: Verb) -> Self {
        Self { module: Target::Engine, param: verb as u8, axis: None, value: Value::Nothing }
    }

    /// Sets a parameter of a module, on all axes.
    #[must_use]
    pub const fn set(module: ModuleRef, parameter: u8, value: Value) -> Self {
        Self { module: Target::Module(module), param: parameter, axis: None, value }
    }

    /// Binds a port of a module to another signal.
    #[must_use]
    pub const fn bind(module: ModuleRef, port: u8, signal: TypeRef) -> Self {
        Self {
            module: Target::Module(module),
            param: PORT.saturating_add(port),
            axis: None,
            value: Value::Type(signal),
        }
    }
}

/// Why a command was refused. Whatever the reason, nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CommandError {
    /// The image has no module of this kind, or an instance number is 0.
    UnknownModule(ModuleRef),
    /// The engine knows no such verb.
    UnknownVerb(u8),
    /// The module has no such port.
    UnknownPort(u8),
    /// No data type has this number.
    UnknownType(TypeRef),
    /// The value is not of the kind that this command needs.
    WrongValue,
    /// [`MAX_MODULES`] instances exist already: close one first.
    TooManyModules,
    /// The module needs more than [`MAX_PORTS`] ports.
    TooManyPorts,
    /// The module is plugged in already, or must be unplugged for this.
    PluggedIn(ModuleRef),
    /// The module is not plugged in, or does not exist.
    NotPluggedIn(ModuleRef),
    /// The Data Base has no room for the module's signals and memory.
    Storage(StorageError),
    /// The parameter was refused.
    Parameter(ParameterError),
    /// The scheme is running and this change would break it.
    WouldBreak(Finding),
    /// The scheme has this many faults and does not start; [`Engine::check`](crate::Engine::check)
    /// names them.
    DoesNotMatch {
        /// Number of faults.
        faults: usize,
    },
    /// With this module a tick could take longer than it may.
    TooSlow {
        /// The module.
        module: ModuleRef,
        /// What it adds, cycles.
        cycles: u32,
        /// What a tick could take with it, cycles.
        tick_cycles: u32,
        /// What a tick may take, cycles.
        limit_cycles: u32,
    },
    /// The image's stamp does not say what this module adds to a tick, and a tick may take so long only.
    CostUnknown(ModuleRef),
    /// All modules together have more than [`MAX_WIRES`] ports, or more than [`MAX_BINDINGS`] of them are bound by
    /// commands.
    WiringFull,
}

impl From<StorageError> for CommandError {
    fn from(error: StorageError) -> Self {
        Self::Storage(error)
    }
}

impl From<ParameterError> for CommandError {
    fn from(error: ParameterError) -> Self {
        Self::Parameter(error)
    }
}

impl core::fmt::Display for CommandError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::UnknownModule(module) => {
                write!(f, "no module of kind {} number {} in this image", module.kind, module.number)
            }
            Self::UnknownVerb(verb) => write!(f, "the engine knows no command {verb}"),
            Self::UnknownPort(port) => write!(f, "the module has no port {port}"),
            Self::UnknownType(signal) => write!(f, "no data type has the number {}", signal.id),
            Self::WrongValue => write!(f, "the value is not of the kind this command needs"),
            Self::TooManyModules => {
                write!(f, "{MAX_MODULES} modules exist already and no more fit: MOD_CLOSE one first")
            }
            Self::TooManyPorts => {
                write!(f, "the module needs more than {MAX_PORTS} ports: add fewer types to it")
            }
            Self::PluggedIn(_) => write!(f, "the module is plugged in: MOD_OFF first"),
            Self::NotPluggedIn(_) => write!(f, "the module is not plugged in: MOD_ON first"),
            Self::Storage(StorageError::NoSlot) => {
                write!(f, "all {MAX_SLOTS} slots of the Data Base are taken: MOD_OFF another module first")
            }
            Self::Storage(StorageError::NoRoom { wanted, free }) => {
                write!(
                    f,
                    "the module needs {wanted} words of the Data Base and {free} are free: \
                     ask for less (a shorter delay, fewer rows) or MOD_OFF another module first"
                )
            }
            Self::Parameter(ParameterError::Unknown) => write!(f, "the module has no such parameter"),
            Self::Parameter(ParameterError::WrongKind) => {
                write!(f, "the value is not of the kind this parameter takes")
            }
            Self::Parameter(ParameterError::OutOfRange) => write!(f, "the value is out of range"),
            Self::Parameter(ParameterError::ListFull) => {
                write!(f, "the channel carries {MAX_CHANNEL_TYPES} types already and takes no more")
            }
            Self::Parameter(ParameterError::NoSuchAxis) => {
                write!(f, "no such axis (at most {MAX_DOF}), or the parameter is not per axis")
            }
            Self::Parameter(ParameterError::WhilePluggedIn) => {
                write!(f, "this parameter decides ports or memory: MOD_OFF first")
            }
            Self::Parameter(ParameterError::NeedsCounters) => {
                write!(
                    f,
                    "STALE LIMITED and INTEGRAL need CRX_COUNTERS ON, and CTX_COUNTERS ON on the other side"
                )
            }
            Self::WouldBreak(_) => write!(f, "the scheme is running and this would break it"),
            Self::DoesNotMatch { faults } => write!(f, "the scheme does not match: {faults} fault(s)"),
            Self::TooSlow { cycles, tick_cycles, limit_cycles, .. } => {
                write!(
                    f,
                    "the module takes up to {cycles} cycles, a tick with it up to {tick_cycles}, and it may take \
                     {limit_cycles}: MOD_OFF another module first, or let the device have fewer axes"
                )
            }
            Self::CostUnknown(_) => {
                write!(
                    f,
                    "a tick has a limit and the image's stamp does not say what the module takes: `dimsart stamp` says why \
                     it found no bound"
                )
            }
            Self::WiringFull => {
                write!(
                    f,
                    "the modules have {MAX_WIRES} ports together, or commands have bound {MAX_BINDINGS} of them, and \
                     no more fit: MOD_OFF another module, or MOD_INIT one whose bindings are not needed"
                )
            }
        }
    }
}

impl core::error::Error for CommandError {}
