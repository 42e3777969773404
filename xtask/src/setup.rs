//! Finds and, if possible, installs the tools that tests need in addition to Rust.

use std::path::PathBuf;
use std::sync::OnceLock;

use crate::shell::{Outcome, cargo, command, run, succeeds, target, top};

/// Version of mdBook.
const MDBOOK: &str = "0.5.4";
/// Version of TypeScript.
const TYPESCRIPT: &str = "7.0.2";

/// Installs Debian packages if permitted; otherwise returns instructions.
pub(crate) fn install(packages: &[&str], purpose: &str) -> Outcome {
    let list = packages.join(" ");
    let by_hand =
        format!("{purpose} needs {list}; install it (Debian: apt-get install {list}) and run this again");
    if !succeeds(&mut command("apt-get", ["--version"])) || !is_root() {
        return Err(by_hand);
    }
    println!("installing {list} for {purpose}");
    let mut install = command("apt-get", ["install", "-y", "--no-install-recommends"]);
    install.args(packages).env("DEBIAN_FRONTEND", "noninteractive");
    let installed = run(&mut command("apt-get", ["update"])).and_then(|()| run(&mut install));
    installed.map_err(|error| format!("{error}\n{by_hand}"))
}

/// Installs the oracle's Python packages in `.venv`, once in a run; returns its Python.
pub(crate) fn python() -> Result<PathBuf, String> {
    static PYTHON: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    PYTHON.get_or_init(set_up_python).clone()
}

fn set_up_python() -> Result<PathBuf, String> {
    let requirements = top().join("tests/oracle/requirements.txt");
    let wanted = std::fs::read_to_string(&requirements)
        .map_err(|error| format!("cannot read {}: {error}", requirements.display()))?;
    let folder = top().join(".venv");
    let python = folder.join("bin/python");
    let stamp = folder.join("requirements.installed");
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted)
        && succeeds(&mut command(&python, ["-c", "import control"]))
    {
        return Ok(python);
    }
    if !succeeds(&mut command("python3", ["-c", "import venv, ensurepip"])) {
        install(&["python3", "python3-venv"], "the oracle (python-control)")?;
    }
    run(&mut command("python3", ["-m", "venv", "--clear", ".venv"]))?;
    run(command(&python, ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"])
        .arg(requirements))
    .map_err(|error| {
        format!("{error}\nthe oracle needs its Python packages (tests/oracle/requirements.txt)")
    })?;
    std::fs::write(&stamp, wanted).map_err(|error| format!("cannot write {}: {error}", stamp.display()))?;
    Ok(python)
}

/// Installs an emulator that supports the emulated board.
pub(crate) fn emulator() -> Outcome {
    let has_board = || {
        let machines = command("qemu-system-arm", ["-machine", "help"]).output();
        machines.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("mps2-an386"))
    };
    if has_board() {
        return Ok(());
    }
    install(&["qemu-system-arm"], "running firmware without a board")?;
    if has_board() {
        Ok(())
    } else {
        Err("qemu-system-arm does not support mps2-an386: install QEMU 7.2 or later".into())
    }
}

/// Installs a browser for the page's tests.
pub(crate) fn browser() -> Outcome {
    match succeeds(&mut command("/usr/bin/chromium", ["--version"])) {
        true => Ok(()),
        false => install(&["chromium"], "testing the page in a browser"),
    }
}

/// Installs the TypeScript compiler in `target/tools`; returns its path.
pub(crate) fn typescript() -> Result<PathBuf, String> {
    let folder = target().join("tools");
    let compiler = folder.join("node_modules/.bin/tsc");
    let said = command(&compiler, ["--version"]).output();
    if said
        .is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == format!("Version {TYPESCRIPT}"))
    {
        return Ok(compiler);
    }
    if !succeeds(&mut command("npm", ["--version"])) {
        install(&["npm"], "checking the types of the page")?;
    }
    let package = format!("typescript@{TYPESCRIPT}");
    run(command("npm", ["install", "--no-save", "--no-audit", "--no-fund", "--prefix"])
        .arg(folder)
        .arg(package))?;
    Ok(compiler)
}

/// Installs mdBook in `target/tools`, which takes minutes to build; returns its path.
pub(crate) fn mdbook() -> Result<PathBuf, String> {
    let folder = target().join("tools");
    let mdbook = folder.join("bin/mdbook");
    let said = command(&mdbook, ["--version"]).output();
    if said.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == format!("mdbook v{MDBOOK}"))
    {
        return Ok(mdbook);
    }
    let install = ["install", "mdbook", "--version", MDBOOK, "--locked", "--no-default-features"];
    run(cargo(&install).args(["--features", "search", "--root"]).arg(folder))?;
    Ok(mdbook)
}

fn is_root() -> bool {
    command("id", ["-u"]).output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
