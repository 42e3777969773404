//! Follows the tutorial and how-to pages command by command: creates a project outside the workspace, builds
//! it, runs its law and tests, and runs its firmware on the emulated board.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use crate::console;
use crate::example::dimsart;
use crate::setup;
use crate::shell::{Outcome, target, top};

/// Follows `docs/tutorial.md`.
pub(crate) fn follow() -> Outcome {
    setup::emulator()?;
    dimsart()?;
    let folder = target().join("tutorial");
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    // Reuses this repository's build of `dimsart`.
    let built = target();
    let environment = [
        ("CARGO_TARGET_DIR", built.as_path()),
        ("CARGO_BUILD_BUILD_DIR", built.as_path()),
        ("CARGO_ALIAS_DIMSART", Path::new("run --quiet --package tools --")),
        ("CARGO_PROFILE_DEV_DEBUG", Path::new("false")),
        ("CARGO_PROFILE_DEV_LTO", Path::new("off")),
    ];
    page(&top().join("docs/tutorial.md"), &folder, &environment)
}

/// Follows the pages of `docs/howto/` with desk commands, each in a separate folder.
pub(crate) fn follow_how_tos() -> Outcome {
    dimsart()?;
    let folder = top().join("docs/howto");
    let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut pages: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    pages.sort_unstable();
    for path in pages {
        page(&path, temporary()?.path(), &[])?;
    }
    Ok(())
}

/// Follows a page with this repository's `dimsart`.
fn page(path: &Path, folder: &Path, environment: &[(&str, &Path)]) -> Outcome {
    let shown = path.strip_prefix(top()).unwrap_or(path).display();
    let page = fs::read_to_string(path).map_err(|error| format!("cannot read {shown}: {error}"))?;
    let mut programs = OsString::from(target().join("debug"));
    programs.push(":");
    programs.push(std::env::var_os("PATH").unwrap_or_default());
    // Separate shared ports, not the user's.
    let ports = temporary()?;
    let mut all = vec![("PATH", Path::new(&programs)), ("XDG_RUNTIME_DIR", ports.path())];
    all.extend(environment);
    println!("{shown}");
    console::follow(&page, folder, &all).map_err(|error| format!("{shown}: {error}"))
}

fn temporary() -> Result<tempfile::TempDir, String> {
    tempfile::tempdir().map_err(|error| format!("cannot create a temporary folder: {error}"))
}
