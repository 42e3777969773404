//! `dimsart new-module`: writes a new control law with its test, scheme and scenario, and registers it.
//!
//! The files are copies of templates that the tests compile and run, renamed.

mod names;
mod register;
// Compiled here for the tests.
#[cfg(test)]
#[expect(unreachable_pub, reason = "public where it is copied to")]
mod template;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::ModuleKinds;

use super::Ending;

pub(super) use names::Names;

const LAW: &str = include_str!("new_module/template.rs");
const TEST: &str = include_str!("new_module/template_loop.rs");
const SCHEME: &str = include_str!("new_module/template.scheme");
const SCENARIO: &str = include_str!("new_module/template.toml");

/// Create a control law with a scheme, scenario and test, and register it.
///
/// Run in the folder of a project (`dimsart new-project`) or of the DIMSART repository. The new law is a spring with one
/// parameter, two inputs and one output. The scenario applies a step to a joint. The test compares the law and the step
/// response with closed forms. Replace the law in `compute`, then the expected values of the test.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct NewModule {
    /// Name of the law in words, such as `damped-spring`.
    name: String,
    /// Write only the law's file, into this folder, without registering the module.
    #[arg(long)]
    folder: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Example, in the folder of a project or of the DIMSART repository:
  dimsart new-module damped-spring     writes and registers DAMPED_SPRING_MOD
  cargo test --test damped_spring      compare the law and its loop with closed forms
  dimsart run scenarios/damped_spring.toml";

/// Module kinds of the library and of a project, in a test.
const LAWS: &str = "dimsart_core::join_kinds![dimsart_modules::ALL, laws::modules::OWN]";

/// Paths and commands of a project or of this repository.
struct Place {
    /// The file with the list of modules, and the folder of modules.
    list: &'static str,
    modules: &'static str,
    tests: &'static str,
    /// Path from the folder of the test's crate to the folder of schemes and scenarios.
    up: &'static str,
    /// Module kinds in a test.
    kinds: &'static str,
    /// Commands that run a test and `dimsart`.
    test: &'static str,
    command: &'static str,
}

/// A project, and this repository.
const PLACES: [Place; 2] = [
    Place {
        list: "src/modules/mod.rs",
        modules: "src/modules",
        tests: "tests",
        up: "/",
        kinds: LAWS,
        test: "cargo test --test",
        command: "cargo dimsart",
    },
    Place {
        list: "dimsart-modules/src/lib.rs",
        modules: "dimsart-modules/src",
        tests: "hil-sim/tests",
        up: "/../",
        kinds: "dimsart_modules::ALL",
        test: "cargo test --package hil-sim --test",
        command: "cargo run --release --",
    },
];

impl NewModule {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let names = Names::new(&self.name, kinds)?;
        if let Some(folder) = &self.folder {
            let path = folder.join(format!("{}.rs", names.file));
            write_new(&path, &names.fill(LAW)).map_err(|error| advice(&path, &error))?;
            writeln!(
                out,
                "wrote {}; to register the module, add these lines to the file with `kinds![`, next to similar lines:",
                path.display()
            )?;
            for line in register::lines(&names) {
                writeln!(out, "  {}", line.trim())?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        let Some(place) = PLACES.iter().find(|place| Path::new(place.list).is_file()) else {
            let message = "this folder is not a DIMSART project or repository: create a project with `dimsart new-project \
                           NAME` and enter its folder, or give --folder";
            return Err(message.into());
        };
        let list = Path::new(place.list);
        let text = std::fs::read_to_string(list).map_err(|error| advice(list, &error))?;
        let registered = register::register(&text, &names).ok_or_else(|| {
            format!(
                "{}: cannot register the module: restore `pub mod`, `pub use` and `kinds![` as in a new project",
                list.display()
            )
        })?;
        let written = place.write(Path::new(""), &names)?;
        std::fs::write(list, registered).map_err(|error| advice(list, &error))?;
        for path in &written {
            writeln!(out, "wrote {}", path.display())?;
        }
        let Names { file, module, .. } = &names;
        let Place { test, command, modules, .. } = place;
        writeln!(
            out,
            "registered {module} in {}\n\nNext:\n  \
             {test} {file:24} compare the law and its loop with closed forms\n  \
             {command} run scenarios/{file}.toml\n  \
             {command} modules {module}\n\nThe law is `compute` in {modules}/{file}.rs.",
            list.display()
        )?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes the first law of a new project, with its scheme, scenario and test.
///
/// # Errors
/// A file exists or cannot be written.
pub(super) fn write_first(folder: &Path, names: &Names) -> Result<(), String> {
    let [project, _] = &PLACES;
    project.write(folder, names).map(drop)
}

impl Place {
    /// Writes all files, or none if a file exists.
    fn write(&self, folder: &Path, names: &Names) -> Result<Vec<PathBuf>, String> {
        let file = &names.file;
        let law = names.fill(LAW);
        let test = names.fill(TEST).replace("\"/../", &format!("\"{}", self.up)).replace(LAWS, self.kinds);
        let files = [
            (format!("{}/{file}.rs", self.modules), law),
            (format!("schemes/{file}.scheme"), names.fill(SCHEME)),
            (format!("scenarios/{file}.toml"), names.fill(SCENARIO)),
            (format!("{}/{file}.rs", self.tests), test),
        ];
        let files = files.map(|(path, text)| (folder.join(path), text));
        if let Some((there, _)) = files.iter().find(|(path, _)| path.exists()) {
            return Err(format!(
                "{} already exists, and no file was changed: choose another name",
                there.display()
            ));
        }
        for (path, text) in &files {
            write_new(path, text).map_err(|error| advice(path, &error))?;
        }
        Ok(files.map(|(path, _)| path).to_vec())
    }
}

/// Writes a new file; never overwrites.
fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes())
}

fn advice(path: &Path, error: &io::Error) -> String {
    let next = match error.kind() {
        io::ErrorKind::AlreadyExists => "no file was changed: choose another name",
        io::ErrorKind::NotFound => "create the folder, or give another --folder",
        _ => "give another --folder",
    };
    format!("cannot write {}: {error}; {next}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::{
        AxisKind, Command, DeviceDescriptor, Dimsart, ProvidedMemory, TickResult, Value, Word, types,
    };

    /// The template, registered.
    const WITH_TEMPLATE: dimsart_core::ModuleKinds = dimsart_core::kinds![template::Template];

    #[test]
    fn the_template_is_a_module_that_runs_once_registered() {
        // The device measures both positions, so that the spring needs no other module.
        let measured = &[types::POSITION, types::DES_POSITION];
        let device =
            DeviceDescriptor::new("arm", &[AxisKind::Linear; 2], 1e-3, measured, &[types::DES_FORCE]);
        let mut dimsart =
            Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), WITH_TEMPLATE).unwrap();
        let module = WITH_TEMPLATE.module("TEMPLATE_MOD").unwrap();
        dimsart.command(Command::set(module, 0, Value::Real(1000.0))).unwrap();
        dimsart.command(Command::PlugIn(module)).unwrap();
        dimsart.command(Command::Check).unwrap();
        let mut force = [Word(0); 2];
        let measured = [0.25, 0.5, 0.75, 0.25].map(Word::from);
        assert_eq!(dimsart.tick(&measured, &mut force), TickResult::Ran);
        assert_eq!(force, [500.0, -250.0].map(Word::from));
    }
}
