//! Everything that a device is at the moment.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::protocol::{InstanceText, LeaseStatus, NOBODY, Request, Response};
use dimsart_core::{Direction, ModuleRef, Usage};
use serde::Serialize;

use super::description::{Identity, Range, ValueText, axis_name, joined};
use super::device::take;
use super::faults::FirstFaultText;
use super::kept::{KeptReport, TimingText};
use super::key::KeyReport;
use super::signals::SignalReport;
use super::words::Named;
use super::{ConnectError, Device};

/// A parameter and its value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterReport {
    /// Name, with the axis if one was asked for.
    pub name: String,
    /// One value, or one for each axis; of a list, its last entry.
    pub values: Vec<ValueText>,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// What it takes.
    pub range: String,
    /// What it is for.
    pub summary: String,
}

impl ParameterReport {
    /// Values and unit.
    pub(super) fn values_text(&self) -> String {
        format!("{} {}", joined(&self.values), self.unit).trim_end().to_owned()
    }
}

impl fmt::Display for ParameterReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}   ({}) {}", self.name, self.values_text(), self.range, self.summary)
    }
}

/// A module that exists.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstanceReport {
    /// Name.
    pub name: String,
    /// Its place in the plug-in order, from 1; none while it is not plugged in.
    pub place: Option<u16>,
    /// Signals it reads.
    pub reads: Vec<String>,
    /// Signals it writes.
    pub writes: Vec<String>,
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
            write!(f, "\n      {:<14} {}", parameter.name, parameter.values_text())?;
        }
        Ok(())
    }
}

/// How the device is doing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StatusReport {
    /// Ticks since the start.
    pub ticks: u64,
    /// Those of them in which a frame was refused.
    pub refused_ticks: u32,
    /// Whether the scheme passed its check and runs.
    pub is_running: bool,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
    /// The first tick that was refused.
    pub first_fault: Option<FirstFaultText>,
    /// What is taken of the static storage.
    pub usage: Usage,
    /// How well the ticks keep their time; none on a device that cannot tell.
    pub timing: Option<TimingText>,
    /// Schemes that it keeps; none on a device that keeps none.
    pub schemes: Option<KeptReport>,
    /// Who may move it; none on a device that moves without a lease.
    pub lease: Option<LeaseStatus>,
    /// How it stands to keys; none where its image has no authentication.
    pub key: Option<KeyReport>,
}

/// Everything that a device is at the moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Overview {
    /// Who it is.
    pub identity: Identity,
    /// How it is doing.
    pub status: StatusReport,
    /// Its modules, those that are plugged in first and in their order.
    pub modules: Vec<InstanceReport>,
    /// What is in its Data Base.
    pub signals: Vec<SignalReport>,
}

impl fmt::Display for Overview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { identity, status, modules, signals } = self;
        let axes: Vec<_> = identity.axes.iter().map(|axis| axis_name(*axis)).collect();
        writeln!(f, "{}, image {}, protocol {}", identity.device, identity.image, identity.protocol_version)?;
        writeln!(
            f,
            "{} axes ({}), a tick every {} s",
            axes.len(),
            axes.join(", "),
            identity.sample_period_s
        )?;
        writeln!(f, "{}", status.state)?;
        write!(f, "{} of {} ticks refused", status.refused_ticks, status.ticks)?;
        if let Some(FirstFaultText { tick, reason }) = &status.first_fault {
            write!(f, "; the first trouble was in tick {tick}: {reason}")?;
        }
        let Usage { modules: count, slots, words, words_in_all } = status.usage;
        writeln!(f, "\ntakes {count} modules, {slots} slots, {words} of {words_in_all} words")?;
        match &status.lease {
            None => {}
            Some(LeaseStatus { holder: NOBODY, .. }) => writeln!(f, "nobody holds the lease")?,
            Some(LeaseStatus { holder, ticks_left }) => {
                writeln!(f, "client {holder} holds the lease, for {ticks_left} ticks unless it renews it")?;
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
    /// Asks for everything.
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
        Ok(Overview { identity: self.identity().clone(), status, modules, signals })
    }

    fn status_report(&mut self) -> Result<StatusReport, ConnectError> {
        let status = self.status()?;
        let first_fault = self.first_fault_text(status.first_fault)?;
        Ok(StatusReport {
            ticks: status.ticks,
            refused_ticks: status.refused_ticks,
            is_running: status.is_running,
            state: self.state_text(status.blocked)?,
            first_fault,
            usage: status.usage,
            timing: self.timing()?,
            schemes: self.kept()?,
            lease: self.lease_status()?,
            key: self.key_report()?,
        })
    }

    fn instance_report(&mut self, instance: InstanceText) -> Result<InstanceReport, ConnectError> {
        let InstanceText { module, place } = instance;
        let (mut reads, mut writes) = (Vec::new(), Vec::new());
        for port in self.ports(module)? {
            let Some(signal) = port.bound else { continue };
            let signals = if port.direction == Direction::Read { &mut reads } else { &mut writes };
            signals.push(self.signal_name(signal)?);
        }
        let mut parameters = Vec::new();
        for (index, parameter) in (0..).zip(self.parameters(module.kind)?) {
            parameters.push(self.parameter_report(module, &Named { index, axis: None, parameter })?);
        }
        let place = place.map(|place| u16::from(place) + 1);
        Ok(InstanceReport { name: self.module_name(module)?, place, reads, writes, parameters })
    }

    pub(super) fn parameter_report(
        &mut self,
        module: ModuleRef,
        named: &Named,
    ) -> Result<ParameterReport, ConnectError> {
        let Named { index, axis, parameter } = named;
        let dof = u8::try_from(self.identity().axes.len()).unwrap_or(u8::MAX);
        let axes = match axis {
            Some(axis) => *axis..axis.saturating_add(1),
            None => 0..if parameter.is_per_axis() { dof } else { 1 },
        };
        let mut values = Vec::new();
        for axis in axes {
            let request = Request::Get { module, parameter: *index, axis };
            let value = self.ask(&request, take!(Value))?.ok_or(ConnectError::OtherAnswer)?;
            values.push(self.value_text(value, &parameter.range)?);
        }
        let axis = axis.map(|axis| format!("[{axis}]")).unwrap_or_default();
        Ok(ParameterReport {
            name: format!("{}{axis}", parameter.name),
            values,
            unit: match parameter.range {
                Range::Types => String::new(),
                _ => parameter.units.on(&self.identity().axes),
            },
            range: parameter.range.to_string(),
            summary: parameter.summary.clone(),
        })
    }
}
