//! Texts of refused commands.

use core::fmt;

use super::Explanation;
use crate::data_base::StorageError;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_PACKET_WORDS, MAX_PORTS};
use crate::module::{KindId, ModuleRef};
use crate::parameter::ParameterError;
use crate::scheme::CommandError;
use crate::signal::AxisKind;
use crate::vocabulary::{DataTypeDescription, ParameterDescription, PortDescription, Vocabulary};

/// A module's name, if names are known.
struct Named<'a, V: ?Sized>(Option<&'a V>, ModuleRef);

impl<V: Vocabulary + ?Sized> fmt::Display for Named<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(known) => known.module_name(self.1).fmt(f),
            None => f.write_str("the module"),
        }
    }
}

/// Writes why a command was refused.
pub(super) fn write<V: Vocabulary + ?Sized>(
    f: &mut fmt::Formatter<'_>,
    error: CommandError,
    known: Option<&V>,
) -> fmt::Result {
    let named = |module| Named(known, module);
    match error {
        CommandError::UnknownModule(module) => {
            match known.filter(|known| known.kind_name(module.kind).is_some()) {
                Some(known) if module.number > 0 => {
                    let name = known.module_name(ModuleRef { number: 1, ..module });
                    write!(
                        f,
                        "the image has no {name}: build an image with this module kind (docs/firmware.md)"
                    )
                }
                Some(known) => write!(
                    f,
                    "invalid instance {}.0: instance numbers start at 1",
                    known.module_name(ModuleRef { number: 1, ..module })
                ),
                None => {
                    write!(
                        f,
                        "the image has no module kind with id {}: build an image with this kind",
                        module.kind
                    )
                }
            }
        }
        CommandError::UnknownPort(port) => write!(f, "the module has no port {port}"),
        CommandError::UnknownType(signal) => write!(f, "unknown data type number {}", signal.id),
        CommandError::TooManyModules => {
            write!(f, "too many modules: close one first (MOD_CLOSE in a scheme, `close` at a device)")
        }
        CommandError::TooManyPorts => {
            write!(f, "the module has more than {MAX_PORTS} ports: add fewer types")
        }
        CommandError::PluggedIn(module) => {
            write!(
                f,
                "{} is plugged in: unplug it first (MOD_OFF in a scheme, `off` at a device)",
                named(module)
            )
        }
        CommandError::NotPluggedIn(module) => {
            write!(
                f,
                "{} is not plugged in: plug it in first (MOD_ON in a scheme, `on` at a device)",
                named(module)
            )
        }
        CommandError::Storage(StorageError::OutOfSlots) => {
            write!(f, "no free slot in the Data Base: unplug another module first")
        }
        CommandError::Storage(StorageError::OutOfMemory { wanted, free }) => {
            write!(
                f,
                "the module needs {wanted} words of the Data Base, but only {free} are free: \
                 use a shorter delay or fewer rows, or unplug another module first"
            )
        }
        CommandError::Parameter(error) => parameter(f, error, known),
        CommandError::BreaksScheme(finding) => {
            write!(f, "this command would break the running scheme")?;
            known.map_or(Ok(()), |known| write!(f, ": {}", Explanation::for_finding(known, finding)))
        }
        CommandError::HasFaults { faults } => {
            write!(f, "the scheme has {faults} fault(s) and does not start")
        }
        CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles } => {
            write!(
                f,
                "with {} ({cycles} cycles), a tick takes up to {tick_cycles} cycles, the limit is {limit_cycles}: \
                 unplug another module first, use fewer axes, or bind signals with fewer words",
                named(module)
            )
        }
        CommandError::CostUnknown(module) => {
            write!(
                f,
                "the image's stamp has no cycle bound for {}: `dimsart stamp` prints the reason",
                named(module)
            )
        }
        CommandError::TransactionOpen => {
            write!(
                f,
                "a transaction is open already: end it with COMMIT or ABORT (`commit`, `abort` at a device)"
            )
        }
        CommandError::StillStopping => {
            write!(f, "the device is still moving to its safe value: retry the reset")
        }
        CommandError::RunsEveryTick(module) => {
            write!(
                f,
                "{} serves a link and must run in every tick: set EVERY_TICKS to 1; CTX_EVERY and CRX_EVERY set the \
                 send rate",
                named(module)
            )
        }
        CommandError::Law(refusal) => write!(f, "{refusal}"),
        CommandError::UnknownLaw(module) => {
            write!(
                f,
                "{} has no law: set PROGRAM to the number of an uploaded law (`law list` at a device)",
                named(module)
            )
        }
        CommandError::NoTransaction => {
            write!(f, "no transaction is open: open one with BEGIN (`begin` at a device)")
        }
        CommandError::PacketTooLong { words } => {
            write!(
                f,
                "the channel's packets have {words} words, the limit is {MAX_PACKET_WORDS}: add fewer types, or omit the \
                 counters (CTX_COUNTERS OFF, CRX_COUNTERS OFF)"
            )
        }
        CommandError::TooManyWires => {
            write!(
                f,
                "the controller has too many ports or bindings: unplug a module, or drop the bindings of an unplugged \
                 module (MOD_INIT in a scheme, `init` at a device)"
            )
        }
    }
}

fn parameter<V: Vocabulary + ?Sized>(
    f: &mut fmt::Formatter<'_>,
    error: ParameterError,
    known: Option<&V>,
) -> fmt::Result {
    match (error, known) {
        (ParameterError::Unknown, _) => write!(f, "the module has no such parameter"),
        (ParameterError::WrongKind, _) => write!(f, "wrong type of value for this parameter"),
        (ParameterError::OutOfRange, _) => {
            write!(f, "the value is out of range, or the link does not exist (a board has links 0 and 1)")
        }
        (ParameterError::ListFull, _) => {
            write!(f, "the channel is full: it carries at most {MAX_CHANNEL_TYPES} types")
        }
        (ParameterError::NoSuchEntry, Some(known)) => {
            write!(f, "no such axis: the device has {} axes, counted from 0", known.axes().len())
        }
        (ParameterError::NoSuchEntry, None) => {
            write!(
                f,
                "index out of range: indices start at 0, and some parameters have one value for all axes"
            )
        }
        (ParameterError::WhilePluggedIn, _) => {
            write!(
                f,
                "this parameter changes ports or memory: unplug the module first (MOD_OFF in a scheme, `off` at a \
                 device)"
            )
        }
        (ParameterError::Imprecise { percent }, _) => {
            write!(
                f,
                "rounding to f32 may change the filter's DC gain by {percent} %: use LOWPASS_MOD, or a larger EVERY_TICKS"
            )
        }
        (ParameterError::NeedsCounters, _) => {
            write!(
                f,
                "STALE LIMITED and STALE INTEGRAL need CRX_COUNTERS ON, and CTX_COUNTERS ON at the peer"
            )
        }
    }
}

/// A vocabulary without names. An engine in its place would duplicate all modules' code in an image.
enum Unnamed {}

impl Vocabulary for Unnamed {
    fn device_name(&self) -> &str {
        match *self {}
    }

    fn axes(&self) -> &[AxisKind] {
        match *self {}
    }

    fn kind_at(&self, _: u8) -> Option<&str> {
        match *self {}
    }

    fn parameter_text(&self, _: KindId, _: u8) -> Option<ParameterDescription<'_>> {
        match *self {}
    }

    fn port_text(&self, _: ModuleRef, _: u8) -> Option<PortDescription<'_>> {
        match *self {}
    }

    fn type_text(&self, _: u16) -> Option<DataTypeDescription<'_>> {
        match *self {}
    }
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, *self, None::<&Unnamed>)
    }
}
