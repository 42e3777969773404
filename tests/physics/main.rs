//! The two-sided system compared with closed forms of wave-variable teleoperation.
//!
//! Schemes, modules, engine, packets and links are the shipped ones; hands and devices are simplified.

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
