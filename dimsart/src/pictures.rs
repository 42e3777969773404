//! The pictures of runs: what is drawn of a bilateral one, and of a rig's.

pub mod bilateral;
pub mod response;
