//! The module library, one file per kind.

pub mod admittance;
mod anti_windup;
pub mod binary_noise;
pub mod biquad;
pub mod cascade;
mod channel;
pub mod chirp;
pub mod clutch;
pub mod cogging;
pub mod collision;
pub mod comm_rx;
pub mod comm_tx;
pub mod comparator;
pub mod computed_torque;
pub mod damper;
pub mod delayed_passivity;
pub mod demux;
pub mod denavit_hartenberg;
pub mod differentiator;
pub mod disturbance_observer;
mod dynamics;
mod energy_ledger;
pub mod energy_tank;
pub mod feed_forward;
mod filtered;
pub mod fixture;
pub mod four_channel;
pub mod friction;
pub mod gravity;
pub mod homing;
pub mod impedance;
pub mod integrator;
pub mod inverse;
pub mod joint_limit;
pub mod kalman;
mod lag;
pub mod lead_lag;
pub mod limit;
pub mod logic;
pub mod low_pass;
pub mod matched_wave_port;
pub mod minimum_jerk;
pub mod moving_average;
pub mod multisine;
pub mod mux;
pub mod normalizer;
pub mod notch;
pub mod online;
pub mod p;
pub mod passivity_controller;
pub mod pd;
pub mod phantom;
pub mod pi;
pub mod pid;
pub mod pid2;
pub mod planar;
mod reception;
pub mod recorder;
pub mod s_curve;
mod seven_segments;
pub mod shared_control;
pub mod signal_generator;
pub mod soft_limit;
pub mod state_feedback;
pub mod state_machine;
mod state_variable;
pub mod sum;
pub mod table;
mod take_over;
mod target;
pub mod time_delay;
pub mod tip;
pub mod trapezoid;
pub mod velocity_observer;
pub mod velocity_to_position;
pub mod via_points;
pub mod virtual_wall;
pub mod wave_drift;
pub mod wave_filter;
pub mod wave_impedance;
mod wave_integral;
pub mod wave_scaling;
pub mod wave_transformer;

use crate::Kinds;

pub use admittance::Admittance;
pub use binary_noise::BinaryNoise;
pub use biquad::Biquad;
pub use cascade::Cascade;
pub use chirp::Chirp;
pub use clutch::Clutch;
pub use cogging::Cogging;
pub use collision::Collision;
pub use comm_rx::CommRx;
pub use comm_tx::CommTx;
pub use comparator::Comparator;
pub use computed_torque::ComputedTorque;
pub use delayed_passivity::DelayedPassivity;
pub use demux::Demux;
pub use denavit_hartenberg::DenavitHartenberg;
pub use differentiator::Differentiator;
pub use disturbance_observer::DisturbanceObserver;
pub use energy_tank::EnergyTank;
pub use feed_forward::FeedForward;
pub use fixture::Fixture;
pub use four_channel::FourChannel;
pub use friction::Friction;
pub use gravity::GravityCompensation;
pub use homing::Homing;
pub use impedance::Impedance;
pub use integrator::Integrator;
pub use inverse::Inverse;
pub use joint_limit::JointLimit;
pub use kalman::Kalman;
pub use lead_lag::LeadLag;
pub use limit::Limit;
pub use logic::Logic;
pub use low_pass::LowPass;
pub use matched_wave_port::MatchedWavePort;
pub use minimum_jerk::MinimumJerk;
pub use moving_average::MovingAverage;
pub use multisine::Multisine;
pub use mux::Mux;
pub use normalizer::Normalizer;
pub use notch::Notch;
pub use online::Online;
pub use p::P;
pub use passivity_controller::PassivityController;
pub use pd::Pd;
pub use phantom::{Phantom, PhantomChain};
pub use pi::Pi;
pub use pid::Pid;
pub use pid2::Pid2;
pub use planar::{Planar, PlanarChain};
pub use recorder::Recorder;
pub use s_curve::SCurve;
pub use shared_control::SharedControl;
pub use signal_generator::SignalGenerator;
pub use soft_limit::SoftLimit;
pub use state_feedback::StateFeedback;
pub use state_machine::StateMachine;
pub use sum::Sum;
pub use table::Table;
pub use time_delay::TimeDelay;
pub use tip::Tip;
pub use trapezoid::Trapezoid;
pub use velocity_observer::VelocityObserver;
pub use velocity_to_position::VelocityToPosition;
pub use via_points::ViaPoints;
pub use virtual_wall::VirtualWall;
pub use wave_drift::WaveDrift;
pub use wave_filter::WaveFilter;
pub use wave_impedance::WaveImpedance;
pub use wave_scaling::WaveScaling;
pub use wave_transformer::WaveTransformer;

