//! Hardware in the loop on a host.
#![forbid(unsafe_code)]

pub mod plant;
pub mod recording;
