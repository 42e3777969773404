//! Hardware in the loop on a host: the controllers that run on a board, against plants and links in software.
//!
//! A test of a control law is a rig and what must come of it:
//!
//! ```
//! use hil_sim::{response, rig_file::RigFile};
//!
//! let rig = r#"
//!     duration_s = 0.5
//!     device = [{ name = "joint", measures = ["POSITION", "DES_POSITION"], axis = [{ plant.load.inertia = 0.02 }] }]
//!     controller = [{ device = "joint", scheme = "builtin:joint" }]
//!     experiment.move = [{ device = "joint", on = "DES_POSITION", step = { at_s = 0.1, size = 0.5 } }]
//! "#;
//! let outcome = response::run(&RigFile::read(rig, "my rig", "".into(), &[])?)?.outcome;
//! assert!(outcome.stable && outcome.axes[0].loop_figures.is_some_and(|figures| figures.bandwidth_hz > Some(5.0)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A scenario file becomes an experiment, an experiment a rig that is stepped tick by tick, and what the rig did
//! becomes a recording, a handful of figures and a report:
//!
//! ```text
//!  scenarios/*.toml        schemes/*.scheme
//!        │                        │
//!        ▼                        ▼
//!     Scenario ────────▶ Experiment (Chain, Phases) ──▶ Rig: one virtual time for all of it
//!                            │           ├─ Station "master": controller ◀─▶ Plant (device, motor, hand)
//!                            │           ├─ Station "slave":  controller ◀─▶ Plant (device, motor, wall)
//!                            │           │    (a controller here, or as firmware on an emulated board)
//!                            │           └─ Link per direction: in this process, or UDP to another one
//!                            │
//!                            │  every tick: Recorder, ChannelEnergy, PerceivedStiffness, RoundTrips, Watch look on
//!                            ▼
//!                 Run { Recording, Outcome, Rig } ──▶ reports and pictures: the crate `dimsart`
//! ```
//!
//! A rig file becomes an experiment of any devices, controllers and links ([`rig_file`], [`response`]); it shares rig and
//! recorder with the bilateral one above.
//!
//! Data flows one way: what looks on never changes the rig, and nothing but the rig knows the order of a step. The
//! same scenario and seed give the same bits on every machine (`tests/bits.rs`); only a run of one side keeps step
//! with the clock ([`pace`]).
//!
//! # What to add where
//!
//! | To add | Write | Register it |
//! |---|---|---|
//! | an environment, such as a wall | a file in [`plant`] | a line in `plant.rs`, its keys in `scenarios/bilateral.toml` |
//! | a plant of another kind | a file in [`plant`] that implements [`Plant`](plant::Plant) | a line in `bilateral/station.rs` |
//! | a part of a joint | a file in `plant/joint/` | a field of [`JointParameters`](plant::JointParameters) |
//! | a form of a move | a field of [`MoveSection`](rig_file::MoveSection) | a case in `response/motion.rs` |
//! | a shipped rig | a file in `scenarios/` | a line in [`rig_file::SHIPPED`] |
//! | a link | a file in [`link`] that implements [`Link`](link::Link) | where the experiment connects stations |
//! | a medium | a file in [`bus`], its link in [`link`] | a line in `link/carrier.rs`, its section in `scenario/carrier.rs` |
//! | a setting | a field in [`scenario`] | a line with its meaning in `scenarios/bilateral.toml`, its range in `range.rs` |
//! | a scheme | a file in `schemes/` | a line in [`schemes::BUILT_IN`], if it is to come with the command |
//! | a figure of a run | what measures it, stepped in [`bilateral`] | a field of [`Outcome`](outcome::Outcome), a row of the summary |
//!
//! A control law is no part of this crate: it is a module of `dimsart_core`, and `dimsart new-module` writes one.
//!
//! ```
//! use hil_sim::bilateral::Experiment;
//! use hil_sim::scenario::Scenario;
//! use std::sync::atomic::AtomicBool;
//!
//! let scenario = Scenario::load(None, &["duration_s=0.5".to_owned()])?;
//! let run = Experiment::new(&scenario)?.run(&AtomicBool::new(false), |_time_s| {});
//! assert!(run.outcome.stable && run.outcome.ticks == 500);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod bilateral;
pub mod bus;
pub mod bus_plan;
pub mod clock;
pub mod emulated;
pub mod first_packet;
pub mod foreign_text;
pub mod growth;
pub mod identify;
pub mod key_file;
pub mod law;
pub mod limit_cycle;
pub mod link;
pub mod meeting;
pub mod outcome;
pub mod pace;
pub mod pipe;
pub mod plant;
pub mod port_energy;
mod reception;
pub mod recorder;
pub mod recording;
pub mod response;
pub mod rig;
pub mod rig_file;
pub mod scenario;
pub mod schemes;
mod settled_contact;
pub mod watch;

/// The page whose lines of Rust are tests of this crate.
#[cfg(doctest)]
#[doc = include_str!("../../docs/howto/test-a-rig.md")]
struct TestARig;
