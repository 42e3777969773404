//! Schemes: a controller's set-up as a text of `dest module command value` rows.
//!
//! The paper's Table 1 is one. A row is a line of words with blanks between them; `#` starts a
//! comment. `dest` names the sides the row is for, whole or by initials (`master`, `m&s`), or is
//! `all`. `MOD_ENG` is the engine. A parameter of one axis is written `K_PARAM[0]`; `PORT_<port>`
//! binds a port to another signal.

use heapless::Vec;

use crate::command::{Command, CommandError, EngineCommand, ModuleRef};
use crate::dimsart::Dimsart;
use crate::engine::Engine;
use crate::kind::ModuleList;
use crate::names::split_axis;
use crate::parameter::{Accepts, ParameterError, Value};

/// Name of the engine in a row.
pub const ENGINE: &str = "MOD_ENG";
const PORT_PREFIX: &str = "PORT_";
const SWITCH: &[&str] = &["OFF", "ON"];

/// A word of a row and where it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place<'a> {
    /// Line, from 1.
    pub line: usize,
    /// Column of the word's first byte, from 1; behind the row for a word that is missing.
    pub column: usize,
    /// The word; empty when it is missing.
    pub word: &'a str,
}

/// One row of a scheme.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row<'a> {
    words: Vec<Place<'a>, 5>,
    end: Place<'a>,
}

/// What a row should have had where it went wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Problem {
    /// A side, its initial, or `all`.
    Destination,
    /// `MOD_ENG` or a module.
    Module,
    /// A command of the engine.
    EngineCommand,
    /// A parameter or a port of this module.
    ModuleCommand(ModuleRef),
    /// A module as the value.
    ModuleValue,
    /// A data type.
    Type,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// A number in this range.
    Number {
        /// Smallest.
        min: f32,
        /// Largest.
        max: f32,
    },
    /// A whole number in this range.
    Whole {
        /// Smallest.
        min: u32,
        /// Largest.
        max: u32,
    },
    /// Nothing more on this row.
    Surplus,
    /// The row was understood and the engine refused it.
    Refused(CommandError),
}

/// What is wrong with a row. The row had no effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SchemeError<'a> {
    /// The word at fault.
    pub place: Place<'a>,
    /// What is wrong with it.
    pub problem: Problem,
}

/// The rows of a scheme, comments and blank lines left out.
pub fn rows(text: &str) -> impl Iterator<Item = Row<'_>> {
    (1..).zip(text.lines()).filter_map(|(line, text)| {
        let content = text.split('#').next().unwrap_or_default();
        let mut words = Vec::new();
        for word in content.split(is_blank).filter(|word| !word.is_empty()) {
            let column = word.as_ptr().addr() - text.as_ptr().addr() + 1;
            // Of a row with too many words, the first surplus one is enough to say so.
            let _ = words.push(Place { line, column, word });
        }
        let end = Place { line, column: content.trim_end().len() + 1, word: "" };
        (!words.is_empty()).then_some(Row { words, end })
    })
}

/// A byte order mark, as some editors put it first, is as blank as it looks.
fn is_blank(character: char) -> bool {
    character.is_whitespace() || character == '\u{feff}'
}

/// The rows of a scheme that are for `side`, one of `sides`, and those that do not say so rightly.
pub fn rows_for<'a>(
    text: &'a str,
    side: &str,
    sides: &[&str],
) -> impl Iterator<Item = Result<Row<'a>, SchemeError<'a>>> {
    rows(text).filter_map(move |row| match row.is_for(side, sides) {
        Ok(is_mine) => is_mine.then_some(Ok(row)),
        Err(error) => Some(Err(error)),
    })
}

