//! Rows, as a controller would take them one after another.

use std::collections::BTreeMap;

use dimsart_core::scheme::{self, PORT_PREFIX, Problem, Row, SchemeError};
use dimsart_core::{Command, CommandError, ModuleRef, ParameterError, Value, Vocabulary};
use hil_sim::schemes::{Explained, SIDES};

use super::{Configuration, Module, Setting, UnknownRow};

/// Number of a module that no scheme has: of it a device tells what ports a module has by default.
const NOT_THERE: u8 = u8::MAX;

impl Configuration {
    /// Reads the rows for `side`, or for all, by these names.
    #[must_use]
    pub fn read(text: &str, side: &str, known: &impl Vocabulary) -> Self {
        let mut reader = Reader { known, drafts: BTreeMap::new(), order: Vec::new(), before: None };
        let mut unknown = Vec::new();
        for row in scheme::rows(text) {
            if let Err(error) = reader.take(&row, side) {
                let words: Vec<_> =
                    (0..).map(|index| row.word(index)).take_while(|word| !word.is_empty()).collect();
                unknown.push(UnknownRow {
                    line: error.place.line,
                    column: error.place.column,
                    row: words.join(" "),
                    reason: Explained { error, known }.to_string(),
                });
            }
        }
        Self { modules: reader.finish(), unknown }
    }
}

/// What was set of a module so far.
#[derive(Default)]
struct Draft {
    /// By number of the parameter: of each entry, what was set; of a list, what was added.
    values: BTreeMap<u8, Vec<Option<Value>>>,
    /// Port and signal.
    ports: Vec<(String, String)>,
}

impl Draft {
    fn finish(&self, module: ModuleRef, is_on: bool, known: &impl Vocabulary) -> Module {
        let kind = module.kind;
        let parameter = |(index, values): (&u8, &Vec<Option<Value>>)| {
            Some(Setting::of_parameter(&known.parameter_text(kind, *index)?, values, known))
        };
        let ports = self.ports.iter().map(|(port, signal)| {
            let mut by_default = known.port_texts(ModuleRef { kind, number: NOT_THERE });
            let found = by_default.find(|found| found.name == port).and_then(|found| found.bound);
            let default = found.map(|signal| known.name_of_signal(signal).to_string());
            Setting::of_port(port, signal, default.unwrap_or_default())
        });
        let settings = self.values.iter().filter_map(parameter).chain(ports).collect();
        Module { name: known.name_of_module(module).to_string(), is_on, settings }
    }
}

struct Reader<'a, V> {
    known: &'a V,
    /// By kind and number; a module is there from the first row on that names it.
    drafts: BTreeMap<(u8, u8), Draft>,
    /// What is plugged in.
    order: Vec<ModuleRef>,
    /// Where the next module is plugged in.
    before: Option<ModuleRef>,
}

impl<V: Vocabulary> Reader<'_, V> {
    fn finish(self) -> Vec<Module> {
        let Self { known, mut drafts, order, .. } = self;
        let on = order.into_iter().map(|module| {
            let draft = drafts.remove(&(module.kind, module.number)).unwrap_or_default();
            draft.finish(module, true, known)
        });
        let on: Vec<Module> = on.collect();
        let off = drafts
            .into_iter()
            .map(|((kind, number), draft)| draft.finish(ModuleRef { kind, number }, false, known));
        on.into_iter().chain(off).collect()
    }

    fn take<'r>(&mut self, row: &Row<'r>, side: &str) -> Result<(), SchemeError<'r>> {
        if !row.is_for(side, SIDES)? {
            return Ok(());
        }
        let read = row.command(self.known);
        let Some(port) = row.word(2).strip_prefix(PORT_PREFIX) else { return self.apply(row, read?) };
        // Which ports there are can depend on parameters: that is for the device to say.
        if !matches!(read, Ok(_) | Err(SchemeError { problem: Problem::ModuleCommand(_), .. })) {
            return read.map(drop);
        }
        let signal = self.known.signal_named(row.word(3)).ok_or_else(|| row.blame(Problem::Type))?;
        if let Some(module) = self.known.module_named(row.word(1)) {
            let signal = self.known.name_of_signal(signal).to_string();
            let ports = &mut self.draft(module).ports;
            ports.retain(|(bound, _)| bound != port);
            ports.push((port.to_owned(), signal));
        }
        Ok(())
    }

    fn apply<'r>(&mut self, row: &Row<'r>, command: Command) -> Result<(), SchemeError<'r>> {
        match command {
            Command::PlugIn(module) => self.plug_in(module),
            Command::Unplug(module) => self.order.retain(|there| *there != module),
            Command::PlaceBefore(module) => self.before = Some(module),
            Command::InitModule(module) => *self.draft(module) = Draft::default(),
            Command::CloseModule(module) => {
                self.order.retain(|there| *there != module);
                self.drafts.remove(&(module.kind, module.number));
            }
            Command::Close | Command::Init => {
                self.order.clear();
                self.drafts.clear();
            }
            Command::Set { module, parameter, entry, value } => {
                let no_such_entry = CommandError::Parameter(ParameterError::NoSuchEntry);
                self.set(module, parameter, entry, value).ok_or_else(|| row.refused(no_such_entry))?;
            }
            // These change no configuration; ports are read by their names.
            _ => {}
        }
        Ok(())
    }

    /// None for an entry that there is not.
    fn set(&mut self, module: ModuleRef, parameter: u8, entry: Option<u8>, value: Value) -> Option<()> {
        let found = self.known.parameter_text(module.kind, parameter)?;
        let count = found.entries.count(self.known.dof());
        let values = self.draft(module).values.entry(parameter).or_default();
        if found.default.is_none() {
            values.push(Some(value));
            return Some(());
        }
        values.resize(count.into(), None);
        match entry {
            None => values.fill(Some(value)),
            Some(entry) => *values.get_mut(usize::from(entry))? = Some(value),
        }
        Some(())
    }

    fn draft(&mut self, module: ModuleRef) -> &mut Draft {
        self.drafts.entry((module.kind, module.number)).or_default()
    }

    /// Plugs a module in, behind the others or where a row has said.
    fn plug_in(&mut self, module: ModuleRef) {
        self.draft(module);
        self.order.retain(|there| *there != module);
        let before = self.before.take();
        let place = self.order.iter().position(|there| Some(*there) == before);
        self.order.insert(place.unwrap_or(self.order.len()), module);
    }
}
