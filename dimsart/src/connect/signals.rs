//! Signals of the Data Base after the last tick.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::{Format, TypeRef, Vocabulary};
use dimsart_link::protocol::{Request, Response};
use serde::Serialize;

use super::description::{DisplayValue, WordText};
use super::device::take;
use super::{ConnectError, Device};

/// One value per axis of the largest device.
const VALUES_PER_LINE: usize = dimsart_core::limits::MAX_DOF;

/// A signal that is read repeatedly.
#[derive(Debug)]
pub(super) struct Followed {
    pub(super) signal: TypeRef,
    /// `None` while it is not in the Data Base.
    pub(super) format: Option<Format>,
    /// Indices and unit of each of its words.
    pub(super) words: Vec<WordText>,
    pub(super) report: SignalReport,
}

/// A signal and its values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalReport {
    /// Name.
    pub name: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Its words in order; empty when it is not in the Data Base.
    pub values: Vec<DisplayValue>,
}

impl fmt::Display for SignalReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "  {:<22} {:<10}", self.name, self.unit)?;
        if self.values.is_empty() {
            f.write_str(" not in the Data Base")?;
        }
        for (line, values) in self.values.chunks(VALUES_PER_LINE).enumerate() {
            if line > 0 {
                write!(f, "\n{:35}", "")?;
            }
            values.iter().try_for_each(|value| write!(f, " {value:>12}"))?;
        }
        Ok(())
    }
}

impl<S: Read + Write> Device<S> {
    /// Reads the named signals, or all in the Data Base if `names` is empty.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] for an unknown name.
    pub fn signals(&mut self, names: &[String]) -> Result<Vec<SignalReport>, ConnectError> {
        Ok(self.followed(names)?.into_iter().map(|followed| followed.report).collect())
    }

    /// Checks that signals are in the Data Base.
    ///
    /// # Errors
    /// [`ConnectError::InvalidWord`] for an unknown name, or a signal that is not in the Data Base.
    pub fn require_signals(&mut self, names: &[String]) -> Result<(), ConnectError> {
        for name in names {
            let signal = self.signal_named(name)?;
            if self.signal(signal)?.format.is_none() {
                let device = &self.identity().device;
                return Err(ConnectError::InvalidWord(format!(
                    "signal {name} is not in the Data Base of {device}: plug in a module that uses the signal"
                )));
            }
        }
        Ok(())
    }

    /// Reads signals as [`Self::signals`] does, with format and layout of their words.
    pub(super) fn followed(&mut self, names: &[String]) -> Result<Vec<Followed>, ConnectError> {
        let mut wanted = Vec::new();
        for name in names {
            wanted.push(self.signal_named(name)?);
        }
        if names.is_empty() {
            wanted = self.entries()?;
        }
        wanted.into_iter().map(|signal| self.signal(signal)).collect()
    }

    pub(super) fn entries(&mut self) -> Result<Vec<TypeRef>, ConnectError> {
        let mut found = Vec::new();
        for index in 0..=u8::MAX {
            let Some(signal) = self.ask(&Request::Entry { index }, take!(Entry))? else { break };
            found.push(signal);
        }
        Ok(found)
    }

    fn signal(&mut self, signal: TypeRef) -> Result<Followed, ConnectError> {
        let mut format = None;
        let (name, unit, shape) = self.know(|known| {
            let found = known.type_of(signal);
            let unit = found.map(|found| found.unit.for_axes(known.axes()).to_string());
            let shape = found.map(|found| (found.unit, found.shape));
            (known.signal_name(signal).to_string(), unit.unwrap_or_default(), shape)
        })?;
        let mut bound = None;
        let mut report = SignalReport { name, unit, values: Vec::new() };
        let axes = self.identity().axes.clone();
        let take = |response: Response<'_>| match response {
            Response::Signal(text) => {
                let values = text.words.iter().map(|word| DisplayValue::of_word(*word, text.format));
                let unit = text.unit.for_axes(&axes).to_string();
                Some((text.format, (text.unit, unit), text.total_words, values.collect::<Vec<_>>()))
            }
            _ => None,
        };
        loop {
            let from = u16::try_from(report.values.len()).unwrap_or(u16::MAX);
            let Some((found, unit, in_all, values)) = self.ask(&Request::Signal { signal, from }, take)?
            else {
                break;
            };
            format = Some(found);
            (bound, report.unit) = (Some(unit.0), unit.1);
            let is_end = values.is_empty();
            report.values.extend(values);
            if is_end || report.values.len() >= usize::from(in_all) {
                break;
            }
        }
        let words = shape.map(|(unit, shape)| WordText::of_all(bound.unwrap_or(unit), shape, &axes));
        Ok(Followed { signal, format, words: words.unwrap_or_default(), report })
    }
}
