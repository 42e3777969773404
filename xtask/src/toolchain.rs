//! The compiler for boards: rustup's target, or Debian's packages if rustup cannot download.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::setup::install;
use crate::shell::{cargo, command, succeeds};

/// Compiler target of all boards.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// Debian's Rust with the sources of `core`, which are compiled with the image; the last package is the
/// linker.
const DEBIAN: [&str; 5] = ["rustc-web", "cargo-web", "rust-web-clippy", "rust-web-src", "lld-22"];
/// Linker for Debian's Rust, which does not include `rust-lld`.
const DEBIAN_LINKER: &str = "/usr/lib/llvm-22/bin/ld.lld";
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/core";

/// Source of the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Toolchain {
    /// The running compiler, with the target installed.
    Rustup,
    /// Debian's compiler, which also compiles `core`.
    Debian,
}

impl Toolchain {
    /// Finds or installs a compiler for boards.
    pub(crate) fn set_up() -> Result<Self, String> {
        if has_target() {
            return Ok(Self::Rustup);
        }
        if succeeds(&mut command("rustup", ["--version"])) {
            println!("installing the target {TARGET} for the boards");
            if succeeds(&mut command("rustup", ["target", "add", TARGET])) && has_target() {
                return Ok(Self::Rustup);
            }
        }
        let files = [DEBIAN_SOURCES, DEBIAN_LINKER];
        if !files.iter().all(|file| Path::new(file).exists())
            || !succeeds(&mut Self::Debian.cargo("clippy", &["--version"]))
        {
            let purpose = format!("building for the boards without `rustup target add {TARGET}`");
            install(&DEBIAN, &purpose)?;
        }
        Ok(Self::Debian)
    }

    /// Returns the compiler's version, such as `1.95.0`.
    pub(crate) fn version(self) -> Result<String, String> {
        let rustc = if self == Self::Debian { "/usr/bin/rustc" } else { "rustc" };
        let output =
            command(rustc, ["--version"]).output().map_err(|error| format!("cannot run {rustc}: {error}"))?;
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        said.split(' ')
            .nth(1)
            .map(str::to_owned)
            .ok_or_else(|| format!("cannot read the version of {rustc}: '{said}'"))
    }

    /// Creates a cargo command for the boards' target.
    pub(crate) fn cargo(self, subcommand: &str, arguments: &[&str]) -> Command {
        let mut cargo = match (self, subcommand) {
            (Self::Rustup, _) => cargo(&[subcommand]),
            // Called directly: as a subcommand, cargo could find another Rust's.
            (Self::Debian, "clippy") => command("/usr/bin/cargo-clippy", ["clippy"]),
            (Self::Debian, _) => command("/usr/bin/cargo", [subcommand]),
        };
        cargo.args(["--target", TARGET]);
        if self == Self::Debian {
            cargo.args(["-Z", "build-std=core"]);
            let programs = [("CARGO", "cargo"), ("RUSTC", "rustc"), ("RUSTDOC", "rustdoc")];
            cargo.envs(programs.map(|(name, program)| (name, Path::new("/usr/bin").join(program))));
            cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", DEBIAN_LINKER);
            // `build-std` is unstable.
            cargo.env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
        }
        cargo.args(arguments);
        cargo
    }
}

/// Returns the output folder of a board build with `profile`.
pub(crate) fn output(profile: &str) -> PathBuf {
    crate::shell::target().join(TARGET).join(profile)
}

fn has_target() -> bool {
    let output = command("rustc", ["--print", "target-libdir", "--target", TARGET]).output();
    output.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
}
