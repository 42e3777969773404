//! Links an image for a board; the board's crate brings the memory map. Names the image, and makes the
//! built-in scheme's text into the bytes that the image starts with.

#[cfg(feature = "cycle-table")]
#[path = "build/cycle_table.rs"]
mod cycle_table;

use std::path::PathBuf;
use std::{env, fs};

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, saved_scheme, scheme, types};

const SCHEME: &str = "../schemes/bilateral.scheme";
/// What boards may take, a file each.
const BUDGETS: &str = "../boards/budgets";
const SIDES: [&str; 2] = ["master", "slave"];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={SCHEME}");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    #[cfg(feature = "cycle-table")]
    cycle_table::write(&out.join("cycle_table.rs"))?;
    let [master, slave] = SIDES;
    let side = if env::var_os("CARGO_FEATURE_SLAVE").is_some() { slave } else { master };
    let written = fs::write(out.join("built-in-scheme"), built_in_scheme(side)?);
    written.map_err(|error| format!("cannot write the built-in scheme: {error}"))?;
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        println!("cargo:rustc-env=DIMSART_TICK_CYCLES={}", tick_cycles()?);
        link();
    }
    Ok(())
}

/// The bytes of the scheme on one side, for a device that has every axis a board can have.
fn built_in_scheme(side: &str) -> Result<saved_scheme::SchemeBytes, String> {
    let text = fs::read_to_string(SCHEME).map_err(|error| format!("cannot read {SCHEME}: {error}"))?;
    let axes = [AxisKind::Rotary; MAX_DOF];
    let device = DeviceDescriptor::new("any board", &axes, 1e-3, &[types::POSITION], &[types::DES_FORCE]);
    let device = device.map_err(|error| error.to_string())?;
    let mut dimsart: Dimsart = Dimsart::new(device).map_err(|error| format!("{error:?}"))?;
    let mut wrong = Vec::new();
    scheme::load(&text, side, &SIDES, &mut dimsart, |error| {
        let (line, word) = (error.place.line, error.place.word);
        wrong.push(format!("{SCHEME}:{line}: '{word}' as {side}: {:?}", error.problem));
    });
    if !wrong.is_empty() || !dimsart.engine().is_running() {
        let engine = dimsart.engine();
        let report = engine.check();
        wrong.extend(report.findings().iter().map(|finding| engine.explain(*finding).to_string()));
        wrong.iter().for_each(|line| println!("cargo::error={line}"));
        return Err("the built-in scheme does not run: `dimsart check` it until it does".to_owned());
    }
    saved_scheme::save(dimsart.engine_mut()).map_err(|_| "the built-in scheme is too long".to_owned())
}

/// What a tick may take on the board that is built for.
fn tick_cycles() -> Result<i64, String> {
    println!("cargo:rerun-if-changed={BUDGETS}");
    let budgets = fs::read_dir(BUDGETS).map_err(|error| format!("cannot read {BUDGETS}: {error}"))?;
    let is_chosen = |budget: &PathBuf| {
        let board = budget.file_stem().unwrap_or_default().to_string_lossy().to_uppercase().replace('-', "_");
        env::var_os(format!("CARGO_FEATURE_{board}")).is_some()
    };
    let chosen = budgets.flatten().map(|budget| budget.path()).find(is_chosen);
    let path = chosen.ok_or_else(|| format!("the board has no file in {BUDGETS}"))?;
    let wrong = |what: &str| format!("{}: {what}", path.display());
    let text = fs::read_to_string(&path).map_err(|error| wrong(&error.to_string()))?;
    let budget: toml::Table = text.parse().map_err(|error: toml::de::Error| wrong(&error.to_string()))?;
    let cycles = budget.get("tick_cycles").and_then(toml::Value::as_integer);
    cycles.filter(|cycles| *cycles > 0).ok_or_else(|| wrong("tick_cycles is no number of cycles"))
}

fn link() {
    // Functions of the same code are one.
    // What only `dimsart cycles` needs stays.
    for symbol in ["dimsart_image", "dimsart_load"] {
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
    let feature = |(name, _): (String, _)| name.strip_prefix("CARGO_FEATURE_").map(str::to_owned);
    let mut features: Vec<String> = env::vars().filter_map(feature).filter(|name| name != "BOARD").collect();
    features.sort();
    let features = features.join("+").replace('_', "-").to_lowercase();
    println!("cargo:rustc-env=DIMSART_IMAGE=dimsart {} {features}", env!("CARGO_PKG_VERSION"));
}
