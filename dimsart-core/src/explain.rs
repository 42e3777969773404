//! Texts of findings, refusals and module faults: what is wrong, where, and what to do.

mod refusal;

use core::fmt;

use crate::engine::{Engine, FaultCause, ModuleFault};
use crate::module::{ModuleRef, TypeMismatch};
use crate::scheme::{CommandError, Endpoint, Finding};
use crate::signal::{TypeRef, UnitRelation};
use crate::vocabulary::Vocabulary;

/// A message about a controller, with the names of its [`Vocabulary`].
#[derive(Debug, Clone, Copy)]
pub struct Explanation<'a, V: ?Sized> {
    known: &'a V,
    subject: Subject,
}

#[derive(Debug, Clone, Copy)]
enum Subject {
    Finding(Finding),
    Refusal(CommandError),
    Module(ModuleFault),
}

impl Engine {
    /// Returns the text of a finding of this engine's check.
    #[must_use]
    pub fn explain(&self, finding: Finding) -> Explanation<'_, Self> {
        Explanation::for_finding(self, finding)
    }

    /// Returns the text of a module fault.
    #[must_use]
    pub fn explain_module_fault(&self, fault: ModuleFault) -> Explanation<'_, Self> {
        Explanation::for_module_fault(self, fault)
    }
}

impl<'a, V: Vocabulary + ?Sized> Explanation<'a, V> {
    /// Creates the text of a finding of the matching check.
    #[must_use]
    pub fn for_finding(known: &'a V, finding: Finding) -> Self {
        Self { known, subject: Subject::Finding(finding) }
    }

    /// Creates the text of a refused command.
    #[must_use]
    pub fn for_refusal(known: &'a V, error: CommandError) -> Self {
        Self { known, subject: Subject::Refusal(error) }
    }

    /// Creates the text of a module fault.
    #[must_use]
    pub fn for_module_fault(known: &'a V, fault: ModuleFault) -> Self {
        Self { known, subject: Subject::Module(fault) }
    }

    fn module_fault(&self, f: &mut fmt::Formatter<'_>, fault: ModuleFault) -> fmt::Result {
        let ModuleFault { module, cause } = fault;
        write!(f, "{} ", self.known.module_name(module))?;
        let remedy = match cause {
            FaultCause::InvalidOutput { signal, word, bits } => {
                let value = f32::from_bits(bits);
                write!(f, "wrote {value} to word {word} of {}", self.known.signal_name(signal))?;
                let unit = self.known.type_of(signal).map(|found| found.unit);
                if let Some(unit) = unit.filter(|_| value.is_finite()) {
                    write!(f, " (limit {:e})", unit.max_magnitude())?;
                }
                "lower the module's gains or check its inputs"
            }
            FaultCause::TimeExceeded { budget_cycles } => {
                write!(f, "exceeded its budget of {budget_cycles} cycles per call")?;
                "run `dimsart stamp` again, or shorten the interrupts"
            }
        };
        write!(f, ": isolated with the modules that depend on it; {remedy}, then `reset`")
    }

