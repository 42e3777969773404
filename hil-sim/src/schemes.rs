//! Scheme files on the host: which there are, and what is wrong with one, in words.

use std::fmt;
use std::path::Path;

use dimsart_core::modules::Standard;
use dimsart_core::scheme::{self, ENGINE, Problem, Row, SchemeError};
use dimsart_core::{CommandError, Dimsart, Engine, Finding, ModuleList, ParameterError, Verb, limits};

/// The sides a scheme can name.
pub const SIDES: &[&str] = &["master", "slave"];

/// Schemes that come with the command, by name.
pub const BUILT_IN: &[(&str, &str)] = &[
    ("bilateral", include_str!("../../schemes/bilateral.scheme")),
    ("position_position", include_str!("../../schemes/position_position.scheme")),
    ("table1", include_str!("../../schemes/table1.scheme")),
];

/// The text of a scheme and where it is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemeText {
    /// File or built-in name, for messages.
    pub name: String,
    /// Its rows.
    pub text: String,
}

/// A scheme that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read scheme {name}: {source}; built in are {}", built_in_names())]
pub struct SchemeFileError {
    /// The file.
    pub name: String,
    /// What the system says.
    pub source: std::io::Error,
}

impl SchemeText {
    /// Reads a file, or takes `builtin:NAME`.
    ///
    /// # Errors
    /// [`SchemeFileError`] when there is no such file or built-in scheme.
    pub fn read(name: &str) -> Result<Self, SchemeFileError> {
        let built_in = name.strip_prefix("builtin:").and_then(|wanted| {
            BUILT_IN.iter().find(|(known, _)| *known == wanted).map(|(_, text)| (*text).to_owned())
        });
        let text = built_in.map_or_else(|| std::fs::read_to_string(Path::new(name)), Ok);
        let text = text.map_err(|source| SchemeFileError { name: name.to_owned(), source })?;
        Ok(Self { name: name.to_owned(), text })
    }
}

fn built_in_names() -> String {
    let names: Vec<_> = BUILT_IN.iter().map(|(name, _)| format!("builtin:{name}")).collect();
    names.join(", ")
}

/// What a scheme came to on a controller.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Loaded {
    /// Rows that were not understood or refused, as messages with file, row and column.
    pub errors: Vec<String>,
    /// Faults of the scheme as a whole.
    pub faults: Vec<String>,
    /// One-tick delays that are declared and therefore allowed.
    pub delays: Vec<String>,
}

impl Loaded {
    /// Whether the scheme can run.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.errors.is_empty() && self.faults.is_empty()
    }
}

/// A value that is to stand in a scheme, whatever its rows say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The module.
    pub module: &'static str,
    /// The parameter.
    pub command: &'static str,
    /// The value as a scheme would write it.
    pub value: String,
}

/// Gives a scheme's rows for `side` to a controller and checks what came of it.
///
/// A setting takes the place of the rows for the same parameter. It is given right before its module
/// is plugged in; settings for modules that the scheme does not plug in have no effect.
pub fn load<const WORDS: usize>(
    scheme: &SchemeText,
    side: &str,
    settings: &[Setting],
    dimsart: &mut Dimsart<Standard, WORDS>,
) -> Loaded {
    let mut errors = Vec::new();
    for row in scheme::rows(&scheme.text) {
        match apply(&row, side, settings, dimsart) {
            // The faults say more than this refusal does.
            Ok(())
            | Err(SchemeError { problem: Problem::Refused(CommandError::DoesNotMatch { .. }), .. }) => {}
            Err(error) => errors.push(message(&scheme.name, &error, dimsart.engine())),
        }
    }
    let engine = dimsart.engine();
    let report = engine.check();
    let explain = |finding: &Finding| engine.explain(*finding).to_string();
    let (faults, delays): (Vec<_>, Vec<_>) = report.findings().iter().partition(|finding| finding.is_fault());
    Loaded {
        errors,
        faults: faults.into_iter().map(explain).collect(),
        delays: delays.into_iter().map(explain).collect(),
    }
}

fn apply<'a, const WORDS: usize>(
    row: &Row<'a>,
    side: &str,
    settings: &[Setting],
    dimsart: &mut Dimsart<Standard, WORDS>,
) -> Result<(), SchemeError<'a>> {
    if !row.is_for(side, SIDES)? || settings.iter().any(|setting| setting.replaces(row)) {
        return Ok(());
    }
    if let Some(module) = row.plugs_in() {
        for setting in settings.iter().filter(|setting| setting.module == module) {
            let text = format!("all {} {} {}", setting.module, setting.command, setting.value);
            for given in scheme::rows(&text) {
                given.apply(dimsart).map_err(|error| row.blame(error.problem))?;
            }
        }
    }
    row.apply(dimsart)
}

