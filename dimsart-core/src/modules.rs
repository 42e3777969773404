//! The module library, one file per kind.

mod channel;
pub mod collision;
pub mod comm_rx;
pub mod comm_tx;
pub mod computed_torque;
pub mod denavit_hartenberg;
pub mod differentiator;
mod dynamics;
pub mod gravity;
pub mod integrator;
pub mod inverse;
pub mod normalizer;
pub mod p;
pub mod pd;
pub mod phantom;
pub mod pid;
pub mod planar;
mod reception;
pub mod recorder;
pub mod signal_generator;
pub mod sum;
pub mod time_delay;
pub mod tip;
pub mod velocity_to_position;
pub mod virtual_wall;
pub mod wave_impedance;
mod wave_integral;
pub mod wave_transformer;

use crate::{Kind, ModuleList};

pub use collision::Collision;
pub use comm_rx::CommRx;
pub use comm_tx::CommTx;
pub use computed_torque::ComputedTorque;
pub use denavit_hartenberg::DenavitHartenberg;
pub use differentiator::Differentiator;
pub use gravity::GravityCompensation;
pub use integrator::Integrator;
pub use inverse::Inverse;
pub use normalizer::Normalizer;
pub use p::P;
pub use pd::Pd;
pub use phantom::{Phantom, PhantomChain};
pub use pid::Pid;
pub use planar::{Planar, PlanarChain};
pub use recorder::Recorder;
pub use signal_generator::SignalGenerator;
pub use sum::Sum;
pub use time_delay::TimeDelay;
pub use tip::Tip;
pub use velocity_to_position::VelocityToPosition;
pub use virtual_wall::VirtualWall;
pub use wave_impedance::WaveImpedance;
pub use wave_transformer::WaveTransformer;

include!(concat!(env!("OUT_DIR"), "/own_modules.rs"));

/// Every module there is: those of the [library](Library), and behind them those of a project of one's own, whose list the
/// build finds by `DIMSART_MODULES`.
#[derive(Debug)]
pub enum Standard {}

impl ModuleList for Standard {
    const KINDS: &'static [&'static Kind] = &ALL;
}

#[expect(clippy::indexing_slicing, reason = "of a constant: out of bounds is an error of the build")]
const ALL: [&Kind; Library::KINDS.len() + OWN.len()] = {
    let mut all = [Library::KINDS[0]; Library::KINDS.len() + OWN.len()];
    let mut place = 0;
    while place < all.len() {
        all[place] = match place.checked_sub(Library::KINDS.len()) {
            Some(own) => OWN[own],
            None => Library::KINDS[place],
        };
        place += 1;
    }
    all
};

crate::module_list! {
    /// Every module of the library. A new one is a file above and a line here, with the feature that leaves it out of
    /// an image. P and the generator stay: with them the costs of an image are worked out.
    pub enum Library {
        CommRx(CommRx) if "teleoperation",
        CommTx(CommTx) if "teleoperation",
        WaveTransformer(WaveTransformer) if "teleoperation",
        WaveImpedance(WaveImpedance) if "teleoperation",
        TimeDelay(TimeDelay) if "teleoperation",
        P(P),
        Pd(Pd) if "control",
        Pid(Pid) if "control",
        VirtualWall(VirtualWall) if "control",
        Sum(Sum) if "signals",
        Normalizer(Normalizer) if "signals",
        Integrator(Integrator) if "signals",
        Differentiator(Differentiator) if "signals",
        VelocityToPosition(VelocityToPosition) if "signals",
        SignalGenerator(SignalGenerator),
        Recorder(Recorder) if "signals",
        PhantomTip(Tip<PhantomChain>) if "robots",
        PlanarTip(Tip<PlanarChain>) if "robots",
        DenavitHartenbergTip(Tip<DenavitHartenberg>) if "robots",
        PhantomInverse(Inverse<Phantom>) if "robots",
        PlanarInverse(Inverse<Planar>) if "robots",
        PhantomGravity(GravityCompensation<Phantom>) if "robots",
        PlanarGravity(GravityCompensation<Planar>) if "robots",
        PhantomTorque(ComputedTorque<Phantom>) if "robots",
        PlanarTorque(ComputedTorque<Planar>) if "robots",
        PhantomCollision(Collision<Phantom>) if "robots",
        PlanarCollision(Collision<Planar>) if "robots",
    }
}
