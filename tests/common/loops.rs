//! Two-sided loops of one axis: real controllers and links with plants defined by a test.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

use dimsart_core::DataType;
use hil_sim::experiment::Experiment;
use hil_sim::plant::{ExternalForce, Joint, JointParameters, Joints, StopsParameters};
use hil_sim::rig::Rig;
use hil_sim::rig_file::{RIGID_STIFFNESS, RigFile};

/// Sample period of both controllers, `s`.
pub(crate) const TICK_S: f64 = 1e-3;
/// Index of the operator's station in a rig.
pub(crate) const MASTER: usize = 0;
/// Index of the remote station in a rig.
pub(crate) const SLAVE: usize = 1;

/// The shipped experiment with one axis and `settings`, such as `wave.form=split link.loss=0.1`.
pub(crate) fn bilateral(settings: &str) -> RigFile {
    let settings = ["dof=1"].into_iter().chain(settings.split_whitespace());
    RigFile::from_shipped("bilateral", &settings.map(str::to_owned).collect::<Vec<_>>()).unwrap()
}

/// The rig of [`bilateral`] with these axes.
pub(crate) fn rig(settings: &str, master: Axis, slave: Axis) -> Rig {
    let mut experiment = Experiment::new(&bilateral(settings)).unwrap();
    for (station, axis) in experiment.rig_mut().stations_mut().iter_mut().zip([master, slave]) {
        station.plant = Box::new(Joints::new(vec![axis]));
    }
    std::mem::replace(experiment.rig_mut(), Rig::new(TICK_S))
}

/// Settings that delay the waves by exactly these ticks, on a link with its minimum delay: none to the slave,
/// which is stepped after the master, one tick back.
pub(crate) fn delays(forward_ticks: u32, backward_ticks: u32) -> String {
    let behind_link_ticks = backward_ticks - 1;
    format!(
        "link.forward_delay_ticks=0 link.backward_delay_ticks=1 \
         master.time_delay_ticks={forward_ticks} slave.time_delay_ticks={behind_link_ticks}"
    )
}

/// A moving mass and the external force on it.
pub(crate) type Axis = (Joint, Option<ExternalForce>);

/// The environment of an axis; some test programs use only a part.
#[allow(dead_code, reason = "shared by programs of tests")]
#[derive(Clone, Copy)]
pub(crate) enum Met {
    Nothing,
    /// A spring at 0 in both directions, `N/m`.
    Spring(f64),
    /// A wall: surface in `m`, stiffness in `N/m`, damping in `N s/m`.
    Wall(f64, f64, f64),
}

/// A mass with a damper to ground, at rest at 0, with its environment and external force.
pub(crate) fn axis(mass_kg: f64, damping_n_s_per_m: f64, met: Met, push: Option<ExternalForce>) -> Axis {
    let mut joint = JointParameters::of_inertia(mass_kg);
    joint.load.damping = damping_n_s_per_m;
    match met {
        Met::Nothing => {}
        Met::Spring(stiffness) => joint.load.stiffness = stiffness,
        Met::Wall(max, stiffness, damping) => {
            let stiffness = stiffness.min(RIGID_STIFFNESS);
            joint.stops = Some(StopsParameters { max, stiffness, damping, ..StopsParameters::default() });
        }
    }
    (joint.build().unwrap(), push)
}

/// A force as a function of time, held during each tick.
pub(crate) fn push(force_n: impl Fn(f64) -> f64 + Send + 'static) -> Option<ExternalForce> {
    Some(Box::new(force_n))
}

/// Returns a signal of a station in the current tick.
pub(crate) fn signal(rig: &Rig, side: usize, data_type: &DataType) -> f64 {
    let data_base = rig.stations()[side].dimsart.engine().data_base();
    let slot = data_base.slot(data_type.first()).unwrap_or_else(|| panic!("no {} there", data_type.name));
    f64::from(f32::from_bits(data_base.words(slot)[0]))
}
