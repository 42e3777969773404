//! Findings and refusals in words: what is wrong, where, and what to do next.

mod refusal;

use core::fmt;

use crate::engine::{Engine, FaultCause, ModuleFault};
use crate::module::{Difference, ModuleRef};
use crate::scheme::{CommandError, Finding, Party};
use crate::signal::{TypeRef, UnitRelation};
use crate::vocabulary::Vocabulary;

/// A sentence about a controller, with the names of its [`Vocabulary`].
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
    /// A finding of this engine's check as a sentence.
    #[must_use]
    pub fn explain(&self, finding: Finding) -> Explanation<'_, Self> {
        Explanation::of_finding(self, finding)
    }

    /// Why a module was cut out, as a sentence.
    #[must_use]
    pub fn explain_module_fault(&self, fault: ModuleFault) -> Explanation<'_, Self> {
        Explanation::of_module_fault(self, fault)
    }
}

impl<'a, V: Vocabulary + ?Sized> Explanation<'a, V> {
    /// What the matching check found.
    #[must_use]
    pub fn of_finding(known: &'a V, finding: Finding) -> Self {
        Self { known, subject: Subject::Finding(finding) }
    }

    /// Why a command was refused.
    #[must_use]
    pub fn of_refusal(known: &'a V, error: CommandError) -> Self {
        Self { known, subject: Subject::Refusal(error) }
    }

    /// Why a module was cut out.
    #[must_use]
    pub fn of_module_fault(known: &'a V, fault: ModuleFault) -> Self {
        Self { known, subject: Subject::Module(fault) }
    }

    fn module_fault(&self, f: &mut fmt::Formatter<'_>, fault: ModuleFault) -> fmt::Result {
        let ModuleFault { module, cause } = fault;
        write!(f, "{} ", self.known.name_of_module(module))?;
        let next_step = match cause {
            FaultCause::Wrote { signal, word, bits } => {
                let value = f32::from_bits(bits);
                write!(f, "wrote {value} to word {word} of {}, ", self.known.name_of_signal(signal))?;
                let unit = self.known.type_of(signal).map(|found| found.unit);
                match unit.filter(|_| value.is_finite()) {
                    None => write!(f, "which is no finite number")?,
                    Some(unit) => {
                        write!(f, "which is beyond {:e}, the most that it can be", unit.largest())?;
                    }
                }
                "lower its gains or see to what it reads"
            }
            FaultCause::TookTooLong { budget_cycles } => {
                write!(f, "took longer than the {budget_cycles} cycles that a call of it may")?;
                "stamp the image anew (`dimsart stamp`), or see what interrupts the tick"
            }
        };
        write!(f, ": it is cut out with all that depends on it; {next_step}, then `reset`")
    }

