//! What a tick takes: from the image, bit by bit as the host, and never more than the bound.
//!
//! Without an image of a board these tests run nothing and a line says so; where `DIMSART_FIRMWARE` names a folder of
//! images, they have to be there.
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
