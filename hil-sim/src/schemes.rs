//! Scheme files on the host: which there are, and what is wrong with one, in words.

use std::fmt;

use dimsart_core::modules::Standard;
use dimsart_core::scheme::{self, ENGINE, Problem, Row, SchemeError};
use dimsart_core::{
    CommandError, Dimsart, Engine, Finding, ModuleList, ModuleRef, ParameterError, Verb, limits,
};

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
pub enum SchemeFileError {
    /// The file is not there or not to be read.
    #[error(
        "cannot read the scheme file {name}: {source}; give another path, or one of {}",
        built_in_names()
    )]
    Unreadable {
        /// The file.
        name: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// `builtin:` and a name that none has.
    #[error("there is no scheme {name}; choose one of {}, or the path of a file", built_in_names())]
    NotBuiltIn {
        /// The name as written.
        name: String,
    },
}

/// Start of the name of a scheme that comes with the command.
const BUILT_IN_PREFIX: &str = "builtin:";

impl SchemeText {
    /// Reads a file, or takes `builtin:NAME`.
    ///
    /// # Errors
    /// [`SchemeFileError`] when there is no such file or built-in scheme.
    pub fn read(name: &str) -> Result<Self, SchemeFileError> {
        let name = name.to_owned();
        match name.strip_prefix(BUILT_IN_PREFIX) {
            Some(wanted) => match BUILT_IN.iter().find(|(known, _)| *known == wanted) {
                Some((_, text)) => Ok(Self { name, text: (*text).to_owned() }),
                None => Err(SchemeFileError::NotBuiltIn { name }),
            },
            None => match std::fs::read_to_string(&name) {
                Ok(text) => Ok(Self { name, text }),
                Err(source) => Err(SchemeFileError::Unreadable { name, source }),
            },
        }
    }
}

fn built_in_names() -> String {
    let names: Vec<_> = BUILT_IN.iter().map(|(name, _)| format!("{BUILT_IN_PREFIX}{name}")).collect();
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

    /// Everything that is wrong, a line each: rows first, then what is wrong with the whole.
    pub fn problems(&self) -> impl Iterator<Item = String> {
        let hint = if self.errors.is_empty() { "" } else { " (perhaps because of a row above)" };
        self.errors.iter().cloned().chain(self.faults.iter().map(move |fault| format!("{fault}{hint}")))
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
    /// The scenario key it comes from.
    pub key: String,
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
            | Err(Refusal {
                error: SchemeError { problem: Problem::Refused(CommandError::DoesNotMatch { .. }), .. },
                ..
            }) => {}
            Err(Refusal { error, by }) => {
                let place = error.place;
                let explained = Explained { error: &error, engine: dimsart.engine() };
                errors.push(match by {
                    None => format!("{}:{}:{}: {explained}", scheme.name, place.line, place.column),
                    Some(Setting { module, command, value, key }) => format!(
                        "{}:{}: {key} = {value} does not suit {module} {command}: {explained}; set another {key}",
                        scheme.name,
                        row.line()
                    ),
                });
            }
        }
    }
    let engine = dimsart.engine();
    let report = engine.check();
    let (faults, delays): (Vec<&Finding>, Vec<&Finding>) =
        report.findings().iter().partition(|finding| finding.is_fault());
    let mut faults: Vec<String> = faults.into_iter().map(|fault| fault_text(engine, *fault)).collect();
    if report.unlisted() > 0 {
        faults.push(format!("and {} more", report.unlisted()));
    }
    if faults.is_empty() && errors.is_empty() && !engine.is_running() {
        faults.push(format!(
            "its last row leaves it stopped: end it with the row `all {ENGINE} MATCHING_CHECK`"
        ));
    }
    let delays = delays.into_iter().map(|delay| engine.explain(*delay).to_string()).collect();
    Loaded { errors, faults, delays }
}

fn fault_text<const WORDS: usize>(engine: &Engine<Standard, WORDS>, fault: Finding) -> String {
    let text = engine.explain(fault);
    match fault {
        Finding::Mismatch { module, .. } => {
            let kind = ModuleRef { number: 1, ..module };
            let kind = Engine::<Standard, WORDS>::module_name(kind);
            format!("{text}; `dimsart modules {kind}` shows what fits")
        }
        _ => text.to_string(),
    }
}

/// A row that was refused, or the setting that was to be given with it.
struct Refusal<'a> {
    error: SchemeError<'a>,
    by: Option<&'a Setting>,
}

impl<'a> From<SchemeError<'a>> for Refusal<'a> {
    fn from(error: SchemeError<'a>) -> Self {
        Self { error, by: None }
    }
}

fn apply<'a, const WORDS: usize>(
    row: &Row<'a>,
    side: &str,
    settings: &'a [Setting],
    dimsart: &mut Dimsart<Standard, WORDS>,
) -> Result<(), Refusal<'a>> {
    if !row.is_for(side, SIDES)? || settings.iter().any(|setting| setting.replaces(row)) {
        return Ok(());
    }
    if let Some(module) = row.plugs_in() {
        for setting in settings.iter().filter(|setting| setting.module == module) {
            let text = format!("all {} {} {}", setting.module, setting.command, setting.value);
            for given in scheme::rows(&text) {
                given.apply(dimsart).map_err(|error| {
                    let mut blamed = row.blame(error.problem);
                    blamed.place.word = &setting.value;
                    Refusal { error: blamed, by: Some(setting) }
                })?;
            }
        }
    }
    Ok(row.apply(dimsart)?)
}

impl Setting {
    fn replaces(&self, row: &Row<'_>) -> bool {
        row.word(1) == self.module && row.word(2) == self.command
    }
}

struct Explained<'a, const WORDS: usize> {
    error: &'a SchemeError<'a>,
    engine: &'a Engine<Standard, WORDS>,
}

impl<const WORDS: usize> Explained<'_, WORDS> {
    /// `'X' is not a number`, or that it is missing.
    fn missing_or(&self, f: &mut fmt::Formatter<'_>, what: impl fmt::Display) -> fmt::Result {
        match self.error.place.word {
            "" => write!(f, "the row ends where {what} should be"),
            word => write!(f, "'{word}' is not {what}"),
        }
    }

    /// `'X' is not a module; did you mean 'Y'?`, or the whole list when nothing is near.
    fn unknown(&self, f: &mut fmt::Formatter<'_>, what: &str, known: &[String]) -> fmt::Result {
        self.missing_or(f, what)?;
        match nearest(self.error.place.word, known) {
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
            Problem::Number { min, max } => self.missing_or(f, format_args!("a number from {min} to {max}")),
            Problem::Whole { min, max } => {
                self.missing_or(f, format_args!("a whole number from {min} to {max}"))
            }
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