    fn finding(&self, f: &mut fmt::Formatter<'_>, finding: Finding) -> fmt::Result {
        let known = self.known;
        match finding {
            Finding::NoWriter { signal, reader } => {
                let signal = known.signal_name(signal);
                self.party(f, reader)?;
                write!(f, " reads {signal}, which has no provider: plug in a module that writes {signal}")
            }
            Finding::MultipleWriters { signal, first, second } => {
                write!(f, "{} has two providers, ", known.signal_name(signal))?;
                self.party(f, first)?;
                write!(f, " and ")?;
                self.party(f, second)?;
                write!(f, ": unplug one of the two, or bind its port to another signal (PORT_... command)")
            }
            Finding::Mismatch { module, port, signal, mismatch } => {
                let port = self.port_name(module, port);
                let bound = known.signal_name(signal);
                write!(f, "port {port} of {} is bound to {bound}, ", known.module_name(module))?;
                self.difference(f, signal, mismatch)?;
                let kind = known.module_name(ModuleRef { number: 1, ..module });
                write!(f, ": bind the port to a compatible signal (PORT_{port} command); ")?;
                write!(f, "`dimsart modules {kind}` shows the ports")
            }
            Finding::Delay { signal, writer, reader, is_declared } => {
                self.party(f, reader)?;
                write!(f, " reads {} before ", known.signal_name(signal))?;
                self.party(f, writer)?;
                write!(f, " writes it, so the value is one tick old")?;
                if is_declared {
                    write!(f, " (declared)")
                } else if writer == reader {
                    write!(f, ": bind one of the module's ports to another signal (PORT_... command)")
                } else {
                    write!(f, ": plug in the writer first")
                }
            }
            Finding::UnitsDiffer { module, port, signal, other_port, other_signal, relation } => {
                write!(f, "{} has ", known.module_name(module))?;
                self.bound_port(f, module, other_port, other_signal)?;
                write!(f, " and ")?;
                self.bound_port(f, module, port, signal)?;
                let expected = match relation {
                    UnitRelation::Same => "the unit of the first",
                    UnitRelation::Integral => "the unit of the first times s",
                    UnitRelation::Derivative => "the unit of the first divided by s",
                    UnitRelation::SameType => "the unit, format and shape of the first",
                };
                write!(f, ", but the second port must have {expected}: ")?;
                write!(f, "bind one of these ports to a compatible signal (PORT_... command)")
            }
            Finding::SlowWriter { signal, writer, every_ticks } => {
                let (writer, signal) = (known.module_name(writer), known.signal_name(signal));
                write!(f, "{writer} writes {signal} every {every_ticks} ticks: readers get values up to ")?;
                write!(f, "{} ticks old", every_ticks.saturating_sub(1))
            }
            Finding::MissingDelay { signal, writer, reader } => {
                let [writer, reader] = [writer, reader].map(|module| known.module_name(module));
                let signal = known.signal_name(signal);
                write!(f, "{reader} needs the last tick's {signal}, but {writer} overwrites it first: ")?;
                write!(f, "plug in {reader} before {writer}")
            }
            Finding::LateStageRate { reader, writer, every_ticks } => {
                let [writer, reader] = [writer, reader].map(|module| known.module_name(module));
                write!(f, "{reader} needs a new value from {writer} at every run, but {writer} runs every ")?;
                write!(f, "{every_ticks} ticks: set EVERY_TICKS of {reader} to a multiple of {every_ticks}")
            }
            Finding::DuplicateLinkEnd { link, first, second } => {
                let [first, second] = [first, second].map(|module| known.module_name(module));
                write!(f, "{first} and {second} use the same end of link {link}: ")?;
                write!(f, "set another link for one of the two, or unplug one")
            }
        }
    }

    fn port_name(&self, module: ModuleRef, port: u8) -> &'a str {
        self.known.port_text(module, port).map_or("?", |port| port.name)
    }

    fn party(&self, f: &mut fmt::Formatter<'_>, party: Endpoint) -> fmt::Result {
        match party {
            Endpoint::Frame => write!(f, "the device {}", self.known.device_name()),
            Endpoint::Module(module) => write!(f, "{}", self.known.module_name(module)),
        }
    }

    fn bound_port(
        &self,
        f: &mut fmt::Formatter<'_>,
        module: ModuleRef,
        port: u8,
        signal: TypeRef,
    ) -> fmt::Result {
        let port = self.port_name(module, port);
        write!(f, "{port} bound to {}", self.known.signal_name(signal))?;
        match self.known.type_of(signal).map(|found| found.unit.for_axes(self.known.axes())) {
            Some(unit) if !unit.is_empty() => write!(f, " ({unit})"),
            _ => Ok(()),
        }
    }

    fn difference(
        &self,
        f: &mut fmt::Formatter<'_>,
        signal: TypeRef,
        difference: TypeMismatch,
    ) -> fmt::Result {
        let Some(found) = self.known.type_of(signal) else {
            return write!(f, "which does not exist");
        };
        match difference {
            TypeMismatch::Unit => {
                write!(f, "which has the wrong unit, {}", found.unit.for_axes(self.known.axes()))
            }
            TypeMismatch::Format => write!(f, "which has the wrong format, {:?}", found.format),
            TypeMismatch::Shape => write!(f, "which has the wrong shape, {:?}", found.shape),
            TypeMismatch::Coordinates if found.unit.cartesian().is_some() => {
                write!(f, "which is in joint coordinates, but other ports of the module are Cartesian")
            }
            TypeMismatch::Coordinates => {
                write!(f, "which is Cartesian, but other ports of the module use joint coordinates")
            }
        }
    }
}

impl<V: Vocabulary + ?Sized> fmt::Display for Explanation<'_, V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.subject {
            Subject::Finding(finding) => self.finding(f, finding),
            Subject::Refusal(error) => refusal::write(f, error, Some(self.known)),
            Subject::Module(fault) => self.module_fault(f, fault),
        }
    }
}
