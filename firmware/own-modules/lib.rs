//! The module kinds of a project outside this repository, for its images.
#![no_std]

include!(concat!(env!("OUT_DIR"), "/own_modules.rs"));