/// Gives every row for `side` to a controller, in order. Rows that fail are reported and skipped.
///
/// Returns the number of rows that failed.
pub fn load<'a, M: ModuleList, const WORDS: usize>(
    text: &'a str,
    side: &str,
    sides: &[&str],
    dimsart: &mut Dimsart<M, WORDS>,
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
    /// Line of the row, from 1.
    #[must_use]
    pub fn line(&self) -> usize {
        self.end.line
    }

    /// Whether the row is for `side`, one of `sides`.
    ///
    /// # Errors
    /// [`Problem::Destination`] when the destination is none of the sides.
    pub fn is_for(&self, side: &str, sides: &[&str]) -> Result<bool, SchemeError<'a>> {
        let place = self.place(0);
        if place.word == "all" {
            return Ok(true);
        }
        let mut is_mine = false;
        for part in place.word.split('&') {
            let is_known = |side: &&str| !part.is_empty() && (*side == part || side.get(..1) == Some(part));
            if !sides.iter().any(is_known) {
                return Err(SchemeError { place, problem: Problem::Destination });
            }
            is_mine |= is_known(&side);
        }
        Ok(is_mine)
    }

    /// The command the row stands for.
    ///
    /// # Errors
    /// [`SchemeError`] names the word that is not understood.
    pub fn command<M: ModuleList, const WORDS: usize>(
        &self,
        engine: &mut Engine<M, WORDS>,
    ) -> Result<Command, SchemeError<'a>> {
        let (command, words) = if self.place(1).word == ENGINE {
            self.engine_command::<M, WORDS>()?
        } else {
            (self.module_command(engine)?, 4)
        };
        match self.words.get(words) {
            Some(place) => Err(SchemeError { place: *place, problem: Problem::Surplus }),
            None => Ok(command),
        }
    }

    /// Gives the row's command to a controller.
    ///
    /// # Errors
    /// [`SchemeError`] when it is not understood or refused; nothing has changed then.
    pub fn apply<M: ModuleList, const WORDS: usize>(
        &self,
        dimsart: &mut Dimsart<M, WORDS>,
    ) -> Result<(), SchemeError<'a>> {
        let command = self.command(dimsart.engine_mut())?;
        dimsart.command(command).map_err(|error| {
            let problem = Problem::Refused(error);
            match error {
                CommandError::Parameter(ParameterError::NoSuchAxis | ParameterError::WhilePluggedIn) => {
                    SchemeError { place: self.place(2), problem }
                }
                _ => self.blame(problem),
            }
        })
    }

    /// Word `index` of the row, from 0; empty when there is none.
    #[must_use]
    pub fn word(&self, index: usize) -> &'a str {
        self.place(index).word
    }

    /// An error of the row's last word.
    #[must_use]
    pub fn blame(&self, problem: Problem) -> SchemeError<'a> {
        SchemeError { place: self.words.last().copied().unwrap_or(self.end), problem }
    }

    /// And how many words it takes.
    fn engine_command<M: ModuleList, const WORDS: usize>(&self) -> Result<(Command, usize), SchemeError<'a>> {
        let place = self.place(2);
        let unknown = SchemeError { place, problem: Problem::EngineCommand };
        let command = EngineCommand::of(place.word).ok_or(unknown)?;
        if !command.needs_module {
            return Ok((command.with(None).ok_or(unknown)?, 3));
        }
        let place = self.place(3);
        let module = Engine::<M, WORDS>::module(place.word);
        let module = module.ok_or(SchemeError { place, problem: Problem::ModuleValue })?;
        Ok((command.with(Some(module)).ok_or(unknown)?, 4))
    }

    fn module_command<M: ModuleList, const WORDS: usize>(
        &self,
        engine: &mut Engine<M, WORDS>,
    ) -> Result<Command, SchemeError<'a>> {
        let place = self.place(1);
        let module = Engine::<M, WORDS>::module(place.word);
        let module = module.ok_or(SchemeError { place, problem: Problem::Module })?;
        let place = self.place(2);
        let unknown = SchemeError { place, problem: Problem::ModuleCommand(module) };
        if let Some(port) = place.word.strip_prefix(PORT_PREFIX) {
            let ports = engine.ports(module).unwrap_or_default();
            let index = ports.iter().position(|spec| spec.name == port && spec.data_type.is_some());
            let index = index.and_then(|index| u8::try_from(index).ok()).ok_or(unknown)?;
            let place = self.place(3);
            let signal = engine.device().signal(place.word);
            let signal = signal.ok_or(SchemeError { place, problem: Problem::Type })?;
            return Ok(Command::bind(module, index, signal));
        }
        let (name, axis) = split_axis(place.word).ok_or(unknown)?;
        let parameter = Engine::<M, WORDS>::parameter(module.kind, name).ok_or(unknown)?;
        let found = Engine::<M, WORDS>::describe_parameter(module.kind, parameter).ok_or(unknown)?;
        let place = self.place(3);
        let value = read_value(found.accepts, place.word, engine)
            .map_err(|problem| SchemeError { place, problem })?;
        Ok(Command::Set { module, parameter, axis, value })
    }

    fn place(&self, index: usize) -> Place<'a> {
        self.words.get(index).copied().unwrap_or(self.end)
    }
}

fn read_value<M: ModuleList, const WORDS: usize>(
    accepts: Accepts,
    word: &str,
    engine: &Engine<M, WORDS>,
) -> Result<Value, Problem> {
    let name_in = |names: &'static [&'static str]| {
        let index = names.iter().position(|name| *name == word).and_then(|index| u8::try_from(index).ok());
        index.ok_or(Problem::Choice(names))
    };
    match accepts {
        Accepts::Real { min, max, .. } => {
            let value = word.parse().ok().filter(|value| (min..=max).contains(value));
            value.map(Value::Real).ok_or(Problem::Number { min, max })
        }
        Accepts::Count { min, max } => {
            let value = word.parse().ok().filter(|value| (min..=max).contains(value));
            value.map(Value::Count).ok_or(Problem::Whole { min, max })
        }
        Accepts::Flag => name_in(SWITCH).map(|index| Value::Flag(index == 1)),
        Accepts::Choice(names) => name_in(names).map(Value::Choice),
        Accepts::Types => engine.device().signal(word).map(Value::Type).ok_or(Problem::Type),
    }
}
