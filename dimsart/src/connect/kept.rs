//! Schemes that the device keeps: save, try at the next start, confirm or roll back.

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

/// How the schemes stand that the device keeps.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KeptReport {
    /// What the last start loaded: `built-in`, `saved`, `trial` or `none`.
    pub origin: &'static str,
    /// Why it was not what should have been loaded, if it was not.
    pub reason: Option<String>,
    /// The scheme on trial: `none`, `waits` for the next start, or `tried`.
    pub trial: &'static str,
    /// Whether a confirmed scheme is kept.
    pub is_saved: bool,
}

impl fmt::Display for KeptReport {
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
            ("waits", _) => write!(f, "\na scheme waits for its trial: the next start runs it, once"),
            ("tried", "trial") => {
                write!(f, "\n`confirm` keeps it for every start; else the next one runs {otherwise} scheme")
            }
            ("tried", _) => write!(f, "\nthe scheme on trial is not run again: `save` another one"),
            _ => Ok(()),
        }
    }
}

/// How well the ticks keep their time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TimingText {
    /// Ticks that were timed.
    pub ticks: u32,
    /// Ticks that began late.
    pub late: u32,
    /// Ticks that were not done when the next one was due.
    pub overruns: u32,
    /// Processor cycles of the last tick, if they are known.
    pub last_cycles: Option<u32>,
    /// Of ticks on average.
    pub mean_cycles: Option<u32>,
    /// Of the longest tick.
    pub max_cycles: Option<u32>,
    /// What a tick of the scheme that runs takes at most, by the machine code of a stamped image.
    pub bound_cycles: Option<u32>,
    /// What it may take.
    pub limit_cycles: Option<NonZeroU32>,
}

impl TimingText {
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

impl fmt::Display for TimingText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ticks began late, {} overran", self.late, self.overruns)?;
        if let (Some(last), Some(mean), Some(max)) = (self.last_cycles, self.mean_cycles, self.max_cycles) {
            write!(f, "; a tick took {last} cycles last, {mean} on average, {max} at most")?;
        }
        if let Some(bound) = self.bound_cycles {
            write!(f, "; by its machine code it takes up to {bound} cycles")?;
        }
        if let Some(limit) = self.limit_cycles {
            write!(f, ", and it may take {limit}")?;
        }
        Ok(())
    }
}

impl<S: Read + Write> Device<S> {
    /// Keeps the scheme as it is now for a trial at the device's next start.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] or [`ConnectError::Command`] with the reason; what was kept still is.
    pub fn save(&mut self) -> Result<KeptReport, ConnectError> {
        self.schemes(SchemeAction::Save)
    }

    /// Keeps the scheme on trial, as it was saved, for every start.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] when it was not tried since the last start.
    pub fn confirm(&mut self) -> Result<KeptReport, ConnectError> {
        self.schemes(SchemeAction::Confirm)
    }

    /// Forgets the scheme on trial; what runs goes on until the next start.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] with the reason.
    pub fn roll_back(&mut self) -> Result<KeptReport, ConnectError> {
        self.schemes(SchemeAction::RollBack)
    }

    /// How the kept schemes stand; none on a device that keeps none.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn kept(&mut self) -> Result<Option<KeptReport>, ConnectError> {
        known(self.schemes(SchemeAction::Look).map(Some))
    }

    /// How well the ticks keep their time; none on a device that cannot tell.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn timing(&mut self) -> Result<Option<TimingText>, ConnectError> {
        let Some(timing) = known(self.ask(&Request::Timing, take!(Timing)))? else { return Ok(None) };
        let bound = known(self.ask(&Request::Bound, take!(Bound)))?;
        Ok(Some(TimingText::new(timing, bound)))
    }

    fn schemes(&mut self, action: SchemeAction) -> Result<KeptReport, ConnectError> {
        match self.ask(&Request::Schemes(action), take!(Schemes)) {
            Err(ConnectError::Refused(Refusal::Engine(error))) => {
                Err(ConnectError::Command(self.refusal_text(error)?))
            }
            status => self.kept_report(status?.ok_or(ConnectError::OtherAnswer)?),
        }
    }

    fn kept_report(&mut self, status: SchemeStatus) -> Result<KeptReport, ConnectError> {
        let SchemeStatus { origin, fallback, trial, is_saved } = status;
        let origin = match origin {
            Origin::Empty => "none",
            Origin::BuiltIn => "built-in",
            Origin::Saved => "saved",
            Origin::Trial => "trial",
        };
        let trial = match trial {
            Trial::None => "none",
            Trial::Waits => "waits",
            Trial::Tried => "tried",
        };
        let reason = fallback.map(|fallback| self.fallback_text(fallback)).transpose()?;
        Ok(KeptReport { origin, reason, trial, is_saved })
    }

    fn fallback_text(&mut self, fallback: Fallback) -> Result<String, ConnectError> {
        let (which, error) = match fallback {
            Fallback::Storage => {
                return Ok("its storage cannot be read, or holds other data: `save` again".to_owned());
            }
            Fallback::Damaged => {
                let text =
                    "an entry of its storage is damaged or incomplete, an older one counts: `save` again";
                return Ok(text.to_owned());
            }
            Fallback::NotRecorded => {
                let text = "the one on trial was not started, the storage did not take the record of its trial: \
                            `save` it again";
                return Ok(text.to_owned());
            }
            Fallback::Unconfirmed => {
                return Ok("the one on trial was started before and not confirmed".to_owned());
            }
            Fallback::Trial(error) => ("the one on trial", error),
            Fallback::Saved(error) => ("the saved one", error),
            Fallback::BuiltIn(error) => ("the built-in one", error),
            other => return Ok(format!("{other:?}")),
        };
        let error = match error {
            LoadError::Refused { command, error } => {
                let number = command.saturating_add(1);
                format!("its command {number} was refused: {}", self.refusal_text(error)?)
            }
            error => error.to_string(),
        };
        Ok(format!("{which} does not load: {error}"))
    }
}

/// What an older device, or one without storage, does not know is no error.
pub(super) fn known<T>(answer: Result<Option<T>, ConnectError>) -> Result<Option<T>, ConnectError> {
    match answer {
        Err(ConnectError::Refused(Refusal::NotUnderstood | Refusal::Store(StoreError::NoStorage))) => {
            Ok(None)
        }
        answer => answer,
    }
}
