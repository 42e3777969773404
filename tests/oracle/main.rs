//! Modules and plants against outside implementations: scipy, python-control, `MuJoCo`, closed forms.
//!
//! `cargo xtask test` has the reference runs written by the Python scripts beside these files, and says in `DIMSART_ORACLE`
//! where they are; `cargo xtask step oracle` draws what was compared.
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
