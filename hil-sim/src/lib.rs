//! Hardware in the loop on a host.
#![forbid(unsafe_code)]

pub mod link;
pub mod plant;
pub mod recording;
pub mod report;
pub mod rig;
pub mod schemes;
