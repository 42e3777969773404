//! Parameters of one side of the chain, from its scheme.

use super::delay;
use super::scheme_values::real;
use crate::rig::SimulatedDimsart;

/// One side. [`default`](Default::default): all unknown.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Controller {
    /// `K_PARAM` of `PDCTRL_MOD` by axis, `N/m`; empty without the module.
    pub stiffness_n_per_m: Vec<f64>,
    /// `B_PARAM` of `WTRANSF_MOD`, `N s/m`; `None` without the module.
    pub impedance_n_s_per_m: Option<f64>,
    /// Samples added by the scheme between link and signals, both directions: delay modules, packets not sent in
    /// every tick, and play-out.
    pub delay_ticks: Option<u32>,
    /// Ticks per sent packet; 0 if unknown.
    pub every_ticks: u32,
    /// Play-out delay of the receiver (`PLAYOUT_TICKS`), if used by its policy.
    pub playout_ticks: u32,
    /// Policy of its receiver if missing packets lose displacement permanently: `ZERO`, and `LIMITED` without
    /// play-out.
    pub lossy_policy: Option<&'static str>,
}

impl Controller {
    /// Reads the parameters of a loaded scheme; the controller need not have run.
    pub fn read(dimsart: &mut SimulatedDimsart) -> Self {
        let delay_ticks = Some(delay::delay_ticks(dimsart));
        let engine = dimsart.engine_mut();
        let playout_ticks = delay::playout_ticks(engine);
        let dof = u8::try_from(engine.device().dof()).unwrap_or(u8::MAX);
        let stiffness = |axis| real(engine, "PDCTRL_MOD", "K_PARAM", axis);
        Self {
            stiffness_n_per_m: (0..dof).map_while(stiffness).collect(),
            impedance_n_s_per_m: real(engine, "WTRANSF_MOD", "B_PARAM", 0),
            delay_ticks,
            every_ticks: delay::every_ticks(engine),
            playout_ticks,
            lossy_policy: delay::policy(engine)
                .filter(|policy| *policy == "ZERO" || (*policy == "LIMITED" && playout_ticks == 0)),
        }
    }
}
