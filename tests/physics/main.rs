//! The two-sided system against the closed forms of wave-variable teleoperation.
//!
//! Everything but hands and devices is what ships: schemes, modules, engine, packets, links.

mod chatter;
mod energy;
mod growth;
#[path = "../common/loops.rs"]
mod loops;
mod lossy_link;
mod motion;
mod perceived_stiffness;
mod rounding;
mod stability;
