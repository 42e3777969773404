//! Scheme text: rows of `dest module command value`, as in Table 1 of the paper.
//!
//! A row is a line of words separated by blanks; `#` starts a comment. `dest` names the sides that the row is
//! for, by name or initials (`master`, `m&s`), or is `all`. `MOD_ENG` is the engine. `K_PARAM[0]` is a
//! parameter of one axis, `K[0][1]` an element of a matrix; `PORT_<port>` binds a port to another signal.

use heapless::Vec;

use crate::dimsart::Dimsart;
use crate::module::ModuleRef;
use crate::parameter::{ParameterError, Value};
use crate::scheme::{Command, CommandError, EngineCommand};
use crate::signal::TypeRef;
use crate::vocabulary::names::split_axis;
use crate::vocabulary::{ParameterTypeDescription, Vocabulary};

/// Name of the engine in a row.
pub const ENGINE: &str = "MOD_ENG";
/// Prefix of the command that binds a port.
pub const PORT_PREFIX: &str = "PORT_";
/// Values of a switch.
pub const SWITCH: &[&str] = &[switch(false), switch(true)];

/// Returns the text of a switch.
#[must_use]
pub const fn switch(is_on: bool) -> &'static str {
    if is_on { "ON" } else { "OFF" }
}

/// Maximum words of a row, plus one.
const MAX_WORDS: usize = 5;

/// A word of a row and its location.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SourceLocation<'a> {
    /// Line, from 1.
    pub line: usize,
    /// Column of the word's first byte, from 1; after the end of the row if the word is missing.
    pub column: usize,
    /// The word; empty when it is missing.
    pub word: &'a str,
}

/// One row of a scheme.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row<'a> {
    words: Vec<SourceLocation<'a>, MAX_WORDS>,
    end: SourceLocation<'a>,
}

/// Problem with a word of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowError {
    /// Unknown destination: expected a side, its initial, or `all`.
    Destination,
    /// Unknown module: expected `MOD_ENG` or a module.
    Module,
    /// Unknown engine command.
    EngineCommand,
    /// Unknown parameter or port of this module.
    ModuleCommand(ModuleRef),
    /// Invalid value: expected a module.
    ModuleValue,
    /// Unknown data type.
    Type,
    /// Invalid indices after a parameter's name: it has one value for all axes, or no matrix.
    Entry {
        /// The module.
        module: ModuleRef,
        /// Number of the parameter.
        parameter: u8,
    },
    /// Invalid value for this parameter.
    Value {
        /// The module.
        module: ModuleRef,
        /// Number of the parameter.
        parameter: u8,
    },
    /// Surplus word.
    Surplus,
    /// The engine refused the command.
    Refused(CommandError),
}

/// Error in a row. The row had no effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SchemeError<'a> {
    /// The location of the wrong word.
    pub place: SourceLocation<'a>,
    /// The problem.
    pub problem: RowError,
}

/// Returns the rows of a scheme without comments and blank lines.
pub fn rows(text: &str) -> impl Iterator<Item = Row<'_>> {
    (1..).zip(text.lines()).filter_map(|(line, text)| {
        let content = text.split('#').next().unwrap_or_default();
        let mut words = Vec::new();
        for word in content.split(is_blank).filter(|word| !word.is_empty()) {
            let column = word.as_ptr().addr() - text.as_ptr().addr() + 1;
            // Of surplus words, the first is enough for the error.
            let _ = words.push(SourceLocation { line, column, word });
        }
        let end = SourceLocation { line, column: content.trim_end().len() + 1, word: "" };
        (!words.is_empty()).then_some(Row { words, end })
    })
}

/// Returns whether a character is blank; a byte order mark is.
fn is_blank(character: char) -> bool {
    character.is_whitespace() || character == '\u{feff}'
}

/// Returns the rows for `side`, one of `sides`, and the rows with an invalid destination.
pub fn rows_for<'a>(
    text: &'a str,
    side: &str,
    sides: &[&str],
) -> impl Iterator<Item = Result<Row<'a>, SchemeError<'a>>> {
    rows(text).filter_map(move |row| match row.applies_to(side, sides) {
        Ok(is_mine) => is_mine.then_some(Ok(row)),
        Err(error) => Some(Err(error)),
    })
}

