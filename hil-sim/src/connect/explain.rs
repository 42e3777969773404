//! A device's findings and refusals in its own words: what is wrong, where, what to do next.

use std::io::{Read, Write};

use dimsart_core::protocol::Blocked;
use dimsart_core::{
    CommandError, Difference, Finding, FrameError, ModuleRef, ParameterError, Party, TypeRef, UnitRelation,
};

use super::description::Parameter;
use super::{ConnectError, Device};

type Text = Result<String, ConnectError>;

impl<S: Read + Write> Device<S> {
    /// Whether the scheme commands the device, and if not, the first reason.
    pub(super) fn state_text(&mut self, blocked: Option<Blocked>) -> Text {
        Ok(match blocked {
            None => "the scheme runs and commands the device".to_owned(),
            Some(blocked) => format!("the device is NOT commanded: {}", self.blocked_text(blocked)?),
        })
    }

    pub(super) fn blocked_text(&mut self, blocked: Blocked) -> Text {
        Ok(match blocked {
            Blocked::Fault(finding) => self.finding_text(finding)?,
            Blocked::Stopped => "the scheme is stopped; `check` starts it if it matches".to_owned(),
            Blocked::Measurement(error) => {
                format!("its last measurement was refused: {}", self.frame_text(error)?)
            }
            Blocked::Command(error) => {
                format!("the scheme's last command to it was refused: {}", self.frame_text(error)?)
            }
            Blocked::Disarmed => {
                "the scheme runs and nobody holds the lease that motion needs; `arm` takes and holds it"
                    .to_owned()
            }
            Blocked::LinkLost { link } => format!(
                "nothing came over link {link} for the TIMEOUT_TICKS of its COMM_RXMOD; see to the other side and the \
                 line, then `reset`"
            ),
            other => format!("{other:?}"),
        })
    }

    fn frame_text(&mut self, error: FrameError) -> Text {
        Ok(match error {
            FrameError::NotFinite { signal, word } => format!(
                "word {word} of {} is not a finite number; see what writes it with `watch`",
                self.signal_name(signal)?
            ),
            FrameError::Length { .. } => format!("{error}; the image's board and descriptor differ"),
        })
    }

    pub(super) fn finding_text(&mut self, finding: Finding) -> Text {
        Ok(match finding {
            Finding::NoProvider { signal, reader } => {
                let (signal, reader) = (self.signal_name(signal)?, self.party(reader)?);
                format!(
                    "{reader} reads {signal} and nobody provides it: plug in a module that writes {signal}"
                )
            }
            Finding::TwoProviders { signal, first, second } => format!(
                "{} has two providers, {} and {}: unplug one or bind its port to another signal (PORT_... command)",
                self.signal_name(signal)?,
                self.party(first)?,
                self.party(second)?
            ),
            Finding::Mismatch { module, port, signal, difference } => {
                let port = self.port(module, port)?.map_or("?".to_owned(), |port| port.name);
                let difference = match difference {
                    Difference::Unit => format!("whose unit, {},", self.unit(signal.id)?),
                    Difference::Format => "whose format".to_owned(),
                    Difference::Shape => "whose shape".to_owned(),
                };
                format!(
                    "port {port} of {} is bound to {}, {difference} is not the port's: bind it to a signal that fits \
                     (PORT_{port} command)",
                    self.module_name(module)?,
                    self.signal_name(signal)?
                )
            }
            Finding::Delay { signal, writer, reader, is_declared } => format!(
                "{} reads {} before {} writes it, so it sees the last tick's value{}",
                self.party(reader)?,
                self.signal_name(signal)?,
                self.party(writer)?,
                match is_declared {
                    true => " (as declared)",
                    false if writer == reader => {
                        ": no order changes that; bind one of its two ports to another signal (PORT_... command)"
                    }
                    false => ": plug in the writer first",
                }
            ),
            Finding::UnitsDiffer { module, port, signal, other_port, other_signal, relation } => {
                let expected = match relation {
                    UnitRelation::Same => "the same unit as",
                    UnitRelation::Integral => "the unit, times s, of",
                    UnitRelation::Derivative => "the unit, over s, of",
                };
                format!(
                    "{} has {} and {}, but the second must have {expected} the first: bind one of them to a signal \
                     that fits (PORT_... command)",
                    self.module_name(module)?,
                    self.bound_port(module, other_port, other_signal)?,
                    self.bound_port(module, port, signal)?,
                )
            }
            Finding::LinkTaken { link, first, second } => format!(
                "{} and {} are both at the same end of link {link} and take the packets from each other: \
                 give one of them another link or unplug it",
                self.module_name(first)?,
                self.module_name(second)?
            ),
            other => format!("{other:?}"),
        })
    }

    fn bound_port(&mut self, module: ModuleRef, port: u8, signal: TypeRef) -> Text {
        let port = self.port(module, port)?.map_or("?".to_owned(), |port| port.name);
        Ok(format!("{port} bound to {} ({})", self.signal_name(signal)?, self.unit(signal.id)?))
    }

    fn party(&mut self, party: Party) -> Text {
        match party {
            Party::Frame => Ok(format!("the device {}", self.identity().device)),
            Party::Module(module) => self.module_name(module),
        }
    }

    /// Why a command was refused; `parameter` is the one that it was for.
    pub(super) fn refusal_text(&mut self, error: CommandError, parameter: Option<&Parameter>) -> Text {
        Ok(match error {
            CommandError::PluggedIn(module) => {
                let module = self.module_name(module)?;
                format!("{module} is plugged in: unplug it first (`off {module}`)")
            }
            CommandError::NotPluggedIn(module) => {
                let module = self.module_name(module)?;
                format!("{module} is not plugged in: plug it in first (`on {module}`)")
            }
            CommandError::WouldBreak(finding) => {
                format!("the scheme is running and this would break it: {}", self.finding_text(finding)?)
            }
            CommandError::DoesNotMatch { faults } => {
                format!("the scheme does not match, it has {faults} fault(s); `faults` names them")
            }
            CommandError::TooSlow { module, cycles, tick_cycles, limit_cycles } => {
                let module = self.module_name(module)?;
                format!(
                    "{module} takes up to {cycles} cycles and a tick with it up to {tick_cycles}, but on this device a \
                     tick may take {limit_cycles}: unplug another module first (`off MODULE`)"
                )
            }
            CommandError::CostUnknown(module) => {
                let module = self.module_name(module)?;
                format!(
                    "on this device a tick may take so long only, and the stamp of its image does not say what {module} \
                     takes: `dimsart stamp IMAGE` says why it found no bound; flash the image again when it does"
                )
            }
            CommandError::Parameter(ParameterError::OutOfRange) => match parameter {
                Some(parameter) => {
                    let unit = parameter.units.on(&self.identity().axes);
                    format!("out of range: {} takes {} {unit}", parameter.name, parameter.range)
                        .trim_end()
                        .to_owned()
                }
                None => error.to_string(),
            },
            other => other.to_string(),
        })
    }
}
