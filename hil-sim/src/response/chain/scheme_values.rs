//! Parameters of the modules of a loaded scheme.

use dimsart_core::{Engine, ModuleRef, ParameterType, Value};

/// Reads a real parameter of a plugged-in module.
pub(crate) fn real(engine: &mut Engine, module: &str, parameter: &str, axis: u8) -> Option<f64> {
    match value(engine, ModuleRef::new(module, 1), parameter, axis)? {
        Value::Real(value) => Some(f64::from(value)),
        _ => None,
    }
}

/// Reads an integer parameter of a plugged-in module.
pub(super) fn count(engine: &mut Engine, module: ModuleRef, parameter: &str) -> Option<u32> {
    match value(engine, module, parameter, 0)? {
        Value::Count(value) => Some(value),
        _ => None,
    }
}

/// Reads a choice of a plugged-in module, by name.
pub(crate) fn chosen(engine: &mut Engine, module: &str, parameter: &str) -> Option<&'static str> {
    choice(engine, ModuleRef::new(module, 1), parameter)
}

/// Reads a choice of a plugged-in module, among names.
pub(super) fn choice(engine: &mut Engine, module: ModuleRef, parameter: &str) -> Option<&'static str> {
    let place = match value(engine, module, parameter, 0)? {
        Value::Choice(place) => place,
        _ => return None,
    };
    let index = engine.kinds().parameter(module.kind, parameter)?;
    match engine.kinds().describe_parameter(module.kind, index)?.accepts {
        ParameterType::Choice(names) => names.get(usize::from(place)).copied(),
        _ => None,
    }
}

fn value(engine: &mut Engine, module: ModuleRef, parameter: &str, axis: u8) -> Option<Value> {
    let parameter = engine.kinds().parameter(module.kind, parameter)?;
    if !engine.is_plugged_in(module) {
        return None;
    }
    engine.get(module, parameter, axis).ok()
}
