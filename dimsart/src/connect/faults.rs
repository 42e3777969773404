//! Faults of a scheme, and of its ticks.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::{Command, CommandError, Endpoint, Finding, ModuleRef, SafetyReason, TypeRef};
use dimsart_link::protocol::{FirstFault, Request, Response, SafetyReport};
use serde::Serialize;

use super::device::take;
use super::stored_schemes::known;
use super::{ConnectError, Device};

/// A finding of the device's check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FindingReport {
    /// Whether it prevents the scheme from running; otherwise it is a declared delay.
    pub is_fault: bool,
    /// Description, location and remedy.
    pub text: String,
    /// Affected module; `None` for the device itself.
    pub module: Option<String>,
    /// Affected signal.
    pub signal: Option<String>,
}

impl fmt::Display for FindingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", if self.is_fault { "fault" } else { "delay" }, self.text)
    }
}

/// Result of a check, which starts a valid scheme.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Whether the scheme passed and runs.
    pub is_running: bool,
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
    /// Number of faults, listed or not.
    pub faults: u32,
    /// Findings, faults first; a long list is truncated.
    pub findings: Vec<FindingReport>,
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.state)?;
        write_findings(f, self.faults, &self.findings)
    }
}

/// The first tick that was refused.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FirstFaultReport {
    /// Number of the tick, from 1.
    pub tick: u64,
    /// Reason.
    pub reason: String,
}

/// Faults of the current scheme and of its ticks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Faults {
    /// Whether the scheme commands the device, with the first reason if it does not.
    pub state: String,
    /// Ticks since the start.
    pub ticks: u64,
    /// Ticks with a refused frame.
    pub refused_ticks: u32,
    /// The first refused tick.
    pub first_fault: Option<FirstFaultReport>,
    /// CiA 402 state of the drive.
    pub drive: &'static str,
    /// Why modules are isolated, if any, including modules that the device does not depend on.
    pub cut_out: Option<String>,
    /// Number of ticks per reason for the safe value; empty on an older device.
    pub reasons: Vec<ReasonReport>,
    /// Number of faults of the scheme, listed or not.
    pub faults: u32,
    /// Findings, faults first; a long list is truncated.
    pub findings: Vec<FindingReport>,
}

/// A reason of the device's safety stage; `docs/faults.md` contains the remedies.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ReasonReport {
    /// Number.
    pub number: u8,
    /// Name.
    pub name: &'static str,
    /// Number of ticks.
    pub ticks: u32,
}

impl Faults {
    /// Returns whether there are no faults.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.faults == 0 && self.first_fault.is_none() && self.cut_out.is_none()
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n{} of {} ticks refused", self.state, self.refused_ticks, self.ticks)?;
        if let Some(FirstFaultReport { tick, reason }) = &self.first_fault {
            write!(f, "; first in tick {tick}: {reason}")?;
        }
        write!(f, "\ndrive: {}", self.drive)?;
        if let Some(cut_out) = &self.cut_out {
            write!(f, "\n{cut_out}")?;
        }
        for (place, ReasonReport { number, name, ticks }) in self.reasons.iter().enumerate() {
            let before = if place == 0 { "\nticks by reason: " } else { ", " };
            write!(f, "{before}{number} {name} {ticks}")?;
        }
        write_findings(f, self.faults, &self.findings)
    }
}

fn write_findings(f: &mut fmt::Formatter<'_>, faults: u32, findings: &[FindingReport]) -> fmt::Result {
    for finding in findings {
        write!(f, "\n  {finding}")?;
    }
    let listed = findings.iter().filter(|finding| finding.is_fault).count();
    match usize::try_from(faults).unwrap_or(usize::MAX).saturating_sub(listed) {
        0 => Ok(()),
        more => write!(f, "\n  and {more} more faults: correct the listed faults first"),
    }
}

