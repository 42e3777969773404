//! The core's behaviour, across its files. One program, as it links once: `cargo test -p dimsart-core matching::` runs
//! the tests of one file.

mod activation_sets;
mod admission;
mod auth;
mod capacity;
mod carriers;
mod channel;
mod clients;
mod comm;
mod commands;
mod common;
mod containment;
mod coupling;
mod data_base;
#[path = "library/energy.rs"]
mod energy;
mod events;
mod every_kind;
mod faults;
mod formats;
mod frame;
mod gate;
mod guard;
mod latencies;
mod lease;
mod left_out;
mod library;
mod link;
mod link_rate;
mod link_start;
mod matching;
mod modules;
mod online;
mod overruns;
mod parameters;
mod play_out;
mod protocol;
mod rates;
mod saved_scheme;
mod schemes;
mod sensors;
mod signals;
mod transactions;
mod waves;
mod wire;
