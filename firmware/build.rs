//! Links an image for a board with the memory map of the board's crate, names the image, and encodes the
//! built-in scheme.

#[cfg(feature = "cycle-table")]
#[path = "build/cycle_table.rs"]
mod cycle_table;

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

use boards::BOARDS;
use boards::catalogue::{BoardInfo, DEFAULT_GROUPS, MODULE_GROUPS};
use dimsart_core::limits::Capacities;
use dimsart_core::limits::MAX_DOF;
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, ModuleKinds, join_kinds, memory, scheme, types};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use own_modules::OWN;

/// Memory of the controller that encodes built-in schemes.
type BuildMemory = memory!(Capacities::DEFAULT);

/// All kinds, as in the host's tools: the built-in scheme contains their fingerprint.
const KINDS: ModuleKinds = join_kinds![ALL, OWN];

const SIDES: [&str; 2] = ["master", "slave"];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set by cargo")?);
    let is_for_board = env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none");
    #[cfg(feature = "cycle-table")]
    cycle_table::write(&out.join("cycle_table.rs"))?;
    let board = BOARDS.iter().find(|board| is_chosen(board.name));
    if let Some(board) = board.filter(|_| !is_for_board) {
        return Err(format!("{} is not the host: build with --target thumbv7em-none-eabihf", board.name));
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

/// Encodes the board's scheme of one side, for a device with all axes of a board.
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
        return Err("invalid built-in scheme: fix the errors above (`dimsart check` reports them)".to_owned());
    }
    saved_scheme::save(dimsart.engine_mut()).map_err(|_| "the built-in scheme is too long".to_owned())
}

/// Returns the version of the compiler, such as `1.95.0`.
fn compiler() -> Result<String, String> {
    let rustc = env::var_os("RUSTC").ok_or("RUSTC is not set by cargo")?;
    let said = Command::new(rustc).arg("--version").output();
    let said = said.map_err(|error| format!("cannot run the compiler: {error}"))?.stdout;
    let version = String::from_utf8_lossy(&said).split(' ').nth(1).map(str::to_owned);
    version.ok_or_else(|| "cannot read the compiler's version".to_owned())
}

fn link() {
    // Merges identical functions.
    // Keeps functions that only `dimsart cycles` calls.
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
    // The image's name lists groups other than the default or all groups.
    let has = |groups: &[&str]| groups.iter().all(|group| features.iter().any(|feature| feature == group));
    let untold: &[&str] = match () {
        () if has(&MODULE_GROUPS) => &MODULE_GROUPS,
        () if has(&DEFAULT_GROUPS) => &DEFAULT_GROUPS,
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