/// Executes every row for `side` on a controller, in order. Rows that fail are reported and skipped.
///
/// Returns the number of rows that failed.
pub fn load<'a>(
    text: &'a str,
    side: &str,
    sides: &[&str],
    dimsart: &mut Dimsart,
    mut report: impl FnMut(SchemeError<'a>),
) -> usize {
    let mut failed = 0;
    for row in rows_for(text, side, sides) {
        if let Err(error) = row.and_then(|row| row.apply(dimsart)) {
            report(error);
            failed += 1;
        }
    }
    failed
}

impl<'a> Row<'a> {
    /// Returns the line number, from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.end.line
    }

    /// Returns whether the row is for `side`, one of `sides`.
    ///
    /// # Errors
    /// [`RowError::Destination`] when the destination is not one of the sides.
    pub fn applies_to(&self, side: &str, sides: &[&str]) -> Result<bool, SchemeError<'a>> {
        let place = self.place(0);
        if place.word == "all" {
            return Ok(true);
        }
        let mut is_mine = false;
        for part in place.word.split('&') {
            let is_known = |side: &&str| !part.is_empty() && (*side == part || side.get(..1) == Some(part));
            if !sides.iter().any(is_known) {
                return Err(SchemeError { place, problem: RowError::Destination });
            }
            is_mine |= is_known(&side);
        }
        Ok(is_mine)
    }

    /// Creates a row from words, the destination first, without a location in a text. Empty words are
    /// missing.
    #[must_use]
    pub fn from_words(words: &[&'a str]) -> Self {
        let place = |word| SourceLocation { line: 1, column: 1, word };
        let mut row = Self { words: Vec::new(), end: place("") };
        for word in words.iter().filter(|word| !word.is_empty()) {
            let _ = row.words.push(place(word));
        }
        row
    }

    /// Parses the row's command.
    ///
    /// # Errors
    /// [`SchemeError`] names the wrong word.
    pub fn command(&self, known: &(impl Vocabulary + ?Sized)) -> Result<Command, SchemeError<'a>> {
        let (command, words) = if self.place(1).word == ENGINE {
            self.engine_command(known)?
        } else {
            (self.module_command(known)?, 4)
        };
        match self.words.get(words) {
            Some(place) => Err(SchemeError { place: *place, problem: RowError::Surplus }),
            None => Ok(command),
        }
    }

    /// Executes the row's command on a controller.
    ///
    /// # Errors
    /// [`SchemeError`] when the row is invalid or refused; nothing has changed.
    pub fn apply(&self, dimsart: &mut Dimsart) -> Result<(), SchemeError<'a>> {
        let command = self.command(dimsart.engine())?;
        dimsart.command(command).map_err(|error| self.refused(error))
    }

    /// Creates the error of a refused row, located at the responsible word.
    #[must_use]
    pub fn refused(&self, error: CommandError) -> SchemeError<'a> {
        let problem = RowError::Refused(error);
        match error {
            CommandError::Parameter(ParameterError::NoSuchEntry | ParameterError::WhilePluggedIn) => {
                SchemeError { place: self.place(2), problem }
            }
            _ => self.error_at_last_word(problem),
        }
    }

    /// Returns word `index` of the row, from 0; empty if it is missing.
    #[must_use]
    pub fn word(&self, index: usize) -> &'a str {
        self.place(index).word
    }

    /// Creates an error at the row's last word.
    #[must_use]
    pub fn error_at_last_word(&self, problem: RowError) -> SchemeError<'a> {
        SchemeError { place: self.words.last().copied().unwrap_or(self.end), problem }
    }

    /// Parses an engine command and returns its number of words.
    fn engine_command(
        &self,
        known: &(impl Vocabulary + ?Sized),
    ) -> Result<(Command, usize), SchemeError<'a>> {
        let place = self.place(2);
        let unknown = SchemeError { place, problem: RowError::EngineCommand };
        let command = EngineCommand::from_name(place.word).ok_or(unknown)?;
        if !command.needs_module {
            return Ok((command.with(None).ok_or(unknown)?, 3));
        }
        let place = self.place(3);
        let module = known.find_module(place.word);
        let module = module.ok_or(SchemeError { place, problem: RowError::ModuleValue })?;
        Ok((command.with(Some(module)).ok_or(unknown)?, 4))
    }

    fn module_command(&self, known: &(impl Vocabulary + ?Sized)) -> Result<Command, SchemeError<'a>> {
        let module = self.module(known)?;
        let place = self.place(2);
        if let Some(port) = place.word.strip_prefix(PORT_PREFIX) {
            let mut ports = known.port_texts(module);
            let port = ports.position(|found| found.name == port && found.bound.is_some());
            let port = port.and_then(|port| u8::try_from(port).ok());
            let port = port.ok_or(SchemeError { place, problem: RowError::ModuleCommand(module) })?;
            return Ok(Command::bind(module, port, self.signal(known)?));
        }
        let (module, parameter, entry) = self.parameter(known)?;
        let accepts = known.parameter_text(module.kind, parameter).map(|found| found.accepts);
        if accepts == Some(ParameterTypeDescription::Types) {
            let value = Value::Type(self.signal(known)?);
            return Ok(Command::Set { module, parameter, entry, value });
        }
        let place = self.place(3);
        let value = accepts.and_then(|accepts| read_value(&accepts, place.word));
        let problem = RowError::Value { module, parameter };
        let value = value.ok_or(SchemeError { place, problem })?;
        Ok(Command::Set { module, parameter, entry, value })
    }

    /// Parses the row's parameter, whatever its value, and its [entry](crate::ParameterShape::place).
    ///
    /// # Errors
    /// [`SchemeError`] names the wrong word.
    pub fn parameter(
        &self,
        known: &(impl Vocabulary + ?Sized),
    ) -> Result<(ModuleRef, u8, Option<u8>), SchemeError<'a>> {
        let module = self.module(known)?;
        let place = self.place(2);
        let unknown = SchemeError { place, problem: RowError::ModuleCommand(module) };
        let (name, indices) = split_axis(place.word);
        let (parameter, found) = known.find_parameter(module.kind, name).ok_or(unknown)?;
        let dof = known.dof();
        let entry = indices.and_then(|indices| found.entries.place(indices, dof));
        // The engine checks the axis against its device.
        let entry = entry.filter(|place| {
            !found.entries.is_matrix() || place.is_none_or(|place| place < found.entries.count(dof))
        });
        let entry = entry.ok_or(SchemeError { place, problem: RowError::Entry { module, parameter } })?;
        Ok((module, parameter, entry))
    }

    fn module(&self, known: &(impl Vocabulary + ?Sized)) -> Result<ModuleRef, SchemeError<'a>> {
        let place = self.place(1);
        known.find_module(place.word).ok_or(SchemeError { place, problem: RowError::Module })
    }

    fn signal(&self, known: &(impl Vocabulary + ?Sized)) -> Result<TypeRef, SchemeError<'a>> {
        let place = self.place(3);
        known.signal_named(place.word).ok_or(SchemeError { place, problem: RowError::Type })
    }

    fn place(&self, index: usize) -> SourceLocation<'a> {
        self.words.get(index).copied().unwrap_or(self.end)
    }
}

/// Parses a value for a parameter; none if the word is invalid.
fn read_value(accepts: &ParameterTypeDescription<'_>, word: &str) -> Option<Value> {
    let name_in = |names: &[&str]| {
        let index = names.iter().position(|name| *name == word);
        index.and_then(|index| u8::try_from(index).ok())
    };
    match accepts {
        ParameterTypeDescription::Real { min, max } => {
            word.parse().ok().filter(|value| (*min..=*max).contains(value)).map(Value::Real)
        }
        ParameterTypeDescription::Count { min, max } => {
            word.parse().ok().filter(|value| (*min..=*max).contains(value)).map(Value::Count)
        }
        ParameterTypeDescription::Integer { min, max } => {
            word.parse().ok().filter(|value| (*min..=*max).contains(value)).map(Value::Integer)
        }
        ParameterTypeDescription::Flag => name_in(SWITCH).map(|index| Value::Flag(index == 1)),
        ParameterTypeDescription::Choice(names) => name_in(names).map(Value::Choice),
        ParameterTypeDescription::Types => None,
    }
}
