//! What the firmware keeps that needs no board: the measure of its ticks and its hand-overs.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod timing;
