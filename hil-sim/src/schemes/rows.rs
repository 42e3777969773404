//! Converts a controller's scheme to rows of text.

use dimsart_core::{Command, ModuleRef, ParameterShape, ParameterTypeDescription, Value, Vocabulary};

/// Returns the rows of these commands for `dest`, with these names; commands without a row are skipped.
///
/// Applied to a controller without modules, for a device of the same types, they build the same scheme; the last row
/// starts it.
#[must_use]
pub fn rows(commands: &[Command], dest: &str, names: &(impl Vocabulary + ?Sized)) -> String {
    let parts: Vec<[String; 3]> = commands.iter().filter_map(|command| parts(*command, names)).collect();
    let end = ["MOD_ENG".to_owned(), "MATCHING_CHECK".to_owned(), String::new()];
    let parts: Vec<[String; 3]> = parts.into_iter().chain([end]).collect();
    let width =
        |column: usize| parts.iter().map(|row| row.get(column).map_or(0, String::len)).max().unwrap_or(0);
    let (modules, commands) = (width(0), width(1));
    let line = |[module, command, value]: &[String; 3]| {
        format!("{dest}  {module:modules$}  {command:commands$}  {value}").trim_end().to_owned() + "\n"
    };
    parts.iter().map(line).collect()
}

/// Module, command and value of a row.
fn parts(command: Command, names: &(impl Vocabulary + ?Sized)) -> Option<[String; 3]> {
    let name = |module: ModuleRef| names.module_name(module).to_string();
    if let Command::Set { module, parameter, entry, value } = command {
        let text = names.parameter_text(module.kind, parameter)?;
        let place =
            entry.map_or_else(String::new, |entry| entry_text(text.entries, usize::from(entry), names.dof()));
        return Some([
            name(module),
            format!("{}{place}", text.name),
            value_text(value, &text.accepts, names),
        ]);
    }
    if let Command::Bind { module, port, signal } = command {
        let port = names.port_text(module, port)?;
        return Some([name(module), format!("PORT_{}", port.name), names.signal_name(signal).to_string()]);
    }
    let word = command.as_engine_command()?.name.to_owned();
    let module = match command {
        Command::PlugIn(module) | Command::InitModule(module) => name(module),
        _ => String::new(),
    };
    Some(["MOD_ENG".to_owned(), word, module])
}

/// Index of a parameter's entry in a row: `[2]`, or `[0][2]` of a matrix.
#[must_use]
pub fn entry_text(entries: ParameterShape, entry: usize, dof: u8) -> String {
    let (_, columns) = entries.size(dof);
    let columns = usize::from(columns);
    match (entry.checked_div(columns), entry.checked_rem(columns)) {
        (Some(row), Some(column)) if entries.is_matrix() => format!("[{row}][{column}]"),
        _ => format!("[{entry}]"),
    }
}

/// Formats a value for a row.
#[must_use]
pub fn value_text(
    value: Value,
    accepts: &ParameterTypeDescription<'_>,
    names: &(impl Vocabulary + ?Sized),
) -> String {
    match value {
        Value::Real(value) => value.to_string(),
        Value::Count(value) => value.to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Flag(value) => if value { "ON" } else { "OFF" }.to_owned(),
        Value::Choice(index) => match accepts {
            ParameterTypeDescription::Choice(names) => {
                names.get(usize::from(index)).map_or_else(String::new, ToString::to_string)
            }
            _ => index.to_string(),
        },
        Value::Type(signal) => names.signal_name(signal).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use dimsart_core::{
        AxisKind, DataTypeDescription, KindId, ParameterDescription, PortDescription, Unit, scheme,
    };

    use super::*;

    /// A controller whose only module has a matrix.
    struct WithMatrix;

    impl Vocabulary for WithMatrix {
        fn device_name(&self) -> &str {
            "arm"
        }

        fn axes(&self) -> &[AxisKind] {
            &[AxisKind::Rotary; 2]
        }

        fn kind_at(&self, place: u8) -> Option<&str> {
            (place == 0).then_some("MATRIX_MOD")
        }

        fn parameter_text(&self, _kind: KindId, index: u8) -> Option<ParameterDescription<'_>> {
            (index == 0).then_some(ParameterDescription {
                name: "K",
                unit: Unit::One,
                accepts: ParameterTypeDescription::Real { min: 0.0, max: 9.0 },
                entries: ParameterShape { rows: 0, columns: 3 },
                default: Some(Value::Real(0.0)),
                is_structural: false,
            })
        }

        fn port_text(&self, _module: ModuleRef, _index: u8) -> Option<PortDescription<'_>> {
            None
        }

        fn type_text(&self, _index: u16) -> Option<DataTypeDescription<'_>> {
            None
        }
    }

    #[test]
    fn an_element_of_a_matrix_is_read_as_it_is_written() {
        let module = ModuleRef::new("MATRIX_MOD", 1);
        let set = |entry| Command::Set { module, parameter: 0, entry, value: Value::Real(1.5) };
        let commands = [set(None), set(Some(0)), set(Some(5))];
        let text = rows(&commands, "all", &WithMatrix);
        assert!(text.contains("K[1][2]"), "{text}");
        let read: Vec<_> = scheme::rows(&text).map(|row| row.command(&WithMatrix).unwrap()).collect();
        assert_eq!(read[..3], commands);
    }
}
