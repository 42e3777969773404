//! Copies the linker scripts of the selected board to the linker's search path. On a host nothing is linked.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Memory maps, each named after its board's feature.
const MEMORY: &str = "memory";
/// Included by memory maps of boards with CCM SRAM: the tick or the current loop.
const CCM: [&str; 2] = ["ccm.x", "ccm-current-loop.x"];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={MEMORY}");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return Ok(());
    }
    CCM.iter().for_each(|script| println!("cargo:rerun-if-changed={script}"));
    let maps = fs::read_dir(MEMORY).map_err(|error| format!("cannot read {MEMORY}: {error}"))?;
    let is_chosen = |map: &PathBuf| {
        let name = map.file_stem().unwrap_or_default().to_string_lossy().to_uppercase().replace('-', "_");
        env::var_os(format!("CARGO_FEATURE_{name}")).is_some()
    };
    let chosen: Vec<PathBuf> = maps.flatten().map(|map| map.path()).filter(is_chosen).collect();
    let memory = match chosen.as_slice() {
        [] => return Ok(()),
        [memory] => memory,
        _ => {
            return Err(
                "features of several boards are enabled: enable the feature of one board only".to_owned()
            );
        }
    };
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set by cargo")?);
    let ccm = CCM.map(|script| (Path::new(script), script));
    for (script, name) in ccm.into_iter().chain([(memory.as_path(), "board-memory.x")]) {
        let copied = fs::copy(script, out.join(name));
        copied.map_err(|error| format!("cannot copy {}: {error}", script.display()))?;
    }
    if env::var_os("CARGO_FEATURE_STM32G4").is_none() {
        // The board's interrupt table names its handlers, but cortex-m-rt requires the file.
        let written = fs::write(out.join("device.x"), "");
        written.map_err(|error| format!("cannot write device.x: {error}"))?;
    }
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}
