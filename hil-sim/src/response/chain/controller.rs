//! What a scheme makes of one side's controller.

use dimsart_core::{Accepts, Engine, ModuleRef, Value};

use super::delay;
use crate::rig::SimulatedDimsart;

pub(crate) type SimulatedEngine = Engine;

/// One end of the line. [`default`](Default::default) is one of which nothing is known.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Controller {
    /// `K_PARAM` of `PDCTRL_MOD` by axis, `N/m`; empty without one.
    pub stiffness_n_per_m: Vec<f64>,
    /// `B_PARAM` of `WTRANSF_MOD`, `N s/m`; none without one.
    pub impedance_ns_per_m: Option<f64>,
    /// Samples that the scheme adds between the link and what its signals come from and go to, both ways: by delay
    /// modules, packets that are not sent in every tick, and play-out.
    pub delay_ticks: Option<u32>,
    /// From one packet that it sends to the next, ticks; 0 where it is not known.
    pub every_ticks: u32,
    /// Of those, what the receiver adds to even out jitter: `PLAYOUT_TICKS`, where the policy uses it.
    pub playout_ticks: u32,
    /// The policy of its receiver, where that gives out less than was sent when a packet is missing: `ZERO`, and `LIMITED`
    /// without play-out. Displacement is then lost for good.
    pub losing_policy: Option<&'static str>,
}

impl Controller {
    /// Reads what a scheme has set; the controller need never have ticked.
    pub fn read(dimsart: &mut SimulatedDimsart) -> Self {
        let delay_ticks = Some(delay::delay_ticks(dimsart));
        let engine = dimsart.engine_mut();
        let playout_ticks = delay::playout_ticks(engine);
        let dof = u8::try_from(engine.device().dof()).unwrap_or(u8::MAX);
        let stiffness = |axis| real(engine, "PDCTRL_MOD", "K_PARAM", axis);
        Self {
            stiffness_n_per_m: (0..dof).map_while(stiffness).collect(),
            impedance_ns_per_m: real(engine, "WTRANSF_MOD", "B_PARAM", 0),
            delay_ticks,
            every_ticks: delay::every_ticks(engine),
            playout_ticks,
            losing_policy: delay::policy(engine)
                .filter(|policy| *policy == "ZERO" || (*policy == "LIMITED" && playout_ticks == 0)),
        }
    }
}

/// A real parameter of a module, if the scheme plugs the module in.
pub(crate) fn real(engine: &mut SimulatedEngine, module: &str, parameter: &str, axis: u8) -> Option<f64> {
    match value(engine, ModuleRef::new(module, 1), parameter, axis)? {
        Value::Real(value) => Some(f64::from(value)),
        _ => None,
    }
}

/// A whole parameter of a module, if the scheme plugs the module in.
pub(super) fn count(engine: &mut SimulatedEngine, module: ModuleRef, parameter: &str) -> Option<u32> {
    match value(engine, module, parameter, 0)? {
        Value::Count(value) => Some(value),
        _ => None,
    }
}

/// A choice of a module by its name, if the scheme plugs the module in.
pub(crate) fn chosen(engine: &mut SimulatedEngine, module: &str, parameter: &str) -> Option<&'static str> {
    choice(engine, ModuleRef::new(module, 1), parameter)
}

/// A choice among names, if the scheme plugs the module in.
pub(super) fn choice(
    engine: &mut SimulatedEngine,
    module: ModuleRef,
    parameter: &str,
) -> Option<&'static str> {
    let place = match value(engine, module, parameter, 0)? {
        Value::Choice(place) => place,
        _ => return None,
    };
    let index = engine.kinds().parameter(module.kind, parameter)?;
    match engine.kinds().describe_parameter(module.kind, index)?.accepts {
        Accepts::Choice(names) => names.get(usize::from(place)).copied(),
        _ => None,
    }
}

fn value(engine: &mut SimulatedEngine, module: ModuleRef, parameter: &str, axis: u8) -> Option<Value> {
    let parameter = engine.kinds().parameter(module.kind, parameter)?;
    if !engine.is_plugged_in(module) {
        return None;
    }
    engine.get(module, parameter, axis).ok()
}
