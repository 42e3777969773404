//! `dimsart new-project`: creates a workspace for your own control laws, outside of this repository.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::ModuleKinds;

use super::Ending;
use super::new_module::{Names, write_first};

/// Create a workspace for your own control laws, with a first law.
///
/// The first law has a test, a scheme and a scenario. The project builds its own `dimsart` command (`cargo dimsart`) and its
/// own images (`cargo board`), which contain the laws of the project. The folder of DIMSART does not change.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct NewProject {
    /// Name of the project and of its folder, such as `gripper`.
    name: PathBuf,
    /// Name of the first law.
    #[arg(long, value_name = "NAME", default_value = "my-law")]
    law: String,
    /// Folder of DIMSART (default: folder of this build; if missing, the published version).
    #[arg(long, value_name = "FOLDER")]
    dimsart: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Example:
  dimsart new-project gripper --law grip-force
  cd gripper
  cargo test                                      compare the law and its loop with closed forms
  cargo dimsart run scenarios/grip_force.toml     print figures and write a report";

/// Values of the placeholders of a template.
type Filled<'a> = [(&'a str, String)];

/// The files of a project except its law: path and template.
const FILES: [(&str, &str); 8] = [
    ("Cargo.toml", include_str!("new_project/Cargo.toml.txt")),
    (".cargo/config.toml", include_str!("new_project/config.toml.txt")),
    (".gitignore", include_str!("new_project/gitignore")),
    ("README.md", include_str!("new_project/README.md")),
    ("src/lib.rs", include_str!("new_project/lib.rs")),
    ("src/modules/mod.rs", include_str!("new_project/modules.rs")),
    ("tools/Cargo.toml", include_str!("new_project/tools.toml.txt")),
    ("tools/main.rs", include_str!("new_project/tools.rs")),
];
/// Aliases that build images in the folder of DIMSART.
const IMAGES: &str = include_str!("new_project/images.toml.txt");
/// Build folder, shared with DIMSART.
const BUILD_DIR: &str = "\
# Shared with DIMSART, so that dependencies are built once. `cargo clean` here also cleans DIMSART.
build-dir = \"DIMSART/target\"";
/// Build settings of images.
const CONFIGURATION: &str = include_str!("new_project/image_build.toml");

impl NewProject {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let folder = &self.name;
        let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default().to_lowercase();
        let is_package = name.starts_with(|first: char| first.is_ascii_lowercase())
            && name.chars().all(|letter| letter.is_ascii_alphanumeric() || "-_".contains(letter));
        if !is_package
            || ["tools", "test", "dimsart", "dimsart-core", "dimsart-modules", "hil-sim"]
                .contains(&name.as_str())
        {
            return Err(format!(
                "invalid or reserved project name '{name}': start with an ASCII letter; use ASCII letters, digits, - and \
                 _, such as gripper"
            )
            .into());
        }
        let law = Names::new(&self.law, kinds)?;
        if folder.exists() {
            return Err(format!(
                "{} already exists and was not changed: choose another project name",
                folder.display()
            )
            .into());
        }
        let checkout = self.checkout()?;
        let filled = filled(&name, checkout.as_deref());
        let files = FILES.iter().map(|(path, template)| (*path, law.fill(&fill(template, &filled))));
        for (path, text) in files {
            let path = folder.join(path);
            let written =
                path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(&path, text));
            written.map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
        for name in ["schemes", "scenarios", "tests"] {
            fs::create_dir_all(folder.join(name))?;
        }
        if let Some(checkout) = checkout {
            // The same versions reuse DIMSART's build.
            fs::copy(checkout.join("Cargo.lock"), folder.join("Cargo.lock"))?;
        }
        write_first(folder, &law)?;
        let (folder, file) = (folder.display(), &law.file);
        writeln!(
            out,
            "created {folder} with {module}; the law is `compute` in src/modules/{file}.rs\n\nNext:\n  \
             cd {folder}\n  cargo test\n  cargo dimsart run scenarios/{file}.toml\n\nSee README.md of the project.",
            module = law.module
        )?;
        Ok(ExitCode::SUCCESS)
    }

    /// Finds the folder of DIMSART.
    fn checkout(&self) -> Result<Option<PathBuf>, String> {
        let is_one = |folder: &Path| folder.join("dimsart-core/Cargo.toml").is_file();
        match &self.dimsart {
            Some(given) if !is_one(given) => Err(format!(
                "--dimsart {}: dimsart-core not found in this folder: give the top folder of DIMSART",
                given.display()
            )),
            Some(given) => fs::canonicalize(given).map(Some).map_err(|error| error.to_string()),
            None => {
                let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
                Ok(fs::canonicalize(built_in).ok().filter(|folder| is_one(folder)))
            }
        }
    }
}

