//! Hardware in the loop on a host.
#![forbid(unsafe_code)]

pub mod energy;
pub mod link;
pub mod plant;
pub mod recorder;
pub mod recording;
pub mod report;
pub mod rig;
pub mod schemes;
pub mod tick_map;
