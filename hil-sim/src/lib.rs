//! Hardware in the loop on a host.
#![forbid(unsafe_code)]

pub mod recording;
pub mod scenario;
