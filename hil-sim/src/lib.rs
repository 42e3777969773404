//! Hardware in the loop on a host.
#![forbid(unsafe_code)]

pub mod cli;
pub mod energy;
pub mod experiment;
pub mod felt;
pub mod link;
pub mod outcome;
pub mod pace;
pub mod pictures;
pub mod plant;
pub mod recorder;
pub mod recording;
pub mod report;
pub mod rig;
pub mod round_trips;
pub mod scenario;
pub mod schemes;
pub mod tick_map;
pub mod watch;
