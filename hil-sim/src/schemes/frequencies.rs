//! Checks filters for frequencies too high for the rate of their module, which a board limits silently.

use dimsart_core::{Engine, ModuleRef, Value, Vocabulary as _};

/// Modules that use Tustin's rule, and their maximum frequency as a share of their rate.
const KINDS: [&str; 2] = ["NOTCH_MOD", "LOWPASS_MOD"];
const MAX_SHARE: f64 = 0.49;

/// Returns a fault for each frequency of a plugged-in filter above its maximum.
pub(super) fn too_high(engine: &mut Engine) -> Vec<String> {
    let kinds = KINDS.map(|name| engine.find_module(name).map(|module| module.kind));
    let filters: Vec<ModuleRef> = engine
        .instances()
        .filter(|module| kinds.contains(&Some(module.kind)) && engine.is_plugged_in(*module))
        .collect();
    filters.into_iter().flat_map(|module| of_module(engine, module)).collect()
}

fn of_module(engine: &mut Engine, module: ModuleRef) -> Vec<String> {
    // A first-order low-pass has no maximum.
    if value(engine, module, "ORDER", 0) == Some(Value::Choice(0)) {
        return Vec::new();
    }
    let every_ticks = engine.module_rate(module).map_or(1, |rate| rate.every_ticks);
    let max_hz = MAX_SHARE / (f64::from(engine.device().sample_period_s()) * f64::from(every_ticks));
    let axes = u8::try_from(engine.device().dof()).unwrap_or(u8::MAX);
    let fault = |axis: u8| {
        let Some(Value::Real(frequency_hz)) = value(engine, module, "FREQUENCY", axis) else { return None };
        // The maximum rounded to `f32` is allowed.
        (f64::from(frequency_hz) > max_hz * (1.0 + 1e-6)).then(|| {
            let remedy = if every_ticks > 1 { "lower FREQUENCY or EVERY_TICKS" } else { "lower FREQUENCY" };
            format!(
                "FREQUENCY[{axis}] of {} is {frequency_hz} Hz, above 0.49 × module rate = {max_hz:.1} Hz: {remedy}",
                engine.module_name(module)
            )
        })
    };
    (0..axes).filter_map(fault).collect()
}

/// Finds a parameter by name; `None` if missing.
fn value(engine: &mut Engine, module: ModuleRef, name: &str, place: u8) -> Option<Value> {
    let (parameter, _) = engine.find_parameter(module.kind, name)?;
    engine.get(module, parameter, place).ok()
}
