//! Applies a scheme's rows to a controller, overridden by the scenario's settings.

use dimsart_core::scheme::{self, ENGINE, Row, RowError, SchemeError};
use dimsart_core::{CommandError, Dimsart, Engine, Finding, ModuleRef, Value, Vocabulary};

use super::explain::SchemeErrorMessage;
use super::{SIDES, SchemeText, Setting, frequencies};
use crate::law::{self, Law, LawVocabulary};

/// Result of loading a scheme into a controller.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadReport {
    /// Invalid and refused rows, as messages with file, row and column.
    pub errors: Vec<String>,
    /// Faults of the scheme as a whole.
    pub faults: Vec<String>,
    /// Declared, and therefore allowed, one-tick delays.
    pub delays: Vec<String>,
}

impl LoadReport {
    /// Whether the scheme can run.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.errors.is_empty() && self.faults.is_empty()
    }

    /// Returns all problems, one line each: rows first, then faults of the whole scheme.
    pub fn problems(&self) -> impl Iterator<Item = String> {
        let hint = if self.errors.is_empty() { "" } else { " (possibly caused by an error above)" };
        self.errors.iter().cloned().chain(self.faults.iter().map(move |fault| format!("{fault}{hint}")))
    }
}

/// Applies a scheme's rows for `side` to a controller and checks the result.
///
/// A setting overrides the rows of its parameter: it is applied right before its module is plugged in, and after each
/// later row that sets the parameter. A setting is a fault if the scheme does not plug in its module.
pub fn load(scheme: &SchemeText, side: &str, settings: &[Setting], dimsart: &mut Dimsart) -> LoadReport {
    load_for(scheme, side, SIDES, settings, dimsart)
}

/// Like [`load`], with other `sides`.
pub fn load_for(
    scheme: &SchemeText,
    side: &str,
    sides: &[&str],
    settings: &[Setting],
    dimsart: &mut Dimsart,
) -> LoadReport {
    let mut errors = Vec::new();
    for row in scheme::rows_for(&scheme.text, side, sides) {
        let law = row.as_ref().ok().and_then(|row| law_of(row, dimsart.engine_mut()));
        match row.map_err(Refusal::from).and_then(|row| apply(&row, law.as_ref(), settings, dimsart)) {
            // The faults are more specific than this refusal.
            Ok(())
            | Err(Refusal {
                error: SchemeError { problem: RowError::Refused(CommandError::HasFaults { .. }), .. },
                ..
            }) => {}
            Err(refusal) => errors
                .push(refusal.explain(&scheme.name, &LawVocabulary::new(dimsart.engine(), law.as_ref()))),
        }
    }
    let too_high = frequencies::too_high(dimsart.engine_mut());
    let engine = dimsart.engine();
    let report = engine.check();
    let (faults, delays): (Vec<&Finding>, Vec<&Finding>) =
        report.findings().iter().partition(|finding| finding.is_fault());
    let mut faults: Vec<String> =
        faults.into_iter().map(|fault| engine.explain(*fault).to_string()).collect();
    if report.unlisted() > 0 {
        faults.push(format!("and {} more faults", report.unlisted()));
    }
    faults.extend(too_high);
    if errors.is_empty() && engine.is_in_transaction() {
        faults.push(format!("open transaction at the end of the scheme: add the row `all {ENGINE} COMMIT`"));
    } else if faults.is_empty() && errors.is_empty() && !engine.is_running() {
        faults.push(format!(
            "the scheme is stopped after its last row: add the row `all {ENGINE} MATCHING_CHECK`"
        ));
    }
    // Correcting a faulty row may plug the module in.
    let is_idle = |setting: &&Setting| {
        errors.is_empty() && !setting.module_ref().is_some_and(|module| engine.is_plugged_in(module))
    };
    faults.extend(settings.iter().filter(is_idle).map(|Setting { key, module, .. }| {
        format!("the setting {key} has no effect: the scheme does not plug in {module}; remove {key}")
    }));
    let delays = delays.into_iter().map(|delay| engine.explain(*delay).to_string()).collect();
    LoadReport { errors, faults, delays }
}

/// A refused row, or a refused setting applied with it.
struct Refusal<'a> {
    error: SchemeError<'a>,
    by: Option<&'a Setting>,
}

impl<'a> From<SchemeError<'a>> for Refusal<'a> {
    fn from(error: SchemeError<'a>) -> Self {
        Self { error, by: None }
    }
}

impl Refusal<'_> {
    fn explain(&self, name: &str, known: &(impl Vocabulary + ?Sized)) -> String {
        let Self { error, by } = *self;
        let place = error.place;
        let explained = SchemeErrorMessage { error, known };
        match by {
            None => format!("{name}:{}:{}: {explained}", place.line, place.column),
            Some(Setting { module, command, value, key }) => format!(
                "{name}:{}: {key} = {value} is invalid for {module} {command}: {explained}; change {key}",
                place.line
            ),
        }
    }
}

/// Finds the law that the module of a row runs; the row may use the law's names.
fn law_of(row: &Row<'_>, engine: &mut Engine) -> Option<(ModuleRef, Law)> {
    let module = law::law_module(row, engine)?;
    let Ok(Value::Count(number)) = engine.get(module, 0, 0) else { return None };
    let (_, program) = engine.programs().find(|(known, _)| u32::from(*known) == number)?;
    Some((module, Law::from_program(&program)))
}

/// Applies a row and the settings that are due with it.
fn apply<'a>(
    row: &Row<'a>,
    law: Option<&(ModuleRef, Law)>,
    settings: &'a [Setting],
    dimsart: &mut Dimsart,
) -> Result<(), Refusal<'a>> {
    let command = LawVocabulary::new(dimsart.engine(), law).command(row)?;
    for setting in settings.iter().filter(|setting| setting.is_due_before(command)) {
        give(setting, row, dimsart)?;
    }
    dimsart.command(command).map_err(|error| row.refused(error))?;
    let kinds = dimsart.engine().kinds();
    for setting in settings.iter().filter(|setting| setting.is_due_after(command, kinds)) {
        if setting.module_ref().is_some_and(|module| dimsart.engine().is_plugged_in(module)) {
            give(setting, row, dimsart)?;
        }
    }
    Ok(())
}

fn give<'a>(setting: &'a Setting, row: &Row<'a>, dimsart: &mut Dimsart) -> Result<(), Refusal<'a>> {
    scheme::rows(&setting.row()).try_for_each(|given| {
        given.apply(dimsart).map_err(|SchemeError { problem, .. }| {
            let mut error = row.error_at_last_word(problem);
            error.place.word = &setting.value;
            Refusal { error, by: Some(setting) }
        })
    })
}
