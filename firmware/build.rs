//! Links an image for a board; the board's crate brings the memory map. Names the image, and makes the
//! built-in scheme's text into the bytes that the image starts with.

use std::path::PathBuf;
use std::{env, fs};

use dimsart_core::limits::MAX_DOF;
use dimsart_core::{AxisKind, DeviceDescriptor, Dimsart, saved_scheme, scheme, types};

const SCHEME: &str = "../schemes/bilateral.scheme";
const SIDES: [&str; 2] = ["master", "slave"];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={SCHEME}");
    let out = env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?;
    let [master, slave] = SIDES;
    let side = if env::var_os("CARGO_FEATURE_SLAVE").is_some() { slave } else { master };
    let written = fs::write(PathBuf::from(out).join("built-in-scheme"), built_in_scheme(side)?);
    written.map_err(|error| format!("cannot write the built-in scheme: {error}"))?;
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
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

fn link() {
    // Functions of the same code are one.
    for argument in ["--nmagic", "--icf=all", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    let feature = |(name, _): (String, _)| name.strip_prefix("CARGO_FEATURE_").map(str::to_owned);
    let mut features: Vec<String> = env::vars().filter_map(feature).filter(|name| name != "BOARD").collect();
    features.sort();
    let features = features.join("+").replace('_', "-").to_lowercase();
    println!("cargo:rustc-env=DIMSART_IMAGE=dimsart {} {features}", env!("CARGO_PKG_VERSION"));
}
