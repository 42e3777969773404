//! The compiler for the boards: rustup's target, or Debian's packages where rustup cannot download.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::setup::install;
use crate::shell::{cargo, command, succeeds};

/// What every board's processor is to the compiler.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";
/// A Rust of Debian's with the sources of `core`, which is compiled along; the last one is its linker.
const DEBIAN: [&str; 5] = ["rustc-web", "cargo-web", "rust-web-clippy", "rust-web-src", "lld-22"];
/// What Debian's Rust looks for as `rust-lld`, and does not bring.
const DEBIAN_LINKER: &str = "/usr/lib/llvm-22/bin/ld.lld";
const DEBIAN_SOURCES: &str = "/usr/lib/rustlib/src/rust/library/core";

/// Where the compiler comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Toolchain {
    /// The one that runs this, with the target installed.
    Rustup,
    /// Debian's, which compiles `core` along.
    Debian,
}

impl Toolchain {
    /// Finds a compiler for the boards, or installs one.
    pub(crate) fn set_up() -> Result<Self, String> {
        if has_target() {
            return Ok(Self::Rustup);
        }
        if succeeds(&mut command("rustup", ["--version"])) {
            println!("installing the target {TARGET}: the boards need it");
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

    /// Of the compiler, such as `1.95.0`.
    pub(crate) fn version(self) -> Result<String, String> {
        let rustc = if self == Self::Debian { "/usr/bin/rustc" } else { "rustc" };
        let output =
            command(rustc, ["--version"]).output().map_err(|error| format!("cannot run {rustc}: {error}"))?;
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        said.split(' ')
            .nth(1)
            .map(str::to_owned)
            .ok_or_else(|| format!("{rustc} says of its version '{said}'"))
    }

    /// A cargo command for the boards' processor.
    pub(crate) fn cargo(self, subcommand: &str, arguments: &[&str]) -> Command {
        let mut cargo = match (self, subcommand) {
            (Self::Rustup, _) => cargo(&[subcommand]),
            // Not as a sub-command: cargo would take that of another Rust.
            (Self::Debian, "clippy") => command("/usr/bin/cargo-clippy", ["clippy"]),
            (Self::Debian, _) => command("/usr/bin/cargo", [subcommand]),
        };
        cargo.args(["--target", TARGET]);
        if self == Self::Debian {
            cargo.args(["-Z", "build-std=core"]);
            let programs = [("CARGO", "cargo"), ("RUSTC", "rustc"), ("RUSTDOC", "rustdoc")];
            cargo.envs(programs.map(|(name, program)| (name, Path::new("/usr/bin").join(program))));
            cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", DEBIAN_LINKER);
            // `build-std` is not stable.
            cargo.env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
        }
        cargo.args(arguments);
        cargo
    }
}

/// The folder that a build for the boards with `profile` puts its programs in.
pub(crate) fn output(profile: &str) -> PathBuf {
    crate::shell::target().join(TARGET).join(profile)
}

fn has_target() -> bool {
    let output = command("rustc", ["--print", "target-libdir", "--target", TARGET]).output();
    output.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
}
