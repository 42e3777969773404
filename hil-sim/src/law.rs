//! Control laws as text, compiled to programs that a running controller accepts.
//!
//! ```text
//! law SPRING "A spring to the desired position."
//! in position: POSITION
//! in desired: DES_POSITION
//! out force: DES_FORCE
//! param stiffness: Stiffness = 100 in 0..10000 "Its stiffness."
//! force = stiffness * (desired - position)
//! ```
//! Each line is a statement; `#` starts a comment; a statement continues inside parentheses. Statements apply to
//! every axis; `x[0]` is axis 0 of an input or parameter. A law that assigns its outputs axis by axis, `force[0] =
//! ...`, computes all axes at once and requires a device with this number of axes. `let` names a value. `state` keeps
//! a value from tick to tick: its initial value follows `=`, where `last(force)` is the command of another module in
//! the previous tick. States are assigned like outputs.
//!
//! Operators and functions: `+ - * /`, `< <= > >= == !=`, `and or not`, `if a then b else c`, `abs sqrt sin cos atan2
//! min max clamp`, `pi`, and `period`, the sample period in seconds. All arithmetic is `f32`, with the functions of
//! [`math`](dimsart_core::math).

mod check;
mod emit;
mod error;
mod lower;
mod parse;
mod syntax;
mod tokens;
mod values;
mod vocabulary;

use dimsart_core::{Command, TypeRef};
use std::path::Path;

use dimsart_core::online::{LawParameter, Program};
use serde::Serialize;

use crate::untrusted_text::{escape_lines, escape_word};

pub use error::LawError;
pub use vocabulary::{LawVocabulary, MODULE, law_module};

/// A compiled law.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Its name, `UPPER_CASE`.
    pub name: String,
    /// Description in one sentence; empty for a law read from a program.
    pub summary: String,
    /// Inputs.
    pub inputs: Vec<LawPort>,
    /// Outputs.
    pub outputs: Vec<LawPort>,
    /// Parameters, in the order of the program.
    pub parameters: Vec<NamedParameter>,
    /// Words of the program.
    pub words: Vec<u32>,
}

/// A port of a law.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawPort {
    /// Name in the law.
    pub name: String,
    /// Default binding.
    pub signal: TypeRef,
}

/// A port or a parameter of a law.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LawName {
    /// Name on the device, such as `P_1`.
    pub on_device: String,
    /// Name in the law.
    pub in_law: String,
}

/// A parameter of a law.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedParameter {
    /// Name in the law.
    pub name: String,
    /// Unit, range and default.
    pub parameter: LawParameter,
    /// Description; empty for a law read from a program.
    pub summary: String,
}

impl Law {
    /// Compiles a text; `origin` is its name in messages, such as the file name.
    ///
    /// # Errors
    /// [`LawError`] with the position of the first error and a remedy.
    pub fn compile(text: &str, origin: &str) -> Result<Self, LawError> {
        let text = &escape_lines(text);
        let compiled = parse::parse(text).and_then(|statements| {
            let checked = check::check(&statements, text)?;
            let lowered = lower::lower(&checked)?;
            emit::emit(&checked, &lowered, text)
        });
        compiled.map_err(|problem| LawError::new(problem, text, origin))
    }

    /// Compiles a file.
    ///
    /// # Errors
    /// A message with the position, if the file cannot be read or is invalid.
    pub fn read(path: &Path) -> Result<Self, String> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| format!("{name}: {error}"))?;
        Self::compile(&text, &name).map_err(|error| error.to_string())
    }

    /// Reads a law from a program.
    #[must_use]
    pub fn from_program(program: &Program<'_>) -> Self {
        let bytes: Vec<u8> = program.text().collect();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let mut names = text.lines().map(escape_word);
        let mut next = || names.next().unwrap_or_default();
        let header = program.header();
        let (name, summary) = (next(), String::new());
        let mut ports: Vec<LawPort> =
            program.ports().map(|signal| LawPort { name: next(), signal }).collect();
        let outputs = ports.split_off(usize::from(header.inputs).min(ports.len()));
        let parameters = (0..header.parameters).filter_map(|number| program.parameter(number));
        let parameters = parameters
            .map(|parameter| NamedParameter { name: next(), parameter, summary: String::new() })
            .collect();
        Self { name, summary, inputs: ports, outputs, parameters, words: program.words().to_vec() }
    }

    /// Returns the names of its ports and parameters on a controller.
    #[must_use]
    pub fn names(&self) -> Vec<LawName> {
        fn of<'n>(prefix: &'n str, names: impl Iterator<Item = &'n String>) -> impl Iterator<Item = LawName> {
            (1..).zip(names).map(move |(number, name)| LawName {
                on_device: format!("{prefix}_{number}"),
                in_law: name.clone(),
            })
        }
        let inputs = of("IN", self.inputs.iter().map(|port| &port.name));
        let outputs = of("OUT", self.outputs.iter().map(|port| &port.name));
        inputs.chain(outputs).chain(of("P", self.parameters.iter().map(|found| &found.name))).collect()
    }

    /// Returns the commands that store it on a controller as program `number`.
    #[must_use]
    pub fn commands(&self, number: u8) -> Vec<Command> {
        store_commands(&self.words, number)
    }

    /// Returns the program.
    #[must_use]
    pub fn program(&self) -> Option<Program<'_>> {
        Program::verify(&self.words).ok()
    }
}

/// Returns the commands that store a program of these words on a controller as program `number`.
#[must_use]
pub fn store_commands(words: &[u32], number: u8) -> Vec<Command> {
    let (pairs, rest) = words.as_chunks::<2>();
    let pairs = pairs.iter().copied().chain(rest.first().map(|last| [*last, 0]));
    let puts = (0..=u8::MAX).step_by(2).zip(pairs).map(|(place, words)| Command::UploadLaw { place, words });
    let count = u8::try_from(words.len()).unwrap_or(u8::MAX);
    puts.chain([Command::StoreLaw { number, count }]).collect()
}
