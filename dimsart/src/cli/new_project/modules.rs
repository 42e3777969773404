//! The control laws of this project: `cargo dimsart new-module NAME` adds one.
//!
//! This file is compiled in this crate and in images (.cargo/config.toml). Laws must use `dimsart_core` for the core and
//! `super` for other files of this folder.

pub mod template;

pub use template::Template;

/// Modules that this project adds to the library, in its tools and images.
pub const OWN: dimsart_core::ModuleKinds = dimsart_core::kinds![
    Template,
];