impl Setting {
    fn replaces(&self, row: &Row<'_>) -> bool {
        row.word(1) == self.module && row.word(2) == self.command
    }
}

fn message<const WORDS: usize>(
    name: &str,
    error: &SchemeError<'_>,
    engine: &Engine<Standard, WORDS>,
) -> String {
    let place = error.place;
    format!("{name}:{}:{}: {}", place.line, place.column, Explained { error, engine })
}

struct Explained<'a, const WORDS: usize> {
    error: &'a SchemeError<'a>,
    engine: &'a Engine<Standard, WORDS>,
}

impl<const WORDS: usize> Explained<'_, WORDS> {
    /// `no module 'X'; did you mean 'Y'?`, or the whole list when nothing is near.
    fn unknown(&self, f: &mut fmt::Formatter<'_>, what: &str, known: &[String]) -> fmt::Result {
        let word = self.error.place.word;
        if word.is_empty() {
            write!(f, "the row ends where {what} should be")?;
        } else {
            write!(f, "'{word}' is not {what}")?;
        }
        match nearest(word, known) {
            Some(near) => write!(f, "; did you mean '{near}'?"),
            None if known.is_empty() => write!(f, "; there is none"),
            None => write!(f, "; there is {}", known.join(", ")),
        }
    }
}

impl<const WORDS: usize> fmt::Display for Explained<'_, WORDS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = self.error.place.word;
        match self.error.problem {
            Problem::Destination => self.unknown(f, "a side", &owned(&["master", "slave", "m&s", "all"])),
            Problem::Module => self.unknown(f, "a module", &modules(true)),
            Problem::ModuleValue => self.unknown(f, "a module", &modules(false)),
            Problem::EngineCommand => {
                let verbs: Vec<_> = Verb::ALL.iter().map(|(_, name, _)| (*name).to_owned()).collect();
                self.unknown(f, "a command of the engine", &verbs)
            }
            Problem::ModuleCommand(module) => {
                let name = Engine::<Standard, WORDS>::module_name(module);
                let mut known: Vec<_> = parameters(module.kind);
                let ports = Engine::<Standard, WORDS>::new(self.engine.device().clone()).ports(module);
                let ports = ports.into_iter().flatten().filter(|port| port.data_type.is_some());
                known.extend(ports.map(|port| format!("PORT_{}", port.name)));
                self.unknown(f, &format!("a parameter or port of {name}"), &known)
            }
            Problem::Type => {
                let types = dimsart_core::types::ALL.iter().map(|data_type| data_type.name.to_owned());
                self.unknown(f, "a data type", &types.collect::<Vec<_>>())
            }
            Problem::Choice(names) => self.unknown(f, "one of its values", &owned(names)),
            Problem::Number { min, max } => write!(f, "'{word}' is not a number from {min} to {max}"),
            Problem::Whole { min, max } => write!(f, "'{word}' is not a whole number from {min} to {max}"),
            Problem::Surplus => write!(f, "'{word}' is one word too many on this row"),
            Problem::Refused(CommandError::Parameter(ParameterError::NoSuchAxis)) => {
                write!(f, "no such axis: the device has {} of them", self.engine.device().dof())
            }
            Problem::Refused(CommandError::WouldBreak(finding)) => {
                write!(f, "refused while the scheme runs: {}", self.engine.explain(finding))
            }
            Problem::Refused(error) => write!(f, "'{word}' refused: {error}"),
        }
    }
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

fn modules(with_engine: bool) -> Vec<String> {
    let engine = with_engine.then(|| ENGINE.to_owned());
    engine.into_iter().chain(Standard::KINDS.iter().map(|kind| kind.name.to_owned())).collect()
}

fn parameters(kind: u8) -> Vec<String> {
    let describe = |index| Engine::<Standard, { limits::DEFAULT_WORDS }>::describe_parameter(kind, index);
    (0..).map_while(describe).map(|parameter| parameter.name.to_owned()).collect()
}

/// The known word most like `word`, if one is like it at all.
pub(crate) fn nearest<'a>(word: &str, known: &'a [String]) -> Option<&'a str> {
    let likeness = |known: &&String| strsim::jaro_winkler(&word.to_uppercase(), &known.to_uppercase());
    let best = known.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (!word.is_empty() && likeness(&best) > 0.75).then_some(best)
}
