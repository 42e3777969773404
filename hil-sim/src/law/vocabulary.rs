//! Names of a controller, with the law's names for the module that runs a law.

use dimsart_core::scheme::{Row, RowError, SchemeError};
use dimsart_core::{
    AxisKind, Command, DataTypeDescription, EVERY_TICKS, KindId, ModuleRef, ParameterDescription,
    ParameterTypeDescription, PortDescription, Value, Vocabulary,
};

use super::Law;

/// Name of the module that runs laws.
pub const MODULE: &str = "ONLINE_MOD";

/// Names of a controller and of the law of one of its modules: `stiffness` for `P_1`, `PORT_force` for `PORT_OUT_1`.
#[derive(Debug)]
pub struct LawVocabulary<'k, V: ?Sized> {
    known: &'k V,
    law: Option<&'k (ModuleRef, Law)>,
}

impl<'k, V: Vocabulary + ?Sized> LawVocabulary<'k, V> {
    /// Uses the law of a module; without a law, the controller's names.
    pub fn new(known: &'k V, law: Option<&'k (ModuleRef, Law)>) -> Self {
        Self { known, law }
    }

    /// Parses the command of a row, which may also use the controller's name of a port, such as `PORT_IN_1`.
    ///
    /// # Errors
    /// [`SchemeError`] with the unknown word.
    pub fn command<'a>(&self, row: &Row<'a>) -> Result<Command, SchemeError<'a>> {
        match row.command(self) {
            Err(error @ SchemeError { problem: RowError::ModuleCommand(_), .. }) => {
                row.command(self.known).map_err(|_| error)
            }
            command => command,
        }
    }

    fn law_of(&self, is_of: impl Fn(ModuleRef) -> bool) -> Option<&'k Law> {
        self.law.and_then(|(module, law)| is_of(*module).then_some(law))
    }
}

/// Returns the module of a row if it runs laws.
pub fn law_module(row: &Row<'_>, known: &(impl Vocabulary + ?Sized)) -> Option<ModuleRef> {
    let word = row.word(1);
    let is_runner = word.split('.').next() == Some(MODULE);
    if is_runner { known.find_module(word) } else { None }
}

impl<V: Vocabulary + ?Sized> Vocabulary for LawVocabulary<'_, V> {
    fn device_name(&self) -> &str {
        self.known.device_name()
    }

    fn axes(&self) -> &[AxisKind] {
        self.known.axes()
    }

    fn kind_at(&self, place: u8) -> Option<&str> {
        self.known.kind_at(place)
    }

    fn kind_name(&self, kind: KindId) -> Option<&str> {
        self.known.kind_name(kind)
    }

    fn parameter_text(&self, kind: KindId, index: u8) -> Option<ParameterDescription<'_>> {
        let found = self.known.parameter_text(kind, index)?;
        let (Some(law), Some(number), true) =
            (self.law_of(|module| module.kind == kind), index.checked_sub(1), index != EVERY_TICKS)
        else {
            return Some(found);
        };
        // The kind has the maximum number of parameters of a law.
        let own = law.parameters.get(usize::from(number))?;
        let of_law = own.parameter;
        Some(ParameterDescription {
            name: &own.name,
            unit: of_law.unit,
            accepts: ParameterTypeDescription::Real { min: of_law.min, max: of_law.max },
            default: Some(Value::Real(of_law.default)),
            ..found
        })
    }

    fn port_text(&self, module: ModuleRef, index: u8) -> Option<PortDescription<'_>> {
        let found = self.known.port_text(module, index)?;
        let own = self.law_of(|of| of == module);
        let mut names = own.into_iter().flat_map(|law| law.inputs.iter().chain(&law.outputs));
        let name = names.nth(index.into()).map_or(found.name, |port| port.name.as_str());
        Some(PortDescription { name, ..found })
    }

    fn find_parameter(&self, kind: KindId, name: &str) -> Option<(u8, ParameterDescription<'_>)> {
        let of_law = (0..=u8::MAX).zip(self.parameter_texts(kind)).find(|(_, found)| found.name == name);
        // A row may also use the controller's name.
        of_law.or_else(|| {
            let (number, found) = self.known.find_parameter(kind, name)?;
            Some((number, self.parameter_text(kind, number).unwrap_or(found)))
        })
    }

    fn type_text(&self, index: u16) -> Option<DataTypeDescription<'_>> {
        self.known.type_text(index)
    }
}
