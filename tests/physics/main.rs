//! The two-sided system against the closed forms of wave-variable teleoperation.
//!
//! Everything but hands and devices is what ships: schemes, modules, engine, packets, links.

mod chatter;
mod energy;
mod growth;
#[path = "../common/loops.rs"]
mod loops;
mod lossy_link;
mod matched_line;
mod motion;
mod perceived_stiffness;
mod port;
mod rounding;
mod stability;
mod virtual_wall;