include!(concat!(env!("OUT_DIR"), "/own_modules.rs"));

/// All module kinds: the [library](LIBRARY), then the kinds of the project whose list `DIMSART_MODULES` names. Their code is
/// compiled once, with this crate.
#[cfg(feature = "summaries")]
pub static ALL: Kinds = IN_PLACE;

/// The same, compiled with the crate that names it: an image optimises it for size.
pub const IN_PLACE: Kinds = Kinds::new(&JOINED);

/// Number of kinds, up to the last one that the build has. A build with laws has all of them: the costs of their instructions follow
/// those of the kinds ([`stamp`](crate::stamp)).
#[expect(clippy::indexing_slicing, reason = "of a constant: out of bounds is an error of the build")]
const COUNT: usize = {
    let library = LIBRARY.list();
    let mut count = library.len() + OWN.list().len();
    while !cfg!(feature = "online") && OWN.list().is_empty() && !library[count - 1].is_there() {
        count -= 1;
    }
    count
};

#[expect(clippy::indexing_slicing, reason = "of a constant: out of bounds is an error of the build")]
const JOINED: [&crate::Kind; COUNT] = {
    let library = LIBRARY.list();
    let mut all = [library[0]; COUNT];
    let mut place: usize = 0;
    while place < all.len() {
        all[place] = match place.checked_sub(library.len()) {
            Some(own) => OWN.list()[own],
            None => library[place],
        };
        place += 1;
    }
    all
};

/// Every kind of the library. A new one is a file above and a line here, with the feature that leaves it out of an image. P and the
/// generator stay: the costs of an image are worked out with them.
pub const LIBRARY: Kinds = crate::kinds![
    CommRx: "teleoperation",
    CommTx: "teleoperation",
    WaveTransformer: "teleoperation",
    WaveImpedance: "teleoperation",
    TimeDelay: "teleoperation",
    P,
    Pd: "control",
    Pid: "control",
    VirtualWall: "control",
    Sum: "signals",
    Normalizer: "signals",
    Integrator: "signals",
    Differentiator: "signals",
    VelocityToPosition: "signals",
    SignalGenerator,
    Recorder: "signals",
    Pi: "joint-control",
    Pid2: "joint-control",
    Cascade: "joint-control",
    StateFeedback: "joint-control",
    LeadLag: "joint-control",
    Impedance: "joint-control",
    Admittance: "joint-control",
    DisturbanceObserver: "joint-control",
    FeedForward: "joint-control",
    Friction: "joint-control",
    Cogging: "joint-control",
    LowPass: "filters",
    Notch: "filters",
    Biquad: "filters",
    MovingAverage: "filters",
    VelocityObserver: "filters",
    Kalman: "filters",
    Online: "online",
    PassivityController: "energy",
    DelayedPassivity: "energy",
    EnergyTank: "energy",
    WaveFilter: "energy",
    MatchedWavePort: "energy",
    WaveDrift: "energy",
    WaveScaling: "energy",
    FourChannel: "energy",
    Clutch: "energy",
    SharedControl: "energy",
    Tip<PhantomChain>: "robots",
    Tip<PlanarChain>: "robots",
    Tip<DenavitHartenberg>: "robots",
    Inverse<Phantom>: "robots",
    Inverse<Planar>: "robots",
    GravityCompensation<Phantom>: "robots",
    GravityCompensation<Planar>: "robots",
    ComputedTorque<Phantom>: "robots",
    ComputedTorque<Planar>: "robots",
    Collision<Phantom>: "robots",
    Collision<Planar>: "robots",
    Trapezoid: "trajectories",
    SCurve: "trajectories",
    MinimumJerk: "trajectories",
    ViaPoints: "trajectories",
    Chirp: "trajectories",
    Multisine: "trajectories",
    BinaryNoise: "trajectories",
    Limit: "limits",
    JointLimit: "limits",
    SoftLimit: "limits",
    Fixture: "limits",
    Homing: "limits",
    Mux: "logic",
    Demux: "logic",
    Comparator: "logic",
    Logic: "logic",
    StateMachine: "logic",
    Table: "logic",
];
