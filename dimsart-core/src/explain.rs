//! Findings in words: what is wrong, where, and what to do next.

use core::fmt;

use crate::engine::Engine;
use crate::matching::{Difference, Finding, Party};
use crate::module::ModuleList;

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
                write!(f, ": bind it to a signal that fits (PORT_{port} command)")
            }
            Finding::Delay { signal, writer, reader, is_declared } => {
                self.party(f, reader)?;
                write!(f, " reads {} before ", device.signal_name(signal))?;
                self.party(f, writer)?;
                write!(f, " writes it, so it sees the last tick's value")?;
                if is_declared {
                    write!(f, " (as declared)")
                } else {
                    write!(f, ": plug in the writer first")
                }
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

    fn difference(
        &self,
        f: &mut fmt::Formatter<'_>,
        signal: crate::data_type::TypeRef,
        difference: Difference,
    ) -> fmt::Result {
        let device = self.engine.device();
        let Some(found) = device.data_type(signal.id) else {
            return write!(f, "which does not exist");
        };
        let axis = device.axes().first().copied().unwrap_or_default();
        match difference {
            Difference::Unit => {
                write!(f, "whose unit, {}, is not the port's", found.unit.symbol(axis))
            }
            Difference::Format => write!(f, "whose format, {:?}, is not the port's", found.format),
            Difference::Shape => write!(f, "whose shape, {:?}, is not the port's", found.shape),
        }
    }
}
