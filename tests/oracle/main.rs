//! Modules and plants compared with other implementations: scipy, python-control, `MuJoCo`, closed forms.
//!
//! `cargo xtask test` writes the reference runs with the Python scripts in this folder and sets
//! `DIMSART_ORACLE` to their folder; `cargo xtask step oracle` shows the comparisons.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod arm;
mod evidence;
mod joint;
#[path = "../common/loops.rs"]
mod loops;
mod modules;
mod phantom;
mod two_sided_loop;
