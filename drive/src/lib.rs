//! Field-oriented torque control of a three-phase motor with protection, run once per PWM period below the tick of a
//! joint controller.
//!
//! ```text
//!   phase currents ─▶ Clarke ─▶ Park ─▶ CurrentController ─▶ inverse Park ─▶ space vector ─▶ duty cycles
//!   encoder ─▶ Tracking ──angle, speed──┴────────────────────────┘                │
//!   torque of the tick ─▶ current reference                                       │
//!   all measurements ─▶ Protection ─────────────────── off, in the same period ───┘
//! ```
//! [`Drive::step`] runs this chain. The crate uses no registers, clock or random source: the board passes a [`Sample`]
//! of its converters and writes the [`Duties`] to its timer. Results are therefore bit-identical on a host with
//! `hil_sim`'s motor model and on a chip.
//!
//! ```
//! # const MOTOR: drive::Motor = drive::Motor {
//! #     resistance_ohm: 0.3, direct_inductance_h: 3e-4, quadrature_inductance_h: 3e-4, flux_linkage_vs: 0.008,
//! #     pole_pairs: 10, is_encoder_reversed: false, encoder_offset_rad: 0.0,
//! # };
//! # const LIMITS: drive::Limits = drive::Limits {
//! #     current_a: 20.0, trip_current_a: 30.0, min_bus_v: 18.0, max_bus_v: 30.0, derating_c: 80.0, trip_c: 100.0,
//! #     speed_rad_per_s: 400.0, stall_s: 2.0,
//! # };
//! use drive::{Angle, Configuration, Drive, Encoder, Inverter, Joint, Rotor, Sample};
//!
//! let mut drive = Drive::new(&Configuration {
//!     motor: MOTOR,
//!     limits: LIMITS,
//!     bandwidth_rad_per_s: 6283.0,
//!     aligning_current_a: 5.0,
//!     encoder: Encoder::Incremental { counts_per_turn: 4_096 },
//!     joint: Joint { gear_ratio: 1.0, zero_rad: 0.0 },
//!     inverter: Inverter { period_s: 50e-6, dead_time_share: 0.02, dead_time_current_a: 0.2, max_duty: 0.95 },
//! })?;
//! // Once per period, with the sample and the torque commanded by the tick.
//! let rotor = Rotor::Angle(Angle::from_counts(1_000, 4_096));
//! let sample = Sample { phase_a: [0.0; 3], bus_v: 24.0, temperature_c: 25.0, rotor };
//! for _ in 0..100 {
//!     match drive.step(&sample, Some(0.5)) {
//!         Some(duties) => assert!(duties.iter().all(|duty| (0.0..=1.0).contains(duty))),
//!         // Open all six switches: the observer settles, or there is a fault.
//!         None => assert_eq!(drive.fault(), None),
//!     }
//! }
//! # Ok::<(), drive::ConfigurationError>(())
//! ```
//! Drives with their own torque control are connected over a bus: a mjbots moteus with [`MoteusJoint`], whose messages
//! are [`MoteusFrame`] and [`MoteusState`], and a CiA 402 drive on `CANopen` with [`Cia402Joint`].
//!
//! Quantities are in SI units. Phases are amplitude-invariant: the length of a current vector is the peak of a phase
//! current. Positive `q` current produces positive torque.
#![no_std]
#![forbid(unsafe_code)]

mod agreement;
mod angle;
mod cia402;
mod configuration;
mod current_controller;
mod drive;
mod encoder;
mod identification;
mod joint_fault;
mod modulation;
mod moteus;
mod number;
mod protection;
mod reading;
mod sample;
mod tracking;
mod vector;
mod words;

pub use angle::Angle;
pub use cia402::{
    Cia402Abort, Cia402Command, Cia402Emergency, Cia402Frame, Cia402Host, Cia402Joint, Cia402JointFault,
    Cia402Node, Cia402Reading, Cia402Settings, Cia402State,
};
pub use configuration::{
    Configuration, ConfigurationError, Encoder, Inverter, Joint, Limits, Motor, ValidConfiguration,
};
pub use current_controller::CurrentController;
pub use drive::{Drive, Measured};
pub use encoder::{As5047p, As5600, Mt6701};
pub use identification::{Identification, IdentificationError, IdentificationStep, MotorEstimate};
pub use joint_fault::JointFault;
pub use modulation::{Duties, Modulation, SupplyRange};
pub use moteus::{
    MoteusAddress, MoteusFault, MoteusFrame, MoteusJoint, MoteusJointFault, MoteusMode, MoteusReading,
    MoteusReplyError, MoteusState,
};
pub use protection::Protection;
pub use reading::DriveReading;
pub use sample::{Rotor, Sample};
pub use tracking::AngleObserver;
pub use vector::{AlphaBeta, Dq, Rotation};
