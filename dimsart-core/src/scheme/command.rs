//! Commands that build and change a scheme at run time.

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
    /// Plugs the module in after those already plugged in.
    PlugIn(ModuleRef),
    /// Unplugs the module; it keeps its parameters.
    Unplug(ModuleRef),
    /// Makes the next [`PlugIn`](Self::PlugIn) insert its module before this one instead of at the end.
    /// Cancelled when this module is unplugged, even if it is plugged in again.
    PlaceBefore(ModuleRef),
    /// Resets the module's state; it keeps its parameters.
    ResetModule(ModuleRef),
    /// Resets the module's parameters to their defaults. Only while it is not plugged in.
    InitModule(ModuleRef),
    /// Deletes the module instance and frees its memory.
    CloseModule(ModuleRef),
    /// Checks the scheme and starts it if it has no fault; in a transaction, with the commit.
    Check,
    /// Stops the scheme; the device gets its safe value. A STOP from a client also ends any client's lease.
    Stop,
    /// Resets the state of every module that is plugged in.
    Reset,
    /// Stops the scheme and deletes all modules. In a transaction the running scheme continues, and the
    /// pending scheme becomes empty.
    Close,
    /// As [`Close`](Self::Close): restores the state after power-up.
    Init,
    /// Opens a transaction: until [`Commit`](Self::Commit) or [`Abort`](Self::Abort), commands change the
    /// pending scheme while the running scheme continues. Resets and [`Stop`](Self::Stop) still apply to the
    /// running scheme.
    Begin,
    /// Replaces the running scheme by the pending scheme between two ticks, if it has no fault. Modules in
    /// both schemes keep their state, even if their order, parameters or bindings have changed. If refused,
    /// the transaction stays open.
    Commit,
    /// Discards the pending scheme.
    Abort,
    /// Sets a parameter, or appends an entry to a list parameter.
    Set {
        /// Module of the parameter.
        module: ModuleRef,
        /// Parameter number: its index in the module's list of parameters.
        parameter: u8,
        /// Index of the value for parameters with [several values](crate::ParameterShape), such as the axis; none
        /// for all values.
        entry: Option<u8>,
        /// The value.
        value: Value,
    },
    /// Binds a port to another signal.
    Bind {
        /// Module of the port.
        module: ModuleRef,
        /// Port number, in order of declaration.
        port: u8,
        /// The signal.
        signal: TypeRef,
    },
    /// Uploads two words of a [program](crate::online). The program commands are for the controller, not for
    /// a scheme: they take effect at once, even in a transaction.
    UploadLaw {
        /// Index of the first word.
        place: u8,
        /// The words; words beyond the maximum are dropped.
        words: [u32; 2],
    },
    /// Verifies the first `count` uploaded words and stores them as program `number`, unless a module uses a
    /// different program of this number.
    StoreLaw {
        /// The program's number, from 1.
        number: u8,
        /// Number of words.
        count: u8,
    },
    /// Deletes a program that no module uses.
    RemoveLaw {
        /// The program's number.
        number: u8,
    },
}

/// An engine command: its name in schemes and its number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EngineCommand {
    /// Name in schemes.
    pub name: &'static str,
    /// Whether its value is a module.
    pub needs_module: bool,
    number: u8,
}

