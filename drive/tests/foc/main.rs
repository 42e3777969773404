//! A drive against the simulator's motor: bandwidth, torque, limits, protection.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::cast_possible_truncation,
    reason = "in helpers of tests as in tests; what a board has is f32"
)]

mod alignment;
mod bandwidth;
mod bench;
mod identification;
mod machine_code;
mod protection;
mod torque;