    fn finding(&self, f: &mut fmt::Formatter<'_>, finding: Finding) -> fmt::Result {
        let known = self.known;
        match finding {
            Finding::NoProvider { signal, reader } => {
                let signal = known.name_of_signal(signal);
                self.party(f, reader)?;
                write!(f, " reads {signal} and nobody provides it: plug in a module that writes {signal}")
            }
            Finding::TwoProviders { signal, first, second } => {
                write!(f, "{} has two providers, ", known.name_of_signal(signal))?;
                self.party(f, first)?;
                write!(f, " and ")?;
                self.party(f, second)?;
                write!(f, ": unplug one or bind its port to another signal (PORT_... command)")
            }
            Finding::Mismatch { module, port, signal, difference } => {
                let port = self.port_name(module, port);
                let bound = known.name_of_signal(signal);
                write!(f, "port {port} of {} is bound to {bound}, ", known.name_of_module(module))?;
                self.difference(f, signal, difference)?;
                let kind = known.name_of_module(ModuleRef { number: 1, ..module });
                write!(f, ": bind it to a signal that fits (PORT_{port} command); ")?;
                write!(f, "`dimsart modules {kind}` shows what does")
            }
            Finding::Delay { signal, writer, reader, is_declared } => {
                self.party(f, reader)?;
                write!(f, " reads {} before ", known.name_of_signal(signal))?;
                self.party(f, writer)?;
                write!(f, " writes it, so it sees the last tick's value")?;
                if is_declared {
                    write!(f, " (declared)")
                } else if writer == reader {
                    write!(
                        f,
                        ": no order changes that; bind one of its two ports to another signal (PORT_... command)"
                    )
                } else {
                    write!(f, ": plug in the writer first")
                }
            }
            Finding::UnitsDiffer { module, port, signal, other_port, other_signal, relation } => {
                write!(f, "{} has ", known.name_of_module(module))?;
                self.bound_port(f, module, other_port, other_signal)?;
                write!(f, " and ")?;
                self.bound_port(f, module, port, signal)?;
                let expected = match relation {
                    UnitRelation::Same => "the same unit as",
                    UnitRelation::Integral => "the unit, times s, of",
                    UnitRelation::Derivative => "the unit, over s, of",
                    UnitRelation::Alike => "the same unit, format and shape as",
                };
                write!(f, ", but the second must have {expected} the first: ")?;
                write!(f, "bind one of them to a signal that fits (PORT_... command)")
            }
            Finding::Held { signal, writer, every_ticks } => {
                let (writer, signal) = (known.name_of_module(writer), known.name_of_signal(signal));
                write!(f, "{writer} writes {signal} in one of {every_ticks} ticks: it is up to ")?;
                write!(f, "{} ticks old where it is read", every_ticks.saturating_sub(1))
            }
            Finding::NotDelayed { signal, writer, reader } => {
                let [writer, reader] = [writer, reader].map(|module| known.name_of_module(module));
                let signal = known.name_of_signal(signal);
                write!(
                    f,
                    "{reader} computes with {signal} of the last tick, but {writer} writes it before: "
                )?;
                write!(f, "plug in {reader} before {writer}")
            }
            Finding::LateStageWaits { reader, writer, every_ticks } => {
                let [writer, reader] = [writer, reader].map(|module| known.name_of_module(module));
                write!(f, "{reader} needs {writer} in each of its ticks, but {writer} runs in one of ")?;
                write!(f, "{every_ticks} ticks: set EVERY_TICKS of {reader} to {every_ticks} or a multiple")
            }
            Finding::LinkTaken { link, first, second } => {
                let [first, second] = [first, second].map(|module| known.name_of_module(module));
                write!(
                    f,
                    "{first} and {second} are both at the same end of link {link} and take the packets "
                )?;
                write!(f, "from each other: give one of them another link or unplug it")
            }
        }
    }

    fn port_name(&self, module: ModuleRef, port: u8) -> &'a str {
        self.known.port_text(module, port).map_or("?", |port| port.name)
    }

    fn party(&self, f: &mut fmt::Formatter<'_>, party: Party) -> fmt::Result {
        match party {
            Party::Frame => write!(f, "the device {}", self.known.device_name()),
            Party::Module(module) => write!(f, "{}", self.known.name_of_module(module)),
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
        write!(f, "{port} bound to {}", self.known.name_of_signal(signal))?;
        match self.known.type_of(signal).map(|found| found.unit.on(self.known.axes())) {
            Some(unit) if !unit.is_empty() => write!(f, " ({unit})"),
            _ => Ok(()),
        }
    }

    fn difference(&self, f: &mut fmt::Formatter<'_>, signal: TypeRef, difference: Difference) -> fmt::Result {
        let Some(found) = self.known.type_of(signal) else {
            return write!(f, "which does not exist");
        };
        match difference {
            Difference::Unit => write!(f, "which has another unit, {}", found.unit.on(self.known.axes())),
            Difference::Format => write!(f, "which has another format, {:?}", found.format),
            Difference::Shape => write!(f, "which has another shape, {:?}", found.shape),
            Difference::Coordinates if found.unit.cartesian().is_some() => {
                write!(f, "which is of joints, where other ports of the module are Cartesian")
            }
            Difference::Coordinates => {
                write!(f, "which is Cartesian, where other ports of the module are of joints")
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
