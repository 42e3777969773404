//! Why a command was refused, in words.

use core::fmt;

use super::Explanation;
use crate::data_base::StorageError;
use crate::limits::{MAX_CHANNEL_TYPES, MAX_PACKET_WORDS, MAX_PORTS};
use crate::module::{KindId, ModuleRef};
use crate::parameter::ParameterError;
use crate::scheme::CommandError;
use crate::signal::AxisKind;
use crate::vocabulary::{DataTypeText, ParameterText, PortText, Vocabulary};

/// A module by its name, where names are known.
struct Named<'a, V: ?Sized>(Option<&'a V>, ModuleRef);

impl<V: Vocabulary + ?Sized> fmt::Display for Named<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(known) => known.name_of_module(self.1).fmt(f),
            None => f.write_str("the module"),
        }
    }
}

/// Writes why a command was refused; without names where none are known.
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
                    let name = known.name_of_module(ModuleRef { number: 1, ..module });
                    write!(f, "the image has no {name}: build it with that module kind (docs/firmware.md)")
                }
                Some(known) => write!(
                    f,
                    "no {}.0: instances count from 1",
                    known.name_of_module(ModuleRef { number: 1, ..module })
                ),
                None => {
                    write!(f, "the image has no module kind with id {}: build it with that kind", module.kind)
                }
            }
        }
        CommandError::UnknownPort(port) => write!(f, "the module has no port {port}"),
        CommandError::UnknownType(signal) => write!(f, "no data type has the number {}", signal.id),
        CommandError::TooManyModules => {
            write!(f, "no more modules fit: close one first (MOD_CLOSE in a scheme, `close` at a device)")
        }
        CommandError::TooManyPorts => {
            write!(f, "the module needs more than {MAX_PORTS} ports: add fewer types to it")
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
        CommandError::Storage(StorageError::NoSlot) => {
            write!(f, "all slots of the Data Base are taken: unplug another module first")
        }
        CommandError::Storage(StorageError::NoRoom { wanted, free }) => {
            write!(
                f,
                "the module needs {wanted} words of the Data Base and {free} are free: \
                 ask for less (a shorter delay, fewer rows) or unplug another module first"
            )
        }
        CommandError::Parameter(error) => parameter(f, error, known),
        CommandError::WouldBreak(finding) => {
            write!(f, "the scheme is running and this would break it")?;
            known.map_or(Ok(()), |known| write!(f, ": {}", Explanation::of_finding(known, finding)))
        }
        CommandError::DoesNotMatch { faults } => {
            write!(f, "the scheme does not match, it has {faults} fault(s)")
        }
        CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles } => {
            write!(
                f,
                "{} takes up to {cycles} cycles, a tick with it up to {tick_cycles}, and it may take {limit_cycles}: \
                 unplug another module first, let the device have fewer axes, or bind the module to signals of fewer words",
                named(module)
            )
        }
        CommandError::CostUnknown(module) => {
            write!(
                f,
                "a tick has a limit and the image's stamp does not say what {} takes: `dimsart stamp` says why it \
                 found no bound",
                named(module)
            )
        }
        CommandError::TransactionOpen => {
            write!(
                f,
                "a transaction is open already: COMMIT or ABORT ends it (`commit`, `abort` at a device)"
            )
        }
        CommandError::FaultReaction => {
            write!(f, "the device is on its way to its safe value: reset it when it is there")
        }
        CommandError::RunsEveryTick(module) => {
            write!(
                f,
                "{} is an end of a link and runs in every tick: set EVERY_TICKS to 1; CTX_EVERY and CRX_EVERY say how \
                 often a link sends",
                named(module)
            )
        }
        CommandError::Law(refusal) => write!(f, "{refusal}"),
        CommandError::NoLaw(module) => {
            write!(
                f,
                "{} has no law: set PROGRAM to the number of one that was uploaded (`law list` at a device)",
                named(module)
            )
        }
        CommandError::NoTransaction => {
            write!(f, "no transaction is open: BEGIN opens one (`begin` at a device)")
        }
        CommandError::PacketTooLong { words } => {
            write!(
                f,
                "the channel's packets have {words} words and {MAX_PACKET_WORDS} fit: add fewer types to it, or leave out \
                 the counters (CTX_COUNTERS OFF, CRX_COUNTERS OFF)"
            )
        }
        CommandError::WiringFull => {
            write!(
                f,
                "no more ports fit, or no more that commands have bound: unplug another module, or initialise one \
                 whose bindings are not needed (MOD_INIT in a scheme, `init` at a device)"
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
        (ParameterError::WrongKind, _) => write!(f, "the value is not of the kind this parameter takes"),
        (ParameterError::OutOfRange, _) => write!(
            f,
            "the value is out of range, or a link that this controller has not (a board has 0 and 1)"
        ),
        (ParameterError::ListFull, _) => {
            write!(f, "the channel carries {MAX_CHANNEL_TYPES} types already and takes no more")
        }
        (ParameterError::NoSuchEntry, Some(known)) => {
            write!(f, "no such axis: the device has {} of them, counted from 0", known.axes().len())
        }
        (ParameterError::NoSuchEntry, None) => {
            write!(
                f,
                "the parameter has no such entry: entries count from 0, and some have one value for all axes"
            )
        }
        (ParameterError::WhilePluggedIn, _) => {
            write!(
                f,
                "this parameter decides ports or memory: unplug the module first (MOD_OFF in a scheme, `off` at a \
                 device)"
            )
        }
        (ParameterError::Imprecise { percent }, _) => {
            write!(
                f,
                "as f32 these coefficients may be off by {percent} % at 0 Hz: use LOWPASS_MOD, or a larger EVERY_TICKS"
            )
        }
        (ParameterError::NeedsCounters, _) => {
            write!(
                f,
                "STALE LIMITED and INTEGRAL need CRX_COUNTERS ON, and CTX_COUNTERS ON on the other side"
            )
        }
    }
}

/// Where no names are known. Not an engine: an image would have all modules' code once more.
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

    fn parameter_text(&self, _: KindId, _: u8) -> Option<ParameterText<'_>> {
        match *self {}
    }

    fn port_text(&self, _: ModuleRef, _: u8) -> Option<PortText<'_>> {
        match *self {}
    }

    fn type_text(&self, _: u16) -> Option<DataTypeText<'_>> {
        match *self {}
    }
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, *self, None::<&Unnamed>)
    }
}
