//! The control laws of this project: `cargo dimsart new-module NAME` adds one.
//!
//! This file is compiled twice: as a part of this crate, and in images, as .cargo/config.toml says. So a law names the core
//! `dimsart_core`, and another file of this folder `super`.

pub mod template;

pub use template::Template;

/// The modules that the tools and images of this project have besides those of the library.
pub const OWN: dimsart_core::Kinds = dimsart_core::kinds![
    Template,
];
