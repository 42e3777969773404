//! Schemes in the device's storage: save, try at the next start, confirm or roll back.

use std::fmt;
use std::io::{Read, Write};
use std::num::NonZeroU32;

use dimsart_core::BoundReport;
use dimsart_link::protocol::{
    Fallback, Origin, Refusal, Request, Response, SchemeAction, SchemeStatus, StoreError, TimingReport, Trial,
};
use dimsart_link::saved_scheme::LoadError;
use serde::Serialize;

use super::device::take;
use super::{ConnectError, Device};

/// State of the stored schemes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StoredSchemesReport {
    /// Scheme loaded at the last start: `built-in`, `saved`, `trial` or `none`.
    pub origin: &'static str,
    /// Why the start fell back to this scheme, if it did.
    pub reason: Option<String>,
    /// The scheme on trial: `none`, `waits` for the next start, or `tried`.
    pub trial: &'static str,
    /// Whether a confirmed scheme is stored.
    pub is_saved: bool,
}

impl fmt::Display for StoredSchemesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.origin {
            "built-in" => "started with the built-in scheme",
            "saved" => "started with the saved scheme",
            "trial" => "started with the scheme on trial",
            _ => "started without a scheme",
        })?;
        if let Some(reason) = &self.reason {
            write!(f, ": {reason}")?;
        }
        let otherwise = if self.is_saved { "the saved" } else { "the built-in" };
        match (self.trial, self.origin) {
            ("waits", _) => write!(f, "\nthe next start runs the scheme on trial, once"),
            ("tried", "trial") => {
                write!(
                    f,
                    "\nrun `confirm` to keep the scheme; without `confirm` the next start runs {otherwise} scheme"
                )
            }
            ("tried", _) => write!(f, "\nthe scheme on trial does not run again: `save` another scheme"),
            _ => Ok(()),
        }
    }
}

/// Timing of the ticks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TickTimingReport {
    /// Measured ticks.
    pub ticks: u32,
    /// Ticks that started late.
    pub late: u32,
    /// Ticks that overran: not finished when the next one was due.
    pub overruns: u32,
    /// Processor cycles of the last tick.
    pub last_cycles: Option<u32>,
    /// Mean processor cycles.
    pub mean_cycles: Option<u32>,
    /// Observed maximum of processor cycles.
    pub max_cycles: Option<u32>,
    /// WCET bound of the running scheme, by the machine code of a stamped image.
    pub bound_cycles: Option<u32>,
    /// Budget of a tick.
    pub limit_cycles: Option<NonZeroU32>,
}

impl TickTimingReport {
    fn new(found: TimingReport, bound: Option<BoundReport>) -> Self {
        let TimingReport { ticks, late, overruns, last_mean_max_cycles } = found;
        let [last_cycles, mean_cycles, max_cycles] = match last_mean_max_cycles {
            Some(cycles) => cycles.map(Some),
            None => [None; 3],
        };
        let bound_cycles = bound.map(|bound| bound.cycles);
        let limit_cycles = bound.and_then(|bound| bound.limit_cycles);
        Self { ticks, late, overruns, last_cycles, mean_cycles, max_cycles, bound_cycles, limit_cycles }
    }
}

impl fmt::Display for TickTimingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ticks started late, {} overran", self.late, self.overruns)?;
        if let (Some(last), Some(mean), Some(max)) = (self.last_cycles, self.mean_cycles, self.max_cycles) {
            write!(f, "; tick: last {last} cycles, mean {mean}, max {max}")?;
        }
        if let Some(bound) = self.bound_cycles {
            write!(f, "; WCET bound from the machine code: {bound} cycles")?;
        }
        if let Some(limit) = self.limit_cycles {
            write!(f, ", limit {limit} cycles")?;
        }
        Ok(())
    }
}

impl<S: Read + Write> Device<S> {
    /// Saves the current scheme for a trial at the device's next start.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] or [`ConnectError::Command`] with the reason; the stored schemes are unchanged.
    pub fn save(&mut self) -> Result<StoredSchemesReport, ConnectError> {
        self.schemes(SchemeAction::Save)
    }

