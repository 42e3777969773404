//! `cargo xtask figures`: what the firmware takes of each board, written to `docs/firmware.md`.

use std::fmt::Write;

use crate::boards::{Image, build_all};
use crate::shell::{Outcome, command, top};
use crate::table::table;
use crate::toolchain::Toolchain;

const HEAD: &str = "\
# What the firmware takes

Written by `cargo xtask figures` from the images of `cargo xtask test`, which fails when one is over its budget.
Flash is code, constants and the initial values of variables; RAM is all variables, the Data Base and 16 modules
of up to 8 degrees of freedom among them, without the stack. The emulated board has room and no budget.
";

/// Builds every image and writes the page.
pub(crate) fn run() -> Outcome {
    let page = page(&build_all(Toolchain::set_up()?)?);
    println!("{page}");
    let file = top().join("docs/firmware.md");
    std::fs::write(&file, page).map_err(|error| format!("cannot write {}: {error}", file.display()))
}

fn page(images: &[Image]) -> String {
    let rustc = command("rustc", ["--version"]).output().ok();
    let rustc = rustc.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let rows: Vec<[String; 5]> = images.iter().map(row).collect();
    let mut page = format!("{HEAD}\nCompiler: {}\n", rustc.trim());
    let head = ["Image", "Flash, bytes", "At most", "RAM, bytes", "At most"];
    let _ = write!(page, "\n## Memory\n{}", table(head, &rows));
    page
}

fn row(image: &Image) -> [String; 5] {
    let most = |of: fn(crate::boards::Size) -> u64| {
        image.board.budget.map_or_else(|| "-".to_owned(), |budget| of(budget).to_string())
    };
    let (flash, ram) = (image.size.flash.to_string(), image.size.ram.to_string());
    [image.name.clone(), flash, most(|size| size.flash), ram, most(|size| size.ram)]
}