/// Table of the engine commands: number on the wire, name in schemes, command.
macro_rules! engine_commands {
    (with a module: $($of_number:literal $of_name:literal $Of:ident,)* without: $($number:literal $name:literal $Own:ident,)*) => {
        impl EngineCommand {
            /// All engine commands.
            pub const ALL: &'static [Self] = &[
                $(Self { name: $of_name, needs_module: true, number: $of_number },)*
                $(Self { name: $name, needs_module: false, number: $number },)*
            ];
        }

        impl Command {
            /// Returns the command with this number on the wire, if it exists and the value fits.
            fn of_engine(number: u8, module: Option<ModuleRef>) -> Option<Self> {
                Some(match (number, module) {
                    $(($of_number, Some(module)) => Self::$Of(module),)*
                    $(($number, None) => Self::$Own,)*
                    _ => return None,
                })
            }

            /// Returns the wire number and the module of an engine command.
            fn to_engine(self) -> Option<(u8, Option<ModuleRef>)> {
                Some(match self {
                    $(Self::$Of(module) => ($of_number, Some(module)),)*
                    $(Self::$Own => ($number, None),)*
                    Self::Set { .. }
                    | Self::Bind { .. }
                    | Self::UploadLaw { .. }
                    | Self::StoreLaw { .. }
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
    /// Finds an engine command by its name in schemes.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.name == name)
    }

    /// Adds the value; none if a module is missing or superfluous.
    #[must_use]
    pub fn with(self, module: Option<ModuleRef>) -> Option<Command> {
        Command::of_engine(self.number, module)
    }
}

impl Command {
    /// Creates a command that sets a parameter on all axes.
    #[must_use]
    pub const fn set(module: ModuleRef, parameter: u8, value: Value) -> Self {
        Self::Set { module, parameter, entry: None, value }
    }

    /// Creates a command that binds a port to another signal.
    #[must_use]
    pub const fn bind(module: ModuleRef, port: u8, signal: TypeRef) -> Self {
        Self::Bind { module, port, signal }
    }

    /// Returns the engine command; none for other commands.
    #[must_use]
    pub fn as_engine_command(self) -> Option<EngineCommand> {
        let (number, _) = self.to_engine()?;
        EngineCommand::ALL.iter().copied().find(|known| known.number == number)
    }
}

/// Reason why a command was refused. A refused command changes nothing.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CommandError {
    /// The image has no such module kind, or the instance number is 0.
    UnknownModule(ModuleRef),
    /// The module has no such port.
    UnknownPort(u8),
    /// Unknown data type number.
    UnknownType(TypeRef),
    /// The maximum number of instances exists ([`Capacities`](crate::limits::Capacities)): close one first.
    TooManyModules,
    /// The module has more than [`MAX_PORTS`](crate::limits::MAX_PORTS) ports.
    TooManyPorts,
    /// The module is plugged in; it must be unplugged for this command.
    PluggedIn(ModuleRef),
    /// The module is not plugged in, or does not exist.
    NotPluggedIn(ModuleRef),
    /// The Data Base has no room for the module's signals and memory.
    Storage(StorageError),
    /// The parameter was refused.
    Parameter(ParameterError),
    /// The change would break the running scheme.
    BreaksScheme(Finding),
    /// The scheme has faults and does not start; [`Engine::check`](crate::Engine::check) lists them.
    HasFaults {
        /// Number of faults.
        faults: usize,
    },
    /// With this module a tick could exceed its cycle limit.
    TooSlow {
        /// The module.
        module: ModuleRef,
        /// Cycles of the module.
        cycles: u32,
        /// Cycles of a tick with the module.
        tick_cycles: u32,
        /// Limit of a tick, in cycles.
        limit_cycles: u32,
    },
    /// Ticks have a cycle limit, and the image's stamp has no cost of this module.
    CostUnknown(ModuleRef),
    /// Too many ports, or too many ports bound by commands ([`Capacities`](crate::limits::Capacities)).
    TooManyWires,
    /// The signals of a channel and its counters exceed
    /// [`MAX_PACKET_WORDS`](crate::limits::MAX_PACKET_WORDS).
    PacketTooLong {
        /// Number of words.
        words: usize,
    },
    /// A transaction is open already.
    TransactionOpen,
    /// No transaction is open.
    NoTransaction,
    /// A reset was refused, because the device is still moving to its safe value after a fault.
    StillStopping,
    /// A link module must run in every tick; its own parameters set how often it sends.
    RunsEveryTick(ModuleRef),
    /// The module's parameter `PROGRAM` is not the number of a stored [program](crate::online).
    UnknownLaw(ModuleRef),
    /// A program was refused.
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
