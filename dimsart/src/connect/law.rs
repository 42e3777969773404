//! Laws on a running controller: upload, list, remove, and their port and parameter names.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::limits::PROGRAM_WORDS;
use dimsart_core::online::Program;
use dimsart_core::scheme::{self, Row};
use dimsart_core::{Command, ModuleRef, Value};
use dimsart_link::protocol::LawAction;
use dimsart_link::protocol::{Refusal, Request, Response, SignalWords};
use hil_sim::law::{self, Law, LawName};
use serde::Serialize;

use super::device::take;
use super::{ConnectError, Device};

/// A law on a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawReport {
    /// Number, for the parameter `PROGRAM`.
    pub number: u8,
    /// Name.
    pub name: String,
    /// Length of the program in words.
    pub words: u8,
    /// WCET bound per tick, in cycles, if known.
    pub cycles: Option<u32>,
    /// Whether a module runs it.
    pub is_used: bool,
    /// Names of its ports and parameters in the law and on the device.
    pub names: Vec<LawName>,
}

impl LawReport {
    fn new(number: u8, law: &Law, cycles: Option<u32>, is_used: bool) -> Self {
        let words = u8::try_from(law.words.len()).unwrap_or(u8::MAX);
        Self { number, name: law.name.clone(), words, cycles, is_used, names: law.names() }
    }
}

impl fmt::Display for LawReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, name, words, cycles, is_used, names } = self;
        write!(f, "law {number}: {name}, {words} of {PROGRAM_WORDS} words")?;
        if let Some(cycles) = cycles {
            write!(f, ", at most {cycles} cycles per tick")?;
        }
        f.write_str(if *is_used { ", in use" } else { ", not in use" })?;
        let names: Vec<String> =
            names.iter().map(|name| format!("{} {}", name.on_device, name.in_law)).collect();
        write!(f, "\n  {}", names.join(", "))
    }
}

/// All laws of a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Laws {
    /// Laws.
    pub laws: Vec<LawReport>,
    /// Maximum number of laws.
    pub places: u8,
}

impl fmt::Display for Laws {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for law in &self.laws {
            writeln!(f, "{law}")?;
        }
        write!(f, "{} of at most {} laws", self.laws.len(), self.places)
    }
}

/// Outcome of removing a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RemovedLaw {
    /// Number of the law.
    pub number: u8,
}

impl fmt::Display for RemovedLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "law {} is removed", self.number)
    }
}

impl<S: Read + Write> Device<S> {
    /// Uploads a law under a number, by default the first free one. The running scheme is not affected.
    ///
    /// # Errors
    /// [`ConnectError::NoLaws`] for an image without laws; [`ConnectError::Command`] when the device refuses the law or has no
    /// free number; nothing has changed then.
    pub fn upload_law(&mut self, law: &Law, number: Option<u8>) -> Result<LawReport, ConnectError> {
        let number = match number {
            Some(number) => number,
            None => self.free_law()?,
        };
        for command in law.commands(number) {
            self.give(command)?;
        }
        let look = self.look_at_law(number)?.ok_or(ConnectError::UnexpectedAnswer)?;
        Ok(LawReport::new(number, law, look.cycles, look.is_used))
    }

    /// Lists the laws of the device.
    ///
    /// # Errors
    /// [`ConnectError::NoLaws`]; [`ConnectError::Line`] when the device does not answer.
    pub fn laws(&mut self) -> Result<Laws, ConnectError> {
        let (laws, places) = self.read_laws()?;
        Ok(Laws { laws: laws.into_iter().map(|(report, _)| report).collect(), places })
    }

    /// Reads the laws of the device and the maximum number of laws.
    fn read_laws(&mut self) -> Result<(Vec<(LawReport, Law)>, u8), ConnectError> {
        let (mut laws, mut places) = (Vec::new(), 0);
        for number in 1..=u8::MAX {
            let Some(look) = self.look_at_law(number)? else { break };
            places = number;
            if look.words > 0
                && let Some(law) = self.law(number)?
            {
                laws.push((LawReport::new(number, &law, look.cycles, look.is_used), law));
            }
        }
        Ok((laws, places))
    }

