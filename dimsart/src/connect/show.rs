//! Complete state of a device.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::scheme::{PORT_PREFIX, SWITCH};
use dimsart_core::{
    CommandError, Direction, EVERY_TICKS, KindId, ModuleRef, ParameterError, ParameterShape,
    ParameterTypeDescription, PortDescription, Usage, Vocabulary,
};
use dimsart_link::protocol::{InstanceDescription, LeaseStatus, NO_CLIENT, Refusal, Request, Response};
use serde::Serialize;

use super::data_types::SignalForm;
use super::description::{DisplayValue, Identity, axis_name, joined, range_text};
use super::device::take;
use super::faults::FirstFaultReport;
use super::key::KeyReport;
use super::signals::SignalReport;
use super::stored_schemes::{StoredSchemesReport, TickTimingReport, known};
use super::{ConnectError, Device};

const EMPTY_LIST: CommandError = CommandError::Parameter(ParameterError::Unknown);

/// A parameter and its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// Name, with the index if one entry was requested.
    pub name: String,
    /// One value, or one per axis; the last entry of a list.
    pub values: Vec<DisplayValue>,
    /// Columns of a matrix; otherwise the number of values.
    #[serde(skip)]
    pub columns: usize,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Range.
    pub range: String,
    /// Help text.
    pub summary: String,
    /// Default of each entry; `None` for a list, which is empty by default.
    pub default: Option<DisplayValue>,
    /// Permitted names; empty if the value is not a name.
    pub choices: Vec<String>,
    /// Whether it can be set only while the module is unplugged.
    pub is_structural: bool,
}

/// A kind of module.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ModuleKindReport {
    /// Name.
    pub name: String,
    /// Help text; empty for a kind that is unknown to this program.
    pub summary: String,
}

/// A port that reads or writes a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PortReport {
    /// Name for `set`, such as `PORT_FORCE`.
    pub name: String,
    /// Whether it writes.
    pub writes: bool,
    /// The signal it is bound to.
    pub signal: String,
    /// Unit and shape of its signals.
    #[serde(flatten)]
    pub form: SignalForm,
}

impl ParameterReport {
    /// Values and unit.
    pub(super) fn values_text(&self) -> String {
        format!("{} {}", joined(&self.values), self.unit).trim_end().to_owned()
    }

    /// Values and unit, one line per row of a matrix; further rows are indented.
    fn rows_text(&self, indent: usize) -> String {
        let rows: Vec<_> = self.values.chunks(self.columns.max(1)).map(joined).collect();
        format!("{} {}", rows.join(&format!("\n{:indent$}", "")), self.unit).trim_end().to_owned()
    }
}

impl fmt::Display for ParameterReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let values = self.rows_text(self.name.len() + 3);
        write!(f, "{} = {values}   ({}) {}", self.name, self.range, self.summary)
    }
}

/// A module instance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstanceReport {
    /// Name.
    pub name: String,
    /// Position in the plug-in order, from 1; `None` while it is not plugged in.
    pub place: Option<u16>,
    /// Signals it reads.
    pub reads: Vec<String>,
    /// Signals it writes.
    pub writes: Vec<String>,
    /// Its ports, in their order.
    pub ports: Vec<PortReport>,
    /// Parameters.
    pub parameters: Vec<ParameterReport>,
}

impl fmt::Display for InstanceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(place) => write!(f, "{place:>3} {}", self.name)?,
            None => write!(f, "  - {}, not plugged in", self.name)?,
        }
        for (verb, signals) in [("reads", &self.reads), ("writes", &self.writes)] {
            if !signals.is_empty() {
                write!(f, "  {verb} {}", signals.join(", "))?;
            }
        }
        for parameter in &self.parameters {
            write!(f, "\n      {:<14} {}", parameter.name, parameter.rows_text(21))?;
        }
        Ok(())
    }
}

/// Status of a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StatusReport {
    /// Ticks since the start.
    pub ticks: u64,
    /// Ticks with a refused frame.
    pub refused_ticks: u32,
    /// Whether the scheme passed its check and runs.
    pub is_running: bool,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
    /// Whether a transaction is open: modules, ports and parameters belong to the pending scheme.
    pub is_in_transaction: bool,
    /// The first tick that was refused.
    pub first_fault: Option<FirstFaultReport>,
    /// CiA 402 state of the drive.
    pub drive: &'static str,
    /// Why modules are isolated, if any, including modules that the device does not depend on.
    pub cut_out: Option<String>,
    /// Usage of static memory.
    pub usage: Usage,
    /// Timing of the ticks; `None` on a device that does not measure it.
    pub timing: Option<TickTimingReport>,
    /// Stored schemes; `None` on a device without storage.
    pub schemes: Option<StoredSchemesReport>,
    /// Lease; `None` on a device without one.
    pub lease: Option<LeaseStatus>,
    /// Key state; `None` if the image has no authentication.
    pub key: Option<KeyReport>,
}

