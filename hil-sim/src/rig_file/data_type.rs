//! `[[type]]`: an additional type of the Data Base.

use dimsart_core::{DataType, Format, Shape, Summary, Unit};
use serde::{Deserialize, Serialize};

/// Number of the first additional type; smaller numbers are built-in types.
pub(super) const FIRST_OWN: u16 = 0x8000;

/// `[[type]]`: one value per axis.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TypeSection {
    /// Name in schemes, `UPPER_CASE`.
    pub name: String,
    /// Unit, as for a linear axis: `m`, `N`, `N/m`, ...; `1` is dimensionless.
    pub unit: String,
}

/// Valid units as text; of units with equal text, the first.
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
    /// Creates the type with a number; `None` if the unit is unknown.
    pub(super) fn data_type(&self, id: u16) -> Option<&'static DataType> {
        let (_, unit) = units().find(|(written, _)| *written == self.unit)?;
        // Types are static, as in the flash of a board.
        Some(Box::leak(Box::new(DataType {
            id,
            name: String::leak(self.name.clone()),
            unit,
            format: Format::F32,
            shape: Shape::Vector,
            summary: Summary::new("Declared by a rig file."),
        })))
    }

    /// Returns its error, if any.
    pub(super) fn problem(&self) -> Option<String> {
        let Self { name, unit } = self;
        let is_name = |name: &str| {
            let is_part =
                |letter: char| letter.is_ascii_uppercase() || letter.is_ascii_digit() || letter == '_';
            name.starts_with(|first: char| first.is_ascii_uppercase()) && name.chars().all(is_part)
        };
        if !is_name(name) {
            return Some(format!("invalid type name '{name}': use A to Z, 0 to 9 and _"));
        }
        if dimsart_core::types::find_by_name(name).is_some() {
            return Some(format!(
                "type '{name}' is already a built-in type: choose another name, or remove this type"
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
                "type '{name}': unknown unit '{unit}'; use one of {} (units of a linear axis)",
                known.join(", ")
            )
        })
    }
}
