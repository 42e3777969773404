//! Selects the recorded signals by `record.signals`.

use crate::schemes::most_similar;

/// Unknown name in `record.signals`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "record.signals: unknown name '{name}'; {}",
    nearest.as_ref().map_or_else(
        || format!("available: {}; for one signal, write STATION.SIGNAL", sources.join(", ")),
        |nearest| format!("did you mean '{nearest}'?"),
    )
)]
pub struct UnknownSignal {
    /// The unknown name.
    pub name: String,
    /// The valid name most like it.
    pub nearest: Option<String>,
    /// First parts of all signals' names.
    pub sources: Vec<String>,
}

/// Names of the selected signals; empty for all.
#[derive(Debug, Clone)]
pub(super) struct Selection(Vec<String>);

impl Selection {
    /// Selects all signals.
    pub(super) fn all() -> Self {
        Self(Vec::new())
    }

    /// Selects `wanted`; each must be a `known` name or the first parts of one.
    pub(super) fn new(wanted: &[String], known: impl Iterator<Item = String>) -> Result<Self, UnknownSignal> {
        let known: Vec<String> = known.collect();
        let Some(name) = wanted.iter().find(|wanted| !known.iter().any(|known| begins(known, wanted))) else {
            return Ok(Self(wanted.to_vec()));
        };
        let mut sources: Vec<String> =
            known.iter().filter_map(|known| Some(known.split_once('.')?.0.to_owned())).collect();
        sources.dedup();
        sources.sort();
        sources.dedup();
        let names: Vec<String> = sources.iter().chain(&known).cloned().collect();
        let last_part = format!(".{name}");
        let without_station = known.iter().find(|known| known.ends_with(&last_part)).cloned();
        let nearest = without_station.or_else(|| most_similar(name, &names).map(str::to_owned));
        Err(UnknownSignal { name: name.clone(), nearest, sources })
    }

    /// Whether the signal `name` (`master.DES_FORCE`) is selected.
    pub(super) fn holds(&self, name: &str) -> bool {
        self.0.is_empty() || self.0.iter().any(|wanted| begins(name, wanted))
    }
}

/// Whether `first` is `name` or its first parts.
fn begins(name: &str, first: &str) -> bool {
    name.strip_prefix(first).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}
