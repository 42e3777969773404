//! Control laws for DIMSART.
#![no_std]

pub mod modules;