/// Values of the placeholders. Without a folder of DIMSART (published version) there are no aliases for images.
fn filled(name: &str, checkout: Option<&Path>) -> [(&'static str, String); 8] {
    let version = env!("CARGO_PKG_VERSION");
    let of = |package: &str| match checkout {
        // Rust's debug format of a path is a valid TOML string.
        Some(folder) => format!("path = {:?}", folder.join(package)),
        None => format!("version = \"{version}\""),
    };
    let (mut images, mut environment, mut build_dir) = (String::new(), String::new(), String::new());
    if let Some(folder) = checkout {
        let folder = [("DIMSART", folder.display().to_string())];
        build_dir = fill(BUILD_DIR, &folder);
        images = fill(IMAGES, &folder);
        images += CONFIGURATION
            .lines()
            .skip_while(|line| !line.starts_with("[target"))
            .take_while(|line| *line != "[env]")
            .fold(String::new(), |text, line| text + line + "\n")
            .trim_end();
        images.push('\n');
        environment = CONFIGURATION
            .lines()
            .skip_while(|line| *line != "[env]")
            .skip(1)
            .fold(String::new(), |text, line| text + line + "\n");
    }
    [
        ("DIMSART_CORE", of("dimsart-core")),
        ("COMMAND", of("dimsart")),
        ("HIL_SIM", of("hil-sim")),
        ("LIBRARY", of("dimsart-modules")),
        ("PROJECT", name.to_owned()),
        ("ENVIRONMENT", environment),
        ("BUILD_DIR", build_dir),
        ("IMAGES", images),
    ]
}

/// Replaces whole words only: not `DIMSART` in `DIMSART_MODULES`.
fn fill(template: &str, filled: &Filled<'_>) -> String {
    let mut text = String::with_capacity(template.len());
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut rest = template;
    while let Some(start) = rest.find(is_part) {
        let (before, from) = rest.split_at(start);
        let (word, after) = from.split_at(from.find(|letter| !is_part(letter)).unwrap_or(from.len()));
        let found = filled.iter().find(|(known, _)| *known == word);
        text += before;
        text += found.map_or(word, |(_, value)| value);
        rest = after;
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_words_are_filled_in() {
        let filled = [("DIMSART", "/here".to_owned())];
        assert_eq!(fill("DIMSART/x DIMSART_MODULES (DIMSART)", &filled), "/here/x DIMSART_MODULES (/here)");
    }

    /// With and without a folder of DIMSART.
    #[test]
    fn what_is_filled_in_is_toml() {
        for checkout in [Some(PathBuf::from("/a folder/dimsart")), None] {
            let filled = filled("gripper", checkout.as_deref());
            for (path, template) in FILES.iter().filter(|(path, _)| path.ends_with(".toml")) {
                let text = fill(template, &filled);
                let table =
                    text.parse::<toml::Table>().unwrap_or_else(|error| panic!("{path}: {error}\n{text}"));
                if *path == ".cargo/config.toml" {
                    assert_eq!(
                        table["alias"].as_table().unwrap().len(),
                        if checkout.is_some() { 3 } else { 1 }
                    );
                    assert_eq!(table.contains_key("target"), checkout.is_some());
                    assert_eq!(table["build"].get("build-dir").is_some(), checkout.is_some());
                }
            }
        }
    }

    /// Otherwise a project rebuilds all packages.
    #[test]
    fn a_project_s_release_build_has_the_settings_of_this_workspace() {
        let project = fill(FILES[0].1, &filled("gripper", None));
        let tables = [project.as_str(), include_str!("../../../Cargo.toml")];
        let [project, workspace] = tables.map(|text| text.parse::<toml::Table>().unwrap());
        assert_eq!(project["profile"]["release"], workspace["profile"]["release"]);
    }
}
