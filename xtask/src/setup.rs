//! Finds what the tests need beyond Rust, and installs it where that is possible.

use std::path::PathBuf;

use crate::shell::{Outcome, cargo, command, run, succeeds, target, top};

/// The version of mdBook that builds the book.
const MDBOOK: &str = "0.5.4";

/// Installs Debian packages when this is a Debian machine and we may; else says what to do.
pub(crate) fn install(packages: &[&str], purpose: &str) -> Outcome {
    let list = packages.join(" ");
    let by_hand =
        format!("{purpose} needs {list}; install it (Debian: apt-get install {list}) and run this again");
    if !succeeds(&mut command("apt-get", ["--version"])) || !is_root() {
        return Err(by_hand);
    }
    println!("installing {list}: {purpose} needs it");
    let mut install = command("apt-get", ["install", "-y", "--no-install-recommends"]);
    install.args(packages).env("DEBIAN_FRONTEND", "noninteractive");
    let installed = run(&mut command("apt-get", ["update"])).and_then(|()| run(&mut install));
    installed.map_err(|error| format!("{error}\n{by_hand}"))
}

/// A Python with the packages that the oracle needs, in `.venv`.
pub(crate) fn python() -> Result<PathBuf, String> {
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

/// An emulator that has the emulated board.
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
        Err("qemu-system-arm knows no board mps2-an386: install QEMU 7.2 or later".into())
    }
}

/// A browser for the page's tests.
pub(crate) fn browser() -> Outcome {
    match succeeds(&mut command("/usr/bin/chromium", ["--version"])) {
        true => Ok(()),
        false => install(&["chromium"], "trying the page in a browser"),
    }
}

/// mdBook, in `target/tools`; building it takes minutes.
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