/// Complete state of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Overview {
    /// Identity.
    pub identity: Identity,
    /// Status.
    pub status: StatusReport,
    /// Modules: first the plugged-in ones in their order.
    pub modules: Vec<InstanceReport>,
    /// Signals in the Data Base.
    pub signals: Vec<SignalReport>,
    /// Names of the measured signals.
    pub measured: Vec<String>,
    /// Names of the command signals.
    pub taken: Vec<String>,
}

impl fmt::Display for Overview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { identity, status, modules, signals, .. } = self;
        let axes: Vec<_> = identity.axes.iter().map(|axis| axis_name(*axis)).collect();
        writeln!(f, "{}, image {}, protocol {}", identity.device, identity.image, identity.protocol_version)?;
        writeln!(
            f,
            "{} axes ({}), a tick every {} s",
            axes.len(),
            axes.join(", "),
            identity.sample_period_s
        )?;
        writeln!(f, "{}; drive: {}", status.state, status.drive)?;
        if let Some(cut_out) = &status.cut_out {
            writeln!(f, "{cut_out}")?;
        }
        if status.is_in_transaction {
            writeln!(
                f,
                "transaction open: the modules below belong to the pending scheme; run `commit` to apply it"
            )?;
        }
        write!(f, "{} of {} ticks refused", status.refused_ticks, status.ticks)?;
        if let Some(FirstFaultReport { tick, reason }) = &status.first_fault {
            write!(f, "; first in tick {tick}: {reason}")?;
        }
        let Usage { modules: count, slots, words, total_words } = status.usage;
        writeln!(f, "\nmemory: {count} modules, {slots} slots, {words} of {total_words} words")?;
        match &status.lease {
            None => {}
            Some(LeaseStatus { holder: NO_CLIENT, .. }) => writeln!(f, "no client holds the lease")?,
            Some(LeaseStatus { holder, ticks_left }) => {
                writeln!(
                    f,
                    "client {holder} holds the lease, which expires in {ticks_left} ticks without renewal"
                )?;
            }
        }
        if let Some(key) = &status.key {
            writeln!(f, "{key}")?;
        }
        if let Some(timing) = &status.timing {
            writeln!(f, "{timing}")?;
        }
        if let Some(schemes) = &status.schemes {
            writeln!(f, "{schemes}")?;
        }
        writeln!(f, "\nmodules{}", if modules.is_empty() { ": none" } else { "" })?;
        for module in modules {
            writeln!(f, "{module}")?;
        }
        write!(f, "\nsignals")?;
        for signal in signals {
            write!(f, "\n{signal}")?;
        }
        Ok(())
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the complete state.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn overview(&mut self) -> Result<Overview, ConnectError> {
        let status = self.status_report()?;
        let mut instances = self.instances()?;
        instances.sort_by_key(|instance| instance.place.unwrap_or(u8::MAX));
        let modules = instances.into_iter().map(|instance| self.instance_report(instance));
        let modules = modules.collect::<Result<_, _>>()?;
        let signals = self.signals(&[])?;
        let [measured, taken] = self.measured_and_commanded()?;
        Ok(Overview { identity: self.identity().clone(), status, modules, signals, measured, taken })
    }

    /// Reads the names of measured and command signals; empty on an older device.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn measured_and_commanded(&mut self) -> Result<[Vec<String>; 2], ConnectError> {
        let mut names = [Vec::new(), Vec::new()];
        for index in 0..=u8::MAX {
            let found = self.ask(&Request::DeviceType { index }, |response| match response {
                Response::DeviceType { signal, is_taken } => Some((signal, is_taken)),
                _ => None,
            });
            let Some((signal, is_taken)) = known(found)? else { break };
            let name = self.signal_name(signal)?;
            let [measured, taken] = &mut names;
            if is_taken { taken.push(name) } else { measured.push(name) }
        }
        Ok(names)
    }

    /// Lists the module kinds of the image with their help texts.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn kinds(&mut self) -> Result<Vec<ModuleKindReport>, ConnectError> {
        let (mut kinds, known) = (Vec::new(), self.known_kinds());
        let summary = |name: &str| known.kind(KindId::from_name(name)).map_or("", |kind| kind.summary.text());
        for place in 0..=u8::MAX {
            let found = self.ask(&Request::Module { place }, |response| match response {
                Response::Module(found) => Some(ModuleKindReport {
                    name: found.name.to_owned(),
                    summary: summary(found.name).to_owned(),
                }),
                _ => None,
            });
            match found {
                Ok(Some(found)) => kinds.push(found),
                Ok(None) | Err(ConnectError::Refused(_)) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(kinds)
    }

    /// Reads the status.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn status_report(&mut self) -> Result<StatusReport, ConnectError> {
        let status = self.status()?;
        let first_fault = self.first_fault_text(status.first_fault)?;
        Ok(StatusReport {
            ticks: status.ticks,
            refused_ticks: status.refused_ticks,
            is_running: status.is_running,
            state: self.state_text(status.blocked)?,
            is_in_transaction: status.is_in_transaction,
            first_fault,
            drive: status.state.name(),
            cut_out: status.module_fault.map(|fault| self.module_fault_text(fault)).transpose()?,
            usage: status.usage,
            timing: self.timing()?,
            schemes: self.stored_schemes()?,
            lease: self.lease_status()?,
            key: self.key_report()?,
        })
    }

    fn instance_report(&mut self, instance: InstanceDescription) -> Result<InstanceReport, ConnectError> {
        let InstanceDescription { module, place } = instance;
        let ports: Vec<PortReport> = self.know(|known| {
            let report = |port: PortDescription<'_>| PortReport {
                name: format!("{PORT_PREFIX}{}", port.name),
                writes: port.direction != Direction::Read,
                signal: port.bound.map(|signal| known.signal_name(signal).to_string()).unwrap_or_default(),
                form: port
                    .default
                    .and_then(|signal| known.type_of(signal))
                    .map(|data_type| SignalForm::of(&data_type, known.axes()))
                    .unwrap_or_default(),
            };
            known.port_texts(module).filter(|port| port.bound.is_some()).map(report).collect()
        })?;
        let signals = |writes: bool| {
            let wanted = ports.iter().filter(|port| port.writes == writes);
            wanted.map(|port| port.signal.clone()).collect::<Vec<_>>()
        };
        let (reads, writes) = (signals(false), signals(true));
        let count = self.know(|known| known.parameter_texts(module.kind).count())?;
        let parameters = (0..).take(count).map(|parameter| self.parameter_report(module, parameter, None));
        let mut parameters = parameters.collect::<Result<Vec<_>, _>>()?;
        if self.know(|known| known.parameter_text(module.kind, EVERY_TICKS).is_some())? {
            let rate = self.parameter_report(module, EVERY_TICKS, None)?;
            parameters.extend(Some(rate).filter(|rate| rate.values != [DisplayValue::Name("1".into())]));
        }
        let place = place.map(|place| u16::from(place) + 1);
        Ok(InstanceReport { name: self.module_name(module)?, place, reads, writes, ports, parameters })
    }

    /// Reads one entry of a parameter, or all entries.
    pub(super) fn parameter_report(
        &mut self,
        module: ModuleRef,
        parameter: u8,
        place: Option<u8>,
    ) -> Result<ParameterReport, ConnectError> {
        let (entries, is_list, dof) = self.know(|known| {
            let found = known.parameter_text(module.kind, parameter);
            let is_list = found.as_ref().is_some_and(|found| found.default.is_none());
            (found.map_or(ParameterShape::ONE, |found| found.entries), is_list, known.dof())
        })?;
        let places = match place {
            Some(place) => place..place.saturating_add(1),
            None => 0..entries.count(dof),
        };
        let mut values = Vec::new();
        for entry in places {
            let request = Request::Get { module, parameter, entry };
            match self.ask(&request, take!(Value)) {
                // An empty list has no last entry.
                Err(ConnectError::Refused(Refusal::Engine(EMPTY_LIST))) if is_list => {}
                value => values.push(value?.ok_or(ConnectError::UnexpectedAnswer)?),
            }
        }
        let (_, columns) = entries.size(dof);
        let indices = match place {
            Some(place) if entries.is_matrix() => format!("[{}][{}]", place / columns, place % columns),
            Some(place) => format!("[{place}]"),
            None => String::new(),
        };
        let report = self.know(|known| {
            let mut found = known.parameter_text(module.kind, parameter)?;
            if place.is_some() {
                found.entries = ParameterShape::ONE;
            }
            Some(ParameterReport {
                name: format!("{}{indices}", found.name),
                columns: if entries.is_matrix() { columns.into() } else { values.len() },
                values: values.iter().map(|value| known.value_text(*value, &found.accepts)).collect(),
                unit: match found.accepts {
                    ParameterTypeDescription::Types => String::new(),
                    _ => found.unit.for_axes(known.axes()).to_string(),
                },
                range: range_text(&found),
                summary: known.summary(module.kind, found.name).to_owned(),
                default: found.default.map(|value| known.value_text(value, &found.accepts)),
                choices: choices(&found.accepts),
                is_structural: found.is_structural,
            })
        })?;
        report.ok_or(ConnectError::UnexpectedAnswer)
    }
}

/// Returns the permitted names of a parameter.
fn choices(accepts: &ParameterTypeDescription<'_>) -> Vec<String> {
    match accepts {
        ParameterTypeDescription::Choice(names) => names.iter().map(|name| (*name).to_owned()).collect(),
        ParameterTypeDescription::Flag => SWITCH.iter().map(|name| (*name).to_owned()).collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_has_a_line_for_each_row() {
        let parameter = ParameterReport {
            name: "K".to_owned(),
            values: [1, 2, 3, 4].map(DisplayValue::Whole).to_vec(),
            columns: 2,
            unit: "N/m".to_owned(),
            range: "0 to 9, 2 × 2".to_owned(),
            summary: "Stiffness.".to_owned(),
            default: None,
            choices: Vec::new(),
            is_structural: false,
        };
        assert_eq!(parameter.to_string(), "K = 1  2\n    3  4 N/m   (0 to 9, 2 × 2) Stiffness.");
        assert_eq!(parameter.values_text(), "1  2  3  4 N/m");
        let columns = 4;
        let vector = ParameterReport { columns, ..parameter };
        assert_eq!(vector.rows_text(4), "1  2  3  4 N/m");
    }
}
