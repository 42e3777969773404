//! Commands: how a scheme is built and changed while one image runs.

mod wire;

use crate::data_type::TypeRef;
use crate::limits::{MAX_BINDINGS, MAX_CHANNEL_TYPES, MAX_DOF, MAX_MODULES, MAX_PORTS, MAX_SLOTS, MAX_WIRES};
use crate::matching::Finding;
use crate::parameter::{ParameterError, Value};
use crate::storage::StorageError;
use wire::Wire;

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

/// A command to the engine or to a module.
#[doc(alias = "ModuleCmd")]
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "Wire", try_from = "Wire")]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// Plugs the module in, behind those already plugged in.
    PlugIn(ModuleRef),
    /// Unplugs the module; it keeps its parameters.
    Unplug(ModuleRef),
    /// The next [`PlugIn`](Self::PlugIn) puts its module before this one instead of at the end. Forgotten as soon as this
    /// one is unplugged, plugged in again or not.
    PlaceBefore(ModuleRef),
    /// The module forgets its state and keeps its parameters.
    ResetModule(ModuleRef),
    /// The module's parameters go back to their defaults. Only while it is not plugged in.
    InitModule(ModuleRef),
    /// Ends the module's existence and gives its place back.
    CloseModule(ModuleRef),
    /// Checks the scheme and, when it is sound, lets it run.
    Check,
    /// Stops the scheme; the device gets its safe value.
    Stop,
    /// Every module that is plugged in forgets its state.
    Reset,
    /// Stops, unplugs every module and ends its existence.
    Close,
    /// As [`Close`](Self::Close): the state after power-up.
    Init,
    /// Gives a parameter a value, or adds an entry to one that is a list.
    Set {
        /// Whose parameter.
        module: ModuleRef,
        /// Its number: its place in the module's list of parameters.
        parameter: u8,
        /// Axis of a parameter that each axis has its own of; none for all axes.
        axis: Option<u8>,
        /// The value.
        value: Value,
    },
    /// Binds a port to another signal.
    Bind {
        /// Whose port.
        module: ModuleRef,
        /// Its number: its place in the order of their declaration.
        port: u8,
        /// The signal.
        signal: TypeRef,
    },
}

/// A command to the engine as schemes name it, and its number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EngineCommand {
    /// Its name in schemes.
    pub name: &'static str,
    /// Whether a module is its value.
    pub needs_module: bool,
    number: u8,
}

impl EngineCommand {
    /// Every one.
    pub const ALL: &'static [Self] = &[
        Self { name: "MOD_ON", needs_module: true, number: 1 },
        Self { name: "MOD_OFF", needs_module: true, number: 2 },
        Self { name: "PLACE_BEFORE", needs_module: true, number: 3 },
        Self { name: "MOD_RESET", needs_module: true, number: 4 },
        Self { name: "MOD_INIT", needs_module: true, number: 5 },
        Self { name: "MOD_CLOSE", needs_module: true, number: 6 },
        Self { name: "MATCHING_CHECK", needs_module: false, number: 16 },
        Self { name: "STOP", needs_module: false, number: 17 },
        Self { name: "RESET", needs_module: false, number: 18 },
        Self { name: "CLOSE", needs_module: false, number: 19 },
        Self { name: "INIT", needs_module: false, number: 20 },
    ];

    /// The one of this name in schemes.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.name == name)
    }

    /// The command with its value; none where a module is missing or one too many.
    #[must_use]
    pub fn with(self, module: Option<ModuleRef>) -> Option<Command> {
        command_of(self.number, module)
    }
}

fn command_of(number: u8, module: Option<ModuleRef>) -> Option<Command> {
    Some(match (number, module) {
        (1, Some(module)) => Command::PlugIn(module),
        (2, Some(module)) => Command::Unplug(module),
        (3, Some(module)) => Command::PlaceBefore(module),
        (4, Some(module)) => Command::ResetModule(module),
        (5, Some(module)) => Command::InitModule(module),
        (6, Some(module)) => Command::CloseModule(module),
        (16, None) => Command::Check,
        (17, None) => Command::Stop,
        (18, None) => Command::Reset,
        (19, None) => Command::Close,
        (20, None) => Command::Init,
        _ => return None,
    })
}

impl Command {
    /// Sets a parameter of a module, on all axes.
    #[must_use]
    pub const fn set(module: ModuleRef, parameter: u8, value: Value) -> Self {
        Self::Set { module, parameter, axis: None, value }
    }

    /// Binds a port of a module to another signal.
    #[must_use]
    pub const fn bind(module: ModuleRef, port: u8, signal: TypeRef) -> Self {
        Self::Bind { module, port, signal }
    }

    /// Number of a command to the engine, and the module that is its value.
    fn to_engine(self) -> Option<(u8, Option<ModuleRef>)> {
        Some(match self {
            Self::PlugIn(module) => (1, Some(module)),
            Self::Unplug(module) => (2, Some(module)),
            Self::PlaceBefore(module) => (3, Some(module)),
            Self::ResetModule(module) => (4, Some(module)),
            Self::InitModule(module) => (5, Some(module)),
            Self::CloseModule(module) => (6, Some(module)),
            Self::Check => (16, None),
            Self::Stop => (17, None),
            Self::Reset => (18, None),
            Self::Close => (19, None),
            Self::Init => (20, None),
            Self::Set { .. } | Self::Bind { .. } => return None,
        })
    }

    /// What it is called in schemes, if it is one to the engine.
    #[must_use]
    pub fn as_engine_command(self) -> Option<EngineCommand> {
        let (number, _) = self.to_engine()?;
        EngineCommand::ALL.iter().copied().find(|known| known.number == number)
    }
}

/// Why a command was refused. Whatever the reason, nothing has changed.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CommandError {
    /// The image has no module of this kind, or an instance number is 0.
    UnknownModule(ModuleRef),
    /// Of a device of another version: its engine knows no command of this number.
    UnknownVerb(u8),
    /// The module has no such port.
    UnknownPort(u8),
    /// No data type has this number.
    UnknownType(TypeRef),
    /// Of a device of another version: the value is not of the kind that this command needs.
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
