//! Cycles of a tick from the image: bit-identical to the host, and never above the bound.
//!
//! Without an image of a board these tests are skipped with a note; if `DIMSART_FIRMWARE` names a folder of images, missing
//! images are failures.
#![expect(clippy::unwrap_used, clippy::panic, reason = "in helpers of tests as in tests")]

mod admission;
mod bounds;
mod ccm;
mod command;
mod common;
mod kinds;
mod laws;
mod memory;
mod reached;
