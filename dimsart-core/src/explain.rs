//! Findings in words: what is wrong, where, and what to do next.

use core::fmt;

use crate::command::ModuleRef;
use crate::data_type::TypeRef;
use crate::engine::Engine;
use crate::kind::ModuleList;
use crate::matching::{Finding, Party};
use crate::port::Difference;
use crate::unit_tie::UnitRelation;

/// Prints a finding with its names; see [`Engine::explain`].
#[derive(Debug)]
pub struct Explanation<'a, M, const WORDS: usize> {
    engine: &'a Engine<M, WORDS>,
    finding: Finding,
}

impl<M: ModuleList, const WORDS: usize> Engine<M, WORDS> {
    /// A finding of this engine's check as a sentence.
    #[must_use]
    pub fn explain(&self, finding: Finding) -> Explanation<'_, M, WORDS> {
        Explanation { engine: self, finding }
    }
}

impl<M: ModuleList, const WORDS: usize> fmt::Display for Explanation<'_, M, WORDS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let device = self.engine.device();
        match self.finding {
            Finding::NoProvider { signal, reader } => {
                let signal = device.signal_name(signal);
                self.party(f, reader)?;
                write!(f, " reads {signal} and nobody provides it: plug in a module that writes {signal}")
            }
            Finding::TwoProviders { signal, first, second } => {
                write!(f, "{} has two providers, ", device.signal_name(signal))?;
                self.party(f, first)?;
                write!(f, " and ")?;
                self.party(f, second)?;
                write!(f, ": unplug one or bind its port to another signal (PORT_... command)")
            }
            Finding::Mismatch { module, port, signal, difference } => {
                let port = self.engine.port_name(module, port).unwrap_or("?");
                write!(
                    f,
                    "port {port} of {} is bound to {}, ",
                    Engine::<M, WORDS>::module_name(module),
                    device.signal_name(signal)
                )?;
                self.difference(f, signal, difference)?;
                write!(f, ": bind it to a signal that fits")
            }
            Finding::Delay { signal, writer, reader, is_declared } => {
                self.party(f, reader)?;
                write!(f, " reads {} before ", device.signal_name(signal))?;
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
                write!(f, "{} has ", Engine::<M, WORDS>::module_name(module))?;
                self.bound_port(f, module, other_port, other_signal)?;
                write!(f, " and ")?;
                self.bound_port(f, module, port, signal)?;
                let expected = match relation {
                    UnitRelation::Same => "the same unit as",
                    UnitRelation::Integral => "the unit, times s, of",
                    UnitRelation::Derivative => "the unit, over s, of",
                };
                write!(f, ", but the second must have {expected} the first: ")?;
                write!(f, "bind one of them to a signal that fits (PORT_... command)")
            }
            Finding::LinkTaken { link, first, second } => {
                let [first, second] = [first, second].map(Engine::<M, WORDS>::module_name);
                write!(
                    f,
                    "{first} and {second} are both at the same end of link {link} and take the packets "
                )?;
                write!(f, "from each other: give one of them another link or unplug it")
            }
        }
    }
}

impl<M: ModuleList, const WORDS: usize> Explanation<'_, M, WORDS> {
    fn party(&self, f: &mut fmt::Formatter<'_>, party: Party) -> fmt::Result {
        match party {
            Party::Frame => write!(f, "the device {}", self.engine.device().name()),
            Party::Module(module) => write!(f, "{}", Engine::<M, WORDS>::module_name(module)),
        }
    }

    fn bound_port(
        &self,
        f: &mut fmt::Formatter<'_>,
        module: ModuleRef,
        port: u8,
        signal: TypeRef,
    ) -> fmt::Result {
        let device = self.engine.device();
        let port = self.engine.port_name(module, port).unwrap_or("?");
        let axis = device.axes().first().copied().unwrap_or_default();
        let unit = device.data_type(signal.id).map_or("?", |found| found.unit.symbol(axis));
        write!(f, "{port} bound to {}", device.signal_name(signal))?;
        if unit.is_empty() { Ok(()) } else { write!(f, " ({unit})") }
    }

    fn difference(&self, f: &mut fmt::Formatter<'_>, signal: TypeRef, difference: Difference) -> fmt::Result {
        let device = self.engine.device();
        let Some(found) = device.data_type(signal.id) else {
            return write!(f, "which does not exist");
        };
        let axis = device.axes().first().copied().unwrap_or_default();
        match difference {
            Difference::Unit => {
                write!(f, "which has another unit, {}", found.unit.symbol(axis))
            }
            Difference::Format => write!(f, "which has another format, {:?}", found.format),
            Difference::Shape => write!(f, "which has another shape, {:?}", found.shape),
        }
    }
}
