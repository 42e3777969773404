//! Puts the linker scripts of the chosen board where the linker finds them.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Every board: its feature and its memory map.
const BOARDS: &[(&str, &str)] = &[
    ("MPS2_AN386", "memory/mps2-an386.x"),
    ("NUCLEO_G474RE", "memory/nucleo-g474re.x"),
    ("B_G431B_ESC1", "memory/b-g431b-esc1.x"),
];

fn main() -> Result<(), String> {
    let is_chosen = |(board, _): &&(&str, &str)| env::var_os(format!("CARGO_FEATURE_{board}")).is_some();
    let chosen: Vec<_> = BOARDS.iter().filter(is_chosen).collect();
    let (_, memory) = match chosen.as_slice() {
        [] => return Ok(()),
        [board] => board,
        _ => return Err("more than one board is chosen: give one board's feature".to_owned()),
    };
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return Err("a board is not a host: build with --target thumbv7em-none-eabihf".to_owned());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let copied = fs::copy(Path::new(memory), out.join("board-memory.x"));
    copied.map_err(|error| format!("cannot copy {memory}: {error}"))?;
    if env::var_os("CARGO_FEATURE_STM32G4").is_none() {
        // The board's interrupt table names its handlers itself; cortex-m-rt wants the file all the same.
        let written = fs::write(out.join("device.x"), "");
        written.map_err(|error| format!("cannot write device.x: {error}"))?;
    }
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed={memory}");
    println!("cargo:rerun-if-changed=build.rs");
    Ok(())
}
