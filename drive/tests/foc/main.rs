//! Drive with the simulator's motor model: bandwidth, torque, limits, protection.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::cast_possible_truncation,
    reason = "test helpers; boards use f32"
)]

mod alignment;
mod bandwidth;
mod bench;
mod identification;
mod machine_code;
mod protection;
mod torque;
