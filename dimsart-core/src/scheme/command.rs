//! Commands: how a scheme is built and changed while one image runs.

mod wire;

use crate::data_base::StorageError;
use crate::module::ModuleRef;
use crate::online::LawRefusal;
use crate::parameter::{ParameterError, Value};
use crate::scheme::finding::Finding;
use crate::signal::TypeRef;
use wire::Wire;

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
    /// The next [`PlugIn`](Self::PlugIn) puts its module before this one instead of at the end. Forgotten as soon as
    /// this one is unplugged, plugged in again or not.
    PlaceBefore(ModuleRef),
    /// The module forgets its state and keeps its parameters.
    ResetModule(ModuleRef),
    /// The module's parameters go back to their defaults. Only while it is not plugged in.
    InitModule(ModuleRef),
    /// Ends the module's existence and gives its place back.
    CloseModule(ModuleRef),
    /// Checks the scheme and, when it is sound, lets it run; in a transaction from the commit on.
    Check,
    /// Stops the scheme; the device gets its safe value. From a client, STOP also ends the lease of any client.
    Stop,
    /// Every module that is plugged in forgets its state.
    Reset,
    /// Stops, unplugs every module and ends its existence. In a transaction nothing stops, and the next scheme has no
    /// module.
    Close,
    /// As [`Close`](Self::Close): the state after power-up.
    Init,
    /// Opens a transaction: commands that build or change the scheme are for the next one, until
    /// [`Commit`](Self::Commit) or [`Abort`](Self::Abort), while the one that runs goes on. Resets and
    /// [`Stop`](Self::Stop) are for the one that runs all the same.
    Begin,
    /// The next scheme takes the place of the one that runs, between two ticks, if it is sound. Modules that are in both
    /// keep their state, also where their order, parameters or bindings have changed. Refused, the transaction stays
    /// open.
    Commit,
    /// Drops the next scheme.
    Abort,
    /// Gives a parameter a value, or adds an entry to one that is a list.
    Set {
        /// Whose parameter.
        module: ModuleRef,
        /// Its number: its place in the module's list of parameters.
        parameter: u8,
        /// Place of the value where the parameter has [several](crate::Entries), the axis where each axis has one; none
        /// for all of them.
        entry: Option<u8>,
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
    /// Two words of a [program](crate::online) that is to be kept. This and the next two are for the controller, and not
    /// for a scheme: they take effect at once, in a transaction too.
    PutLaw {
        /// Place of the first one among the words.
        place: u8,
        /// The words; one beyond the last one is dropped.
        words: [u32; 2],
    },
    /// Verifies the first so many words that were put, and keeps them as the program of this number, where no module has
    /// another one of that.
    KeepLaw {
        /// The program's number, from 1.
        number: u8,
        /// Number of words.
        count: u8,
    },
    /// Forgets a program that no module has.
    RemoveLaw {
        /// The program's number.
        number: u8,
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

/// Commands to the engine: number on the wire, name in schemes, and the command. The only table of them.
macro_rules! engine_commands {
    (with a module: $($of_number:literal $of_name:literal $Of:ident,)* without: $($number:literal $name:literal $Own:ident,)*) => {
        impl EngineCommand {
            /// Every one.
            pub const ALL: &'static [Self] = &[
                $(Self { name: $of_name, needs_module: true, number: $of_number },)*
                $(Self { name: $name, needs_module: false, number: $number },)*
            ];
        }

        impl Command {
            /// The command with this number on the wire, if it exists and its value fits.
            fn of_engine(number: u8, module: Option<ModuleRef>) -> Option<Self> {
                Some(match (number, module) {
                    $(($of_number, Some(module)) => Self::$Of(module),)*
                    $(($number, None) => Self::$Own,)*
                    _ => return None,
                })
            }

            /// The number on the wire of a command to the engine, and the module that is its value.
            fn to_engine(self) -> Option<(u8, Option<ModuleRef>)> {
                Some(match self {
                    $(Self::$Of(module) => ($of_number, Some(module)),)*
                    $(Self::$Own => ($number, None),)*
                    Self::Set { .. }
                    | Self::Bind { .. }
                    | Self::PutLaw { .. }
                    | Self::KeepLaw { .. }
                    | Self::RemoveLaw { .. } => return None,
                })
            }
        }
    };
}

engine_commands! {
    with a module:
    1 "MOD_ON" PlugIn,
    2 "MOD_OFF" Unplug,
    3 "PLACE_BEFORE" PlaceBefore,
    4 "MOD_RESET" ResetModule,
    5 "MOD_INIT" InitModule,
    6 "MOD_CLOSE" CloseModule,
    without:
    16 "MATCHING_CHECK" Check,
    17 "STOP" Stop,
    18 "RESET" Reset,
    19 "CLOSE" Close,
    20 "INIT" Init,
    21 "BEGIN" Begin,
    22 "COMMIT" Commit,
    23 "ABORT" Abort,
}

impl EngineCommand {
    /// The one of this name in schemes.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.name == name)
    }

    /// The command with its value; none where a module is missing or one too many.
    #[must_use]
    pub fn with(self, module: Option<ModuleRef>) -> Option<Command> {
        Command::of_engine(self.number, module)
    }
}

impl Command {
    /// Sets a parameter of a module, on all axes.
    #[must_use]
    pub const fn set(module: ModuleRef, parameter: u8, value: Value) -> Self {
        Self::Set { module, parameter, entry: None, value }
    }

    /// Binds a port of a module to another signal.
    #[must_use]
    pub const fn bind(module: ModuleRef, port: u8, signal: TypeRef) -> Self {
        Self::Bind { module, port, signal }
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
    /// The module has no such port.
    UnknownPort(u8),
    /// No data type has this number.
    UnknownType(TypeRef),
    /// As many instances exist already as there is [room](crate::limits::Sizes) for: close one first.
    TooManyModules,
    /// The module needs more than [`MAX_PORTS`](crate::limits::MAX_PORTS) ports.
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
    /// All modules together have more ports, or more of them are bound by commands, than there is
    /// [room](crate::limits::Sizes) for.
    WiringFull,
    /// The signals of a channel and its counters do not fit into a packet of
    /// [`MAX_PACKET_WORDS`](crate::limits::MAX_PACKET_WORDS).
    PacketTooLong {
        /// Words of all of them.
        words: usize,
    },
    /// A transaction is open already.
    TransactionOpen,
    /// No transaction is open.
    NoTransaction,
    /// Something has failed, and the device is on its way to its safe value: it can be reset when it is there.
    FaultReaction,
    /// An end of a link runs in every tick: its own parameters say how often it sends.
    RunsEveryTick(ModuleRef),
    /// The module's parameter `PROGRAM` is the number of no [program](crate::online) that the controller has.
    NoLaw(ModuleRef),
    /// A program was not kept, or not removed.
    Law(LawRefusal),
}

impl From<StorageError> for CommandError {
    fn from(error: StorageError) -> Self {
        Self::Storage(error)
    }
}

impl From<LawRefusal> for CommandError {
    fn from(refusal: LawRefusal) -> Self {
        Self::Law(refusal)
    }
}

impl From<ParameterError> for CommandError {
    fn from(error: ParameterError) -> Self {
        Self::Parameter(error)
    }
}

impl core::error::Error for CommandError {}
