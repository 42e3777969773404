//! Two-sided loops of one axis: the real controllers and links, with plants of a test's own.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use dimsart_core::DataType;
use hil_sim::experiment::Experiment;
use hil_sim::plant::{Axis, AxisWise, DeviceParameters, Environment, Law, Role};
use hil_sim::rig::Rig;
use hil_sim::scenario::Scenario;

/// Sample period of both controllers, `s`.
pub(crate) const TICK_S: f64 = 1e-3;
/// Index of the operator's station in a rig.
pub(crate) const MASTER: usize = 0;
/// Index of the remote station in a rig.
pub(crate) const SLAVE: usize = 1;

/// The shipped scenario with one axis and `settings` over it, such as `wave.form=split link.loss=0.1`.
pub(crate) fn scenario(settings: &str) -> Scenario {
    let settings = ["dof=1"].into_iter().chain(settings.split_whitespace());
    Scenario::load(None, &settings.map(str::to_owned).collect::<Vec<_>>()).unwrap()
}

/// The rig of a [`scenario`], moving these axes instead of the scenario's own.
pub(crate) fn rig(settings: &str, master: Axis, slave: Axis) -> Rig {
    let mut experiment = Experiment::new(&scenario(settings)).unwrap();
    for (station, axis) in experiment.rig_mut().stations_mut().iter_mut().zip([master, slave]) {
        station.plant = Box::new(AxisWise::new(vec![axis]));
    }
    std::mem::replace(experiment.rig_mut(), Rig::new(TICK_S))
}

/// Settings that delay the waves by exactly so many ticks, on a link that adds as little as it can: none
/// to the slave, which is stepped after the master, one back.
pub(crate) fn delays(forward_ticks: u32, backward_ticks: u32) -> String {
    let behind_link_ticks = backward_ticks - 1;
    format!(
        "link.forward_delay_ticks=0 link.backward_delay_ticks=1 \
         master.time_delay_ticks={forward_ticks} slave.time_delay_ticks={behind_link_ticks}"
    )
}

/// A mass with a damper to ground, at rest at 0, and what else acts on it.
pub(crate) fn axis(mass_kg: f64, damping_ns_per_m: f64, environments: Vec<Box<dyn Environment>>) -> Axis {
    let device = DeviceParameters { mass_kg, damping_ns_per_m, ..DeviceParameters::default() };
    Axis::new(&device, None, environments).unwrap()
}

/// A massless hand that pushes with a force of time, held for each tick.
pub(crate) fn push(force_n: impl Fn(f64) -> f64 + Send + 'static) -> Box<dyn Environment> {
    Box::new(Push { script: force_n, now_n: 0.0 })
}

struct Push<F> {
    /// From the start of a tick, `s`, to the force in it, `N`.
    script: F,
    now_n: f64,
}

impl<F> std::fmt::Debug for Push<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Push").field("now_n", &self.now_n).finish_non_exhaustive()
    }
}

impl<F: Fn(f64) -> f64 + Send> Environment for Push<F> {
    fn role(&self) -> Role {
        Role::Hand
    }

    fn begin_period(&mut self, start_s: f64, _period_s: f64) {
        self.now_n = (self.script)(start_s);
    }

    fn law(&self, _elapsed_s: f64, _position_m: f64, _velocity_m_per_s: f64) -> Law {
        Law { force_n: self.now_n, ..Law::default() }
    }
}

/// What a signal of one station is in the present tick.
pub(crate) fn signal(rig: &Rig, side: usize, data_type: &DataType) -> f64 {
    let data_base = rig.stations()[side].dimsart.engine().data_base();
    let slot = data_base.slot(data_type.first()).unwrap_or_else(|| panic!("no {} there", data_type.name));
    f64::from(f32::from_bits(data_base.words(slot)[0]))
}
