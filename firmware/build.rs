//! Links an image for a board; the board's crate brings the memory map. Names the image, and makes a scheme's
//! text into the bytes that the image starts with until it is stamped with others.

#[cfg(feature = "cycle-table")]
#[path = "build/cycle_table.rs"]
mod cycle_table;

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

use boards::BOARDS;
use boards::catalogue::{BoardInfo, MODULE_GROUPS, SHIPPED_GROUPS};
use dimsart_core::limits::MAX_DOF;
use dimsart_core::limits::Sizes;
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, Kinds, join_kinds, memory, scheme, types};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use own_modules::OWN;

/// Of the controller that built-in schemes are made into commands by.
type BuildMemory = memory!(Sizes::DEFAULT);

/// Of the tools that an image works with: its built-in scheme has their fingerprint.
const KINDS: Kinds = join_kinds![ALL, OWN];

const SIDES: [&str; 2] = ["master", "slave"];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let is_for_board = env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none");
    #[cfg(feature = "cycle-table")]
    cycle_table::write(&out.join("cycle_table.rs"))?;
    let board = BOARDS.iter().find(|board| is_chosen(board.name));
    if let Some(board) = board.filter(|_| !is_for_board) {
        return Err(format!("{} is not a host: build with --target thumbv7em-none-eabihf", board.name));
    }
    let Some(board) = board else { return Ok(()) };
    let [side, _] = SIDES;
    let written = fs::write(out.join("built-in-scheme"), built_in_scheme(board, side)?);
    written.map_err(|error| format!("cannot write the built-in scheme: {error}"))?;
    println!("cargo:rustc-env=DIMSART_SCHEME={}", board.tooling.scheme.name);
    println!("cargo:rustc-env=DIMSART_SIDE={side}");
    println!("cargo:rustc-env=DIMSART_COMPILER={}", compiler()?);
    link();
    Ok(())
}

fn is_chosen(feature: &str) -> bool {
    env::var_os(format!("CARGO_FEATURE_{}", feature.to_uppercase().replace('-', "_"))).is_some()
}

/// The bytes of the board's scheme on one side, for a device that has every axis a board can have.
fn built_in_scheme(board: &BoardInfo, side: &str) -> Result<saved_scheme::SchemeBytes, String> {
    let axes = [AxisKind::Rotary; MAX_DOF];
    let device = DeviceDescriptor::new("any board", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    let device = device.map_err(|error| error.to_string())?;
    let mut dimsart = Dimsart::new(Box::leak(Box::new(BuildMemory::new())), device, KINDS)
        .map_err(|error| format!("{error:?}"))?;
    let mut wrong = Vec::new();
    scheme::load(board.tooling.scheme.text, side, &SIDES, &mut dimsart, |error| {
        let (line, word) = (error.place.line, error.place.word);
        wrong.push(format!("{}, line {line}: '{word}' as {side}: {:?}", board.name, error.problem));
    });
    if !wrong.is_empty() || !dimsart.engine().is_running() {
        let engine = dimsart.engine();
        let report = engine.check();
        wrong.extend(report.findings().iter().map(|finding| engine.explain(*finding).to_string()));
        wrong.iter().for_each(|line| println!("cargo::error={line}"));
        return Err("the board's built-in scheme does not run: `dimsart check` it until it does".to_owned());
    }
    saved_scheme::save(dimsart.engine_mut()).map_err(|_| "the built-in scheme is too long".to_owned())
}

/// Version of the compiler, such as `1.95.0`.
fn compiler() -> Result<String, String> {
    let rustc = env::var_os("RUSTC").ok_or("cargo sets RUSTC")?;
    let said = Command::new(rustc).arg("--version").output();
    let said = said.map_err(|error| format!("cannot run the compiler: {error}"))?.stdout;
    let version = String::from_utf8_lossy(&said).split(' ').nth(1).map(str::to_owned);
    version.ok_or_else(|| "the compiler does not say its version".to_owned())
}

fn link() {
    // Functions of the same code are one.
    // What only `dimsart cycles` needs stays.
    for symbol in ["dimsart_connect", "dimsart_image", "dimsart_load", "dimsart_stamp"] {
        println!("cargo:rustc-link-arg-bin=firmware=--undefined={symbol}");
    }
    if env::var_os("CARGO_FEATURE_BY_HAND").is_some() {
        for symbol in ["by_hand_start", "by_hand_tick"] {
            println!("cargo:rustc-link-arg-bin=firmware=--undefined={symbol}");
        }
    }
    for argument in ["--nmagic", "--icf=all", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    let feature =
        |(name, _): (String, _)| Some(name.strip_prefix("CARGO_FEATURE_")?.replace('_', "-").to_lowercase());
    let mut features: Vec<String> = env::vars().filter_map(feature).collect();
    // An image is not named after the modules that it ships with, nor after all of them.
    let has = |groups: &[&str]| groups.iter().all(|group| features.iter().any(|feature| feature == group));
    let untold: &[&str] = match () {
        () if has(&MODULE_GROUPS) => &MODULE_GROUPS,
        () if has(&SHIPPED_GROUPS) => &SHIPPED_GROUPS,
        () => &[],
    };
    let has_some = MODULE_GROUPS.iter().any(|group| has(&[group]));
    features
        .retain(|name| !["board", "default"].contains(&name.as_str()) && !untold.contains(&name.as_str()));
    if !has_some {
        features.push("no-modules".to_owned());
    }
    features.sort();
    let features = features.join("+");
    println!("cargo:rustc-env=DIMSART_IMAGE=dimsart {} {features}", env!("CARGO_PKG_VERSION"));
}