impl<S: Read + Write> Device<S> {
    /// Checks the scheme and starts it if it is valid.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer; a scheme that does not match is no error.
    pub fn check(&mut self) -> Result<Check, ConnectError> {
        let command = Command::Check;
        let effect = self.try_give(command)?;
        match effect.refused {
            None | Some(CommandError::HasFaults { .. }) => {}
            Some(error) => return Err(ConnectError::Command(self.refusal_text(error)?)),
        }
        let (faults, findings) = self.findings()?;
        let state = self.state_text(effect.blocked)?;
        let is_sound = effect.refused.is_none();
        Ok(Check { is_running: is_sound && self.status()?.is_running, state, faults, findings })
    }

    /// Returns why the scheme does not command the device; `None` if it does.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn reason(&mut self) -> Result<Option<SafetyReason>, ConnectError> {
        Ok(self.status()?.blocked.map(|blocked| blocked.reason()))
    }

    /// Reads the faults without changing anything.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn faults(&mut self) -> Result<Faults, ConnectError> {
        let status = self.status()?;
        let first_fault = self.first_fault_text(status.first_fault)?;
        let (faults, findings) = self.findings()?;
        let state = self.state_text(status.blocked)?;
        Ok(Faults {
            state,
            ticks: status.ticks,
            refused_ticks: status.refused_ticks,
            first_fault,
            drive: status.state.name(),
            cut_out: status.module_fault.map(|fault| self.module_fault_text(fault)).transpose()?,
            reasons: self.reasons()?,
            faults,
            findings,
        })
    }

    fn reasons(&mut self) -> Result<Vec<ReasonReport>, ConnectError> {
        let report: Option<SafetyReport> = known(self.ask(&Request::Safety, take!(Safety)))?;
        let text = |(number, ticks)| {
            let name = SafetyReason::from_number(number).map_or("unknown reason", SafetyReason::name);
            ReasonReport { number, name, ticks }
        };
        Ok(report.map(|report| report.ticks.into_iter().map(text).collect()).unwrap_or_default())
    }

    pub(super) fn first_fault_text(
        &mut self,
        first: Option<FirstFault>,
    ) -> Result<Option<FirstFaultReport>, ConnectError> {
        let text = |first: FirstFault| {
            let reason = self.blocked_text(first.reason)?;
            Ok(FirstFaultReport { tick: first.tick, reason })
        };
        first.map(text).transpose()
    }

    pub(super) fn findings(&mut self) -> Result<(u32, Vec<FindingReport>), ConnectError> {
        let take = |response: Response<'_>| match response {
            Response::Finding { finding, faults } => Some((finding, faults)),
            _ => None,
        };
        let (mut in_all, mut found) = (0, Vec::new());
        for index in 0..=u8::MAX {
            let Some((finding, faults)) = self.ask(&Request::Finding { index }, take)? else { break };
            in_all = faults;
            let (module, signal) = subject(finding);
            found.push(FindingReport {
                is_fault: finding.is_fault(),
                text: self.finding_text(finding)?,
                module: module.map(|module| self.module_name(module)).transpose()?,
                signal: signal.map(|signal| self.signal_name(signal)).transpose()?,
            });
        }
        Ok((in_all, found))
    }
}

/// Returns the module and signal of a finding.
fn subject(finding: Finding) -> (Option<ModuleRef>, Option<TypeRef>) {
    let of = |party| match party {
        Endpoint::Module(module) => Some(module),
        Endpoint::Frame => None,
    };
    match finding {
        Finding::NoWriter { signal, reader } | Finding::Delay { signal, reader, .. } => {
            (of(reader), Some(signal))
        }
        Finding::MultipleWriters { signal, second, .. } => (of(second), Some(signal)),
        Finding::Mismatch { module, signal, .. } | Finding::UnitsDiffer { module, signal, .. } => {
            (Some(module), Some(signal))
        }
        Finding::DuplicateLinkEnd { second, .. } => (Some(second), None),
        Finding::SlowWriter { signal, writer, .. } => (Some(writer), Some(signal)),
        Finding::MissingDelay { signal, reader, .. } => (Some(reader), Some(signal)),
        Finding::LateStageRate { reader, .. } => (Some(reader), None),
        _ => (None, None),
    }
}
