//! Applies rows in sequence, as a controller does.

use std::collections::BTreeMap;

use dimsart_core::scheme::{self, PORT_PREFIX, Row, RowError, SchemeError};
use dimsart_core::{Command, CommandError, KindId, ModuleRef, ParameterError, Value, Vocabulary};
use hil_sim::law::{self, Law, LawVocabulary};
use hil_sim::schemes::{SIDES, SchemeErrorMessage};

use super::{Configuration, Module, Setting, UnknownRow};

/// Number of an unused module, for which a device reports the default ports.
const NOT_THERE: u8 = u8::MAX;

impl Configuration {
    /// Reads the rows for `side` and for all, by these names and the names of these numbered laws.
    #[must_use]
    pub fn read(text: &str, side: &str, known: &(impl Vocabulary + ?Sized), laws: &[(u8, Law)]) -> Self {
        let mut reader = Reader { known, laws, drafts: BTreeMap::new(), order: Vec::new(), before: None };
        let mut unknown = Vec::new();
        for row in scheme::rows(text) {
            if let Err(error) = reader.take(&row, side) {
                let words: Vec<_> =
                    (0..).map(|index| row.word(index)).take_while(|word| !word.is_empty()).collect();
                unknown.push(UnknownRow {
                    line: error.place.line,
                    column: error.place.column,
                    row: words.join(" "),
                    reason: {
                        let law = law::law_module(&row, known).and_then(|module| reader.law_of(module));
                        SchemeErrorMessage { error, known: &LawVocabulary::new(known, law.as_ref()) }
                            .to_string()
                    },
                });
            }
        }
        Self { modules: reader.finish(), unknown }
    }
}

/// Settings of a module so far.
#[derive(Default)]
struct Draft {
    /// By number of the parameter: the value of each entry; of a list, the added values.
    values: BTreeMap<u8, Vec<Option<Value>>>,
    /// Port and signal.
    ports: Vec<(String, String)>,
}

impl Draft {
    fn finish(&self, module: ModuleRef, is_on: bool, known: &(impl Vocabulary + ?Sized)) -> Module {
        let kind = module.kind;
        let parameter = |(index, values): (&u8, &Vec<Option<Value>>)| {
            Some(Setting::of_parameter(&known.parameter_text(kind, *index)?, values, known))
        };
        let ports = self.ports.iter().map(|(port, signal)| {
            let mut by_default = known.port_texts(ModuleRef { kind, number: NOT_THERE });
            let found = by_default.find(|found| found.name == port).and_then(|found| found.bound);
            let default = found.map(|signal| known.signal_name(signal).to_string());
            Setting::of_port(port, signal, default.unwrap_or_default())
        });
        let settings = self.values.iter().filter_map(parameter).chain(ports).collect();
        Module { name: known.module_name(module).to_string(), is_on, settings }
    }
}

struct Reader<'a, V: ?Sized> {
    known: &'a V,
    laws: &'a [(u8, Law)],
    /// By kind and number, from the first row that names a module.
    drafts: BTreeMap<(KindId, u8), Draft>,
    /// Plugged-in modules.
    order: Vec<ModuleRef>,
    /// Position of the next module.
    before: Option<ModuleRef>,
}

impl<V: Vocabulary + ?Sized> Reader<'_, V> {
    fn finish(self) -> Vec<Module> {
        let on = self.order.iter().map(|module| (*module, true));
        let all = self.drafts.keys().map(|(kind, number)| ModuleRef { kind: *kind, number: *number });
        let off = all.filter(|module| !self.order.contains(module)).map(|module| (module, false));
        let finish = |(module, is_on): (ModuleRef, bool)| {
            let draft = self.drafts.get(&(module.kind, module.number))?;
            let law = self.law_of(module);
            Some(draft.finish(module, is_on, &LawVocabulary::new(self.known, law.as_ref())))
        };
        on.chain(off).filter_map(finish).collect()
    }

    /// The law of a module so far.
    fn law_of(&self, module: ModuleRef) -> Option<(ModuleRef, Law)> {
        let number = self.drafts.get(&(module.kind, module.number))?.values.get(&0)?.first()?;
        let law = self.laws.iter().find(|(known, _)| *number == Some(Value::Count((*known).into())));
        law.map(|(_, law)| (module, law.clone()))
    }

    fn take<'r>(&mut self, row: &Row<'r>, side: &str) -> Result<(), SchemeError<'r>> {
        if !row.applies_to(side, SIDES)? {
            return Ok(());
        }
        let law = law::law_module(row, self.known).and_then(|module| self.law_of(module));
        let read = LawVocabulary::new(self.known, law.as_ref()).command(row);
        let Some(port) = row.word(2).strip_prefix(PORT_PREFIX) else { return self.apply(row, read?) };
        // Ports can depend on parameters, which only the device has.
        if !matches!(read, Ok(_) | Err(SchemeError { problem: RowError::ModuleCommand(_), .. })) {
            return read.map(drop);
        }
        let signal =
            self.known.signal_named(row.word(3)).ok_or_else(|| row.error_at_last_word(RowError::Type))?;
        if let Some(module) = self.known.find_module(row.word(1)) {
            let signal = self.known.signal_name(signal).to_string();
            let of_law = law.iter().flat_map(|(_, law)| law.names()).find(|name| name.on_device == port);
            let port = of_law.map_or_else(|| port.to_owned(), |name| name.in_law);
            let ports = &mut self.draft(module).ports;
            ports.retain(|(bound, _)| *bound != port);
            ports.push((port, signal));
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
            Command::Bind { .. }
            | Command::ResetModule(_)
            | Command::Check
            | Command::Stop
            | Command::Reset
            | Command::Begin
            | Command::Commit
            | Command::Abort
            | Command::UploadLaw { .. }
            | Command::StoreLaw { .. }
            | Command::RemoveLaw { .. } => {}
        }
        Ok(())
    }

    /// Sets a value; none if the entry does not exist.
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

    /// Plugs a module in, at the end or at the position given by a row.
    fn plug_in(&mut self, module: ModuleRef) {
        self.draft(module);
        self.order.retain(|there| *there != module);
        let before = self.before.take();
        let place = self.order.iter().position(|there| Some(*there) == before);
        self.order.insert(place.unwrap_or(self.order.len()), module);
    }
}
