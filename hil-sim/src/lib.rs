//! Hardware-in-the-loop simulation on a host: the controllers of the boards with simulated plants and links.
//!
//! A test of a control law runs a rig and checks its outcome:
//!
//! ```
//! use hil_sim::{experiment, rig_file::RigFile};
//!
//! let rig = r#"
//!     duration_s = 0.5
//!     device = [{ name = "joint", measures = ["POSITION", "DES_POSITION"], axis = [{ plant.load.inertia = 0.02 }] }]
//!     controller = [{ device = "joint", scheme = "builtin:joint" }]
//!     experiment.move = [{ device = "joint", on = "DES_POSITION", step = { at_s = 0.1, amplitude = 0.5 } }]
//! "#;
//! let outcome = experiment::run(&RigFile::read(rig, "my rig", "".into(), &[])?)?.outcome;
//! assert!(outcome.stable && outcome.axes[0].loop_figures.is_some_and(|figures| figures.bandwidth_hz > Some(5.0)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! ```text
//!                                            every tick: Recorder and observers watch
//!  rig_file ──▶ response ──▶ experiment ──▶ Rig: one virtual time for all of it ──▶ Run { Outcome, Recording, Rig }
//!                                           ├─ Station: controller ◀─▶ Plant
//!                                           └─ Link: in this process, over a bus, or to another process
//! ```
//!
//! Data flows in one direction: observers never change the rig; only the rig defines the order of a step. The same
//! file and seed give bit-identical results on every machine (`tests/bits.rs`). Only a run of a single station is
//! synchronised with the clock ([`pace`]).
//!
//! # What to add where
//!
//! | To add | Write | Register it |
//! |---|---|---|
//! | a figure of a run | a file in [`observer`] | a field of [`Outcome`](outcome::Outcome), a line where experiments are made (`response.rs`), a row of the summary |
//! | an environment, such as a wall | a section of an axis in [`rig_file`] | what it does to a joint in `rig_file/environment.rs` |
//! | a plant of another kind | a file in [`plant`] | a variant of `Body` in `response/body.rs`, its section in `rig_file/device.rs` |
//! | a part of a joint | a file in `plant/joint/` | a field of [`JointParameters`](plant::JointParameters) |
//! | a form of a move | a field of [`MoveSection`](rig_file::MoveSection) | a case in `motion.rs` |
//! | a shipped rig | a file in `scenarios/` | a line in [`rig_file::SHIPPED`] |
//! | a link | a file in [`link`] that implements [`Link`](link::Link) | where the experiment connects stations |
//! | a medium | a file in [`bus`], its link in [`link`] | its section in `rig_file/media.rs`, a case in `link/buses.rs` |
//! | a setting | a field of a section in [`rig_file`] | a `[[parameter]]` of a shipped rig, if it is to have a short name |
//! | a scheme | a file in `schemes/` | a line in [`schemes::BUILT_IN`], if it is to come with the command |
//!
//! Control laws are modules of `dimsart_core`; `dimsart new-module` creates one.
//!
//! ```
//! use hil_sim::experiment;
//! use hil_sim::rig_file::RigFile;
//!
//! let run = experiment::run(&RigFile::from_shipped("bilateral", &["duration_s=0.5".to_owned()])?)?;
//! assert!(run.outcome.stable && run.outcome.ticks == 500);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

pub mod bus;
pub mod bus_plan;
pub mod clock;
pub mod emulated;
pub mod experiment;
pub mod first_packet;
pub mod identify;
pub mod key_file;
pub mod law;
pub mod link;
mod loop_figures;
mod motion;
pub mod observer;
pub mod outcome;
pub mod pace;
pub mod phases;
pub mod pipe;
pub mod plant;
pub mod recorder;
pub mod recording;
pub mod renamed_keys;
pub mod response;
pub mod rig;
pub mod rig_file;
pub mod schemes;
pub mod synchronisation;
pub mod untrusted_text;

/// Runs the Rust examples of the page as tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/howto/test-a-rig.md")]
struct TestARig;
