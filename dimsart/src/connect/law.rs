//! Laws that come while the controller runs: upload, list, remove, and their own names.

use std::fmt;
use std::io::{Read, Write};

use dimsart_core::limits::PROGRAM_WORDS;
use dimsart_core::online::Program;
use dimsart_core::scheme::{self, Row};
use dimsart_core::{Command, ModuleRef, Value};
use dimsart_link::protocol::LawAction;
use dimsart_link::protocol::{Refusal, Request, Response, SignalText};
use hil_sim::law::{self, Law, LawName};
use serde::Serialize;

use super::device::take;
use super::{ConnectError, Device};

/// A law that is on a device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawReport {
    /// Its number, for the parameter `PROGRAM`.
    pub number: u8,
    /// Its name.
    pub name: String,
    /// Words of its program.
    pub words: u8,
    /// What it adds to a tick of the device, cycles; none if that is not known.
    pub cycles: Option<u32>,
    /// Whether a module has it.
    pub is_used: bool,
    /// Its ports and parameters, and what the device calls them.
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
            write!(f, ", at most {cycles} cycles of a tick")?;
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
    /// How many there can be.
    pub places: u8,
}

impl fmt::Display for Laws {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for law in &self.laws {
            writeln!(f, "{law}")?;
        }
        write!(f, "{} of {} laws", self.laws.len(), self.places)
    }
}

/// A law that is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LawRemoved {
    /// Its number.
    pub number: u8,
}

impl fmt::Display for LawRemoved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "law {} is removed", self.number)
    }
}

impl<S: Read + Write> Device<S> {
    /// Has the device take a law, under a number or the first free one. Nothing that runs is touched.
    ///
    /// # Errors
    /// [`ConnectError::NoLaws`] of an image without laws; [`ConnectError::Command`] with the reason of a refusal, or when no
    /// place is free; nothing has changed then.
    pub fn upload_law(&mut self, law: &Law, number: Option<u8>) -> Result<LawReport, ConnectError> {
        let number = match number {
            Some(number) => number,
            None => self.free_law()?,
        };
        for command in law.commands(number) {
            self.give(command)?;
        }
        let look = self.look_at_law(number)?.ok_or(ConnectError::OtherAnswer)?;
        Ok(LawReport::new(number, law, look.cycles, look.is_used))
    }

    /// The laws that the device has.
    ///
    /// # Errors
    /// [`ConnectError::NoLaws`]; [`ConnectError::Line`] when the device does not answer.
    pub fn laws(&mut self) -> Result<Laws, ConnectError> {
        let (laws, places) = self.read_laws()?;
        Ok(Laws { laws: laws.into_iter().map(|(report, _)| report).collect(), places })
    }

    /// The laws that the device has, and how many it has places for.
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

    /// The laws that the device has, each with its number, where rows are for a module that runs laws; none otherwise, and of
    /// an image without laws.
    pub(super) fn laws_for(&mut self, rows: &str) -> Result<Vec<(u8, Law)>, ConnectError> {
        if !scheme::rows(rows).any(|row| row.word(1).starts_with(law::MODULE)) {
            return Ok(Vec::new());
        }
        match self.read_laws() {
            Err(ConnectError::NoLaws) => Ok(Vec::new()),
            read => Ok(read?.0.into_iter().map(|(report, law)| (report.number, law)).collect()),
        }
    }

    /// Has the device forget a law that no module has.
    ///
    /// # Errors
    /// [`ConnectError::Command`] while a module has it.
    pub fn remove_law(&mut self, number: u8) -> Result<LawRemoved, ConnectError> {
        self.give(Command::RemoveLaw { number })?;
        Ok(LawRemoved { number })
    }

    /// The module of a row with the law that it runs, whose own names the row may have; none for any other row.
    pub(super) fn law_of(&mut self, row: &Row<'_>) -> Result<Option<(ModuleRef, Law)>, ConnectError> {
        let Some((module, number)) = self.runner_of(row)? else { return Ok(None) };
        let law = if number == 0 { None } else { self.law(number)? };
        Ok(law.map(|law| (module, law)))
    }

    /// The module of a row, if it runs laws, and the number of its law; 0 for none.
    pub(super) fn runner_of(&mut self, row: &Row<'_>) -> Result<Option<(ModuleRef, u8)>, ConnectError> {
        let Some(module) = self.know(|known| law::runner(row, known))? else { return Ok(None) };
        let number = match self.ask(&Request::Get { module, parameter: 0, entry: 0 }, take!(Value)) {
            Ok(Some(Value::Count(number))) => u8::try_from(number).unwrap_or(0),
            Err(ConnectError::Line(error)) => return Err(error.into()),
            // It does not exist yet.
            _ => 0,
        };
        Ok(Some((module, number)))
    }

    /// A law by its program; none where there is none.
    fn law(&mut self, number: u8) -> Result<Option<Law>, ConnectError> {
        let mut words: Vec<u32> = Vec::new();
        loop {
            let from = u8::try_from(words.len()).unwrap_or(u8::MAX);
            let read =
                self.ask(&Request::Law(LawAction::Read { number, from }), |response| match response {
                    Response::Signal(text) => Some(text),
                    _ => None,
                })?;
            let Some(SignalText { words_in_all, words: more, .. }) = read else { return Ok(None) };
            words.extend_from_slice(&more);
            if more.is_empty() || words.len() >= usize::from(words_in_all).min(PROGRAM_WORDS) {
                break;
            }
        }
        Ok(Program::verify(&words).ok().map(|program| Law::of_program(&program)))
    }

    fn look_at_law(&mut self, number: u8) -> Result<Option<dimsart_core::online::LawReport>, ConnectError> {
        match self.ask(&Request::Law(LawAction::Look { number }), take!(Law)) {
            Err(ConnectError::Refused(Refusal::NotUnderstood)) => Err(ConnectError::NoLaws),
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
            "the device has {places} laws, and no place for another one: `law remove` one that is not in use"
        )))
    }
}