    /// Reads the laws of the device with their numbers if a row is for a module that runs laws. Returns an empty list
    /// otherwise, and for an image without laws.
    pub(super) fn laws_for(&mut self, rows: &str) -> Result<Vec<(u8, Law)>, ConnectError> {
        if !scheme::rows(rows).any(|row| row.word(1).starts_with(law::MODULE)) {
            return Ok(Vec::new());
        }
        match self.read_laws() {
            Err(ConnectError::NoLaws) => Ok(Vec::new()),
            read => Ok(read?.0.into_iter().map(|(report, law)| (report.number, law)).collect()),
        }
    }

    /// Removes an unused law from the device.
    ///
    /// # Errors
    /// [`ConnectError::Command`] while a module uses it.
    pub fn remove_law(&mut self, number: u8) -> Result<RemovedLaw, ConnectError> {
        self.give(Command::RemoveLaw { number })?;
        Ok(RemovedLaw { number })
    }

    /// Returns the module of a row and the law that it runs, whose names the row may use; `None` for other rows.
    pub(super) fn law_of(&mut self, row: &Row<'_>) -> Result<Option<(ModuleRef, Law)>, ConnectError> {
        let Some((module, number)) = self.runner_of(row)? else { return Ok(None) };
        let law = if number == 0 { None } else { self.law(number)? };
        Ok(law.map(|law| (module, law)))
    }

    /// Returns the module of a row, if it runs laws, and the number of its law; 0 without a law.
    pub(super) fn runner_of(&mut self, row: &Row<'_>) -> Result<Option<(ModuleRef, u8)>, ConnectError> {
        let Some(module) = self.know(|known| law::law_module(row, known))? else { return Ok(None) };
        let number = match self.ask(&Request::Get { module, parameter: 0, entry: 0 }, take!(Value)) {
            Ok(Some(Value::Count(number))) => u8::try_from(number).unwrap_or(0),
            Err(ConnectError::Line(error)) => return Err(error.into()),
            // The module does not exist yet.
            _ => 0,
        };
        Ok(Some((module, number)))
    }

    /// Reads a law; `None` if the number is unused.
    fn law(&mut self, number: u8) -> Result<Option<Law>, ConnectError> {
        let mut words: Vec<u32> = Vec::new();
        loop {
            let from = u8::try_from(words.len()).unwrap_or(u8::MAX);
            let read =
                self.ask(&Request::Law(LawAction::Read { number, from }), |response| match response {
                    Response::Signal(text) => Some(text),
                    _ => None,
                })?;
            let Some(SignalWords { total_words, words: more, .. }) = read else { return Ok(None) };
            words.extend_from_slice(&more);
            if more.is_empty() || words.len() >= usize::from(total_words).min(PROGRAM_WORDS) {
                break;
            }
        }
        Ok(Program::verify(&words).ok().map(|program| Law::from_program(&program)))
    }

    fn look_at_law(&mut self, number: u8) -> Result<Option<dimsart_core::online::LawReport>, ConnectError> {
        match self.ask(&Request::Law(LawAction::Status { number }), take!(Law)) {
            Err(ConnectError::Refused(Refusal::Unsupported)) => Err(ConnectError::NoLaws),
            look => look,
        }
    }

    fn free_law(&mut self) -> Result<u8, ConnectError> {
        let mut places = 0;
        for number in 1..=u8::MAX {
            let Some(look) = self.look_at_law(number)? else { break };
            if look.words == 0 {
                return Ok(number);
            }
            places = number;
        }
        Err(ConnectError::Command(format!(
            "the device already has its maximum of {places} laws: run `law remove` on an unused law"
        )))
    }
}
