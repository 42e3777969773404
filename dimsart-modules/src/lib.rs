//! DIMSART's module library, one file per kind.
//!
//! [`ALL`] is the list of kinds to pass to [`Dimsart::new`](dimsart_core::Dimsart::new). Write a kind of your own as
//! [`Module`](dimsart_core::Module) shows.
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

#[cfg(feature = "summaries")]
use dimsart_core::{Kind, KindId, join_kinds};
use dimsart_core::{Kinds, kinds};

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

/// All module kinds of the library, those of every [group](GROUPS). A tool with laws of its own has both:
/// `join_kinds![dimsart_modules::ALL, MY_LAWS]`.
///
/// Their code is compiled once, with this crate: the list refers to a static. A list of constants is compiled where it is named.
#[cfg(feature = "summaries")]
pub static ALL: Kinds = Kinds::new(const { &KINDS.each_ref() });

#[cfg(feature = "summaries")]
#[expect(clippy::indexing_slicing, reason = "of a constant: out of bounds is an error of the build")]
static KINDS: [Kind; EVERY.len()] = {
    let (mut kinds, mut place) = ([*EVERY[0]; EVERY.len()], 0);
    while place < EVERY.len() {
        kinds[place] = *EVERY[place];
        place += 1;
    }
    kinds
};

#[cfg(feature = "summaries")]
const EVERY: &[&Kind] = join_kinds![
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

/// Every group of the library by name. A new kind is a file above and a line in a group below.
///
/// Lists are constants, so that an image compiles the functions of its kinds, optimised for size.
pub const GROUPS: &[(&str, Kinds)] = &[
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

/// The group of a kind; none for a project's own.
#[cfg(feature = "summaries")]
#[must_use]
pub fn group_of(kind: KindId) -> Option<&'static str> {
    GROUPS.iter().find(|(_, kinds)| kinds.kind(kind).is_some()).map(|(name, _)| *name)
}

/// P controller and signal generator.
pub const BASIC: Kinds = kinds![P, SignalGenerator,];

/// PD, PID, virtual wall.
pub const CONTROL: Kinds = kinds![Pd, Pid, VirtualWall,];

/// Controllers with two degrees of freedom, cascades, state feedback, impedance, feed-forward, compensation.
pub const JOINT_CONTROL: Kinds = kinds![
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
pub const SIGNALS: Kinds = kinds![Sum, Normalizer, Integrator, Differentiator, VelocityToPosition, Recorder,];

/// Filters and velocity observers.
pub const FILTERS: Kinds = kinds![LowPass, Notch, Biquad, MovingAverage, VelocityObserver, Kalman,];

/// Moves and excitation signals.
pub const TRAJECTORIES: Kinds =
    kinds![Trapezoid, SCurve, MinimumJerk, ViaPoints, Chirp, Multisine, BinaryNoise,];

/// Limits of position, velocity and force, soft walls, fixtures, homing.
pub const LIMITS: Kinds = kinds![Limit, JointLimit, SoftLimit, Fixture, Homing,];

/// Selection, comparison, logic, sequences, tables.
pub const LOGIC: Kinds = kinds![Mux, Demux, Comparator, Logic, StateMachine, Table,];

/// Kinematics and dynamics of arms: Cartesian coordinates, gravity, computed torque, collisions.
pub const ROBOTS: Kinds = kinds![
    Tip<PhantomChain>,
    Tip<PlanarChain>,
    Tip<DenavitHartenberg>,
    Inverse<Phantom>,
    Inverse<Planar>,
    GravityCompensation<Phantom>,
    GravityCompensation<Planar>,
    ComputedTorque<Phantom>,
    ComputedTorque<Planar>,
    Collision<Phantom>,
    Collision<Planar>,
];

/// Ends of a link, wave transformer, wave impedance, time delay.
pub const TELEOPERATION: Kinds = kinds![CommRx, CommTx, WaveTransformer, WaveImpedance, TimeDelay,];

/// Passivity observers and controllers, energy tanks, wave variables beyond the transformer.
pub const ENERGY: Kinds = kinds![
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

/// Control laws that are uploaded to a running controller.
pub const ONLINE: Kinds = kinds![Online,];
