//! DIMSART's module library, one file per module kind.
//!
//! Pass [`ALL`], or the groups needed, to [`Dimsart::new`](dimsart_core::Dimsart::new). To write your own kind, see
//! [`Module`](dimsart_core::Module).
//!
//! On *takeover*, a module replaces another one in the running scheme and continues from its last outputs without a
//! jump (bumpless transfer); otherwise it starts from its initial state.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

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
pub mod sequencer;
mod seven_segments;
pub mod shared_control;
pub mod signal_generator;
pub mod soft_limit;
pub mod state_feedback;
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

#[cfg(feature = "summaries")]
use dimsart_core::{KindId, ModuleKind, join_kinds};
use dimsart_core::{ModuleKinds, kinds};

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
pub use planar::{PlanarChain, PlanarDynamics};
pub use recorder::Recorder;
pub use s_curve::SCurve;
pub use sequencer::Sequencer;
pub use shared_control::SharedControl;
pub use signal_generator::SignalGenerator;
pub use soft_limit::SoftLimit;
pub use state_feedback::StateFeedback;
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

/// All module kinds of the library, of every [group](GROUPS). To add your own kinds:
/// `join_kinds![dimsart_modules::ALL, MY_LAWS]`.
///
/// The list refers to a static, so its code is compiled once, with this crate.
#[cfg(feature = "summaries")]
pub static ALL: ModuleKinds = ModuleKinds::new(const { &KINDS.each_ref() });

#[cfg(feature = "summaries")]
#[expect(clippy::indexing_slicing, reason = "constant evaluation: out of bounds fails the build")]
static KINDS: [ModuleKind; EVERY.len()] = {
    let (mut kinds, mut place) = ([*EVERY[0]; EVERY.len()], 0);
    while place < EVERY.len() {
        kinds[place] = *EVERY[place];
        place += 1;
    }
    kinds
};

#[cfg(feature = "summaries")]
const EVERY: &[&ModuleKind] = join_kinds![
    BASIC,
    CONTROL,
    JOINT_CONTROL,
    SIGNALS,
    FILTERS,
    TRAJECTORIES,
    LIMITS,
    LOGIC,
    ROBOTS,
    TELEOPERATION,
    ENERGY,
    ONLINE,
]
.list();

/// Groups of the library by name. To add a kind, add a file above and an entry in a group below.
///
/// Groups are constants, so that an image compiles only its own kinds, optimised for size.
pub const GROUPS: &[(&str, ModuleKinds)] = &[
    ("basic", BASIC),
    ("control", CONTROL),
    ("joint-control", JOINT_CONTROL),
    ("signals", SIGNALS),
    ("filters", FILTERS),
    ("trajectories", TRAJECTORIES),
    ("limits", LIMITS),
    ("logic", LOGIC),
    ("robots", ROBOTS),
    ("teleoperation", TELEOPERATION),
    ("energy", ENERGY),
    ("online", ONLINE),
];

/// Returns the group of a kind, or `None` for a project's own kind.
#[cfg(feature = "summaries")]
#[must_use]
pub fn group_of(kind: KindId) -> Option<&'static str> {
    GROUPS.iter().find(|(_, kinds)| kinds.kind(kind).is_some()).map(|(name, _)| *name)
}

/// P controller and signal generator.
pub const BASIC: ModuleKinds = kinds![P, SignalGenerator,];

/// PD, PID, virtual wall.
pub const CONTROL: ModuleKinds = kinds![Pd, Pid, VirtualWall,];

/// Joint controllers, state feedback, impedance, observers, feed-forward and compensation.
pub const JOINT_CONTROL: ModuleKinds = kinds![
    Pi,
    Pid2,
    Cascade,
    StateFeedback,
    LeadLag,
    Impedance,
    Admittance,
    DisturbanceObserver,
    FeedForward,
    Friction,
    Cogging,
];

/// Sum, normalizer, integrator, differentiator, velocity to position, recorder.
pub const SIGNALS: ModuleKinds =
    kinds![Sum, Normalizer, Integrator, Differentiator, VelocityToPosition, Recorder,];

/// Filters and velocity observers.
pub const FILTERS: ModuleKinds = kinds![LowPass, Notch, Biquad, MovingAverage, VelocityObserver, Kalman,];

/// Trajectories and excitation signals.
pub const TRAJECTORIES: ModuleKinds =
    kinds![Trapezoid, SCurve, MinimumJerk, ViaPoints, Chirp, Multisine, BinaryNoise,];

/// Limits of position, velocity and force, soft limits, fixtures, homing.
pub const LIMITS: ModuleKinds = kinds![Limit, JointLimit, SoftLimit, Fixture, Homing,];

/// Multiplexers, comparators, logic, sequencer, lookup table.
pub const LOGIC: ModuleKinds = kinds![Mux, Demux, Comparator, Logic, Sequencer, Table,];

/// Kinematics and dynamics of arms: tip coordinates, gravity, computed torque, collision detection.
pub const ROBOTS: ModuleKinds = kinds![
    Tip<PhantomChain>,
    Tip<PlanarChain>,
    Tip<DenavitHartenberg>,
    Inverse<Phantom>,
    Inverse<PlanarDynamics>,
    GravityCompensation<Phantom>,
    GravityCompensation<PlanarDynamics>,
    ComputedTorque<Phantom>,
    ComputedTorque<PlanarDynamics>,
    Collision<Phantom>,
    Collision<PlanarDynamics>,
];

/// Communication modules, wave transformer, wave impedance, time delay.
pub const TELEOPERATION: ModuleKinds = kinds![CommRx, CommTx, WaveTransformer, WaveImpedance, TimeDelay,];

/// Passivity controllers, energy tank, further wave modules, bilateral control.
pub const ENERGY: ModuleKinds = kinds![
    PassivityController,
    DelayedPassivity,
    EnergyTank,
    WaveFilter,
    MatchedWavePort,
    WaveDrift,
    WaveScaling,
    FourChannel,
    Clutch,
    SharedControl,
];

/// Control laws uploaded to a running controller.
pub const ONLINE: ModuleKinds = kinds![Online,];
