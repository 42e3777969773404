//! `[[type]]`: a type of the Data Base that the catalogue has not.

use dimsart_core::{DataType, Format, Shape, Summary, Unit};
use serde::{Deserialize, Serialize};

/// The number of the first one: those below are the catalogue's.
pub(super) const FIRST_OWN: u16 = 0x8000;

/// `[[type]]`: one value for each axis.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TypeSection {
    /// Name in schemes, `UPPER_CASE`.
    pub name: String,
    /// Its unit, as that of an axis that slides: `m`, `N`, `N/m`, ...; `1` is a pure number.
    pub unit: String,
}

/// Those that a type can have, as they are written: the first one of those that are written alike.
fn units() -> impl Iterator<Item = (&'static str, Unit)> {
    Unit::ALL.iter().filter(|unit| **unit != Unit::Any).map(|unit| (written(*unit), *unit))
}

fn written(unit: Unit) -> &'static str {
    match unit {
        Unit::One => "1",
        unit => unit.symbol(dimsart_core::AxisKind::Linear),
    }
}

impl TypeSection {
    /// The type with that number; none without a unit.
    pub(super) fn data_type(&self, id: u16) -> Option<&'static DataType> {
        let (_, unit) = units().find(|(written, _)| *written == self.unit)?;
        // A type lives as long as the program: on a board it is in flash.
        Some(Box::leak(Box::new(DataType {
            id,
            name: String::leak(self.name.clone()),
            unit,
            format: Format::F32,
            shape: Shape::Vector,
            summary: Summary::new("Declared by a rig file."),
        })))
    }

    /// What is wrong with it.
    pub(super) fn problem(&self) -> Option<String> {
        let Self { name, unit } = self;
        let is_name = |name: &str| {
            let is_part =
                |letter: char| letter.is_ascii_uppercase() || letter.is_ascii_digit() || letter == '_';
            name.starts_with(|first: char| first.is_ascii_uppercase()) && name.chars().all(is_part)
        };
        if !is_name(name) {
            return Some(format!("type '{name}': give it a name of A to Z, 0 to 9 and _"));
        }
        if dimsart_core::types::by_name(name).is_some() {
            return Some(format!(
                "type '{name}' is one of the catalogue: give it another name, or leave it out"
            ));
        }
        let mut known: Vec<&str> = Vec::new();
        for (written, _) in units() {
            if !known.contains(&written) {
                known.push(written);
            }
        }
        (!known.contains(&unit.as_str())).then(|| {
            format!(
                "type '{name}': there is no unit '{unit}'; give it one of {}, as on an axis that slides",
                known.join(", ")
            )
        })
    }
}