    /// Confirms the scheme on trial: every start loads it.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] when the last start did not try it.
    pub fn confirm(&mut self) -> Result<StoredSchemesReport, ConnectError> {
        self.schemes(SchemeAction::Confirm)
    }

    /// Deletes the scheme on trial; the running scheme continues until the next start.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] with the reason.
    pub fn roll_back(&mut self) -> Result<StoredSchemesReport, ConnectError> {
        self.schemes(SchemeAction::RollBack)
    }

    /// Reads the state of the stored schemes; `None` on a device without storage.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn stored_schemes(&mut self) -> Result<Option<StoredSchemesReport>, ConnectError> {
        known(self.schemes(SchemeAction::Read).map(Some))
    }

    /// Reads the timing of the ticks; `None` on a device that does not measure it.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn timing(&mut self) -> Result<Option<TickTimingReport>, ConnectError> {
        let Some(timing) = known(self.ask(&Request::Timing, take!(Timing)))? else { return Ok(None) };
        let bound = known(self.ask(&Request::Bound, take!(Bound)))?;
        Ok(Some(TickTimingReport::new(timing, bound)))
    }

    fn schemes(&mut self, action: SchemeAction) -> Result<StoredSchemesReport, ConnectError> {
        match self.ask(&Request::Schemes(action), take!(Schemes)) {
            Err(ConnectError::Refused(Refusal::Engine(error))) => {
                Err(ConnectError::Command(self.refusal_text(error)?))
            }
            status => self.kept_report(status?.ok_or(ConnectError::UnexpectedAnswer)?),
        }
    }

    fn kept_report(&mut self, status: SchemeStatus) -> Result<StoredSchemesReport, ConnectError> {
        let SchemeStatus { origin, fallback, trial, is_saved } = status;
        let origin = match origin {
            Origin::Empty => "none",
            Origin::BuiltIn => "built-in",
            Origin::Saved => "saved",
            Origin::Trial => "trial",
        };
        let trial = match trial {
            Trial::None => "none",
            Trial::Pending => "waits",
            Trial::Tried => "tried",
        };
        let reason = fallback.map(|fallback| self.fallback_text(fallback)).transpose()?;
        Ok(StoredSchemesReport { origin, reason, trial, is_saved })
    }

    fn fallback_text(&mut self, fallback: Fallback) -> Result<String, ConnectError> {
        let (which, error) = match fallback {
            Fallback::Storage => {
                let text = "the scheme storage is unreadable or contains other data: `save` the scheme again";
                return Ok(text.to_owned());
            }
            Fallback::Damaged => {
                let text = "a storage entry is damaged or incomplete, an older entry was loaded: `save` the scheme \
                            again";
                return Ok(text.to_owned());
            }
            Fallback::NotRecorded => {
                let text = "the scheme on trial was not started, because storage could not record the trial: `save` \
                            the scheme again";
                return Ok(text.to_owned());
            }
            Fallback::Unconfirmed => {
                return Ok("the scheme on trial was started before and not confirmed".to_owned());
            }
            Fallback::Trial(error) => ("the scheme on trial", error),
            Fallback::Saved(error) => ("the saved scheme", error),
            Fallback::BuiltIn(error) => ("the built-in scheme", error),
            other => return Ok(format!("{other:?}")),
        };
        let error = match error {
            LoadError::Refused { command, error } => {
                let number = command.saturating_add(1);
                format!("command {number} was refused: {}", self.refusal_text(error)?)
            }
            error => error.to_string(),
        };
        Ok(format!("cannot load {which}: {error}"))
    }
}

/// Maps the refusal of an older device, or of a device without storage, to `None`.
pub(super) fn known<T>(answer: Result<Option<T>, ConnectError>) -> Result<Option<T>, ConnectError> {
    match answer {
        Err(ConnectError::Refused(Refusal::Unsupported | Refusal::Store(StoreError::NoStorage))) => Ok(None),
        answer => answer,
    }
}
