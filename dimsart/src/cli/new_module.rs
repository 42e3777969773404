//! `dimsart new-module`: writes a new control law with its test, its scheme and its scenario, and registers it.
//!
//! What is written are copies of templates that the tests compile and run, with other names.

mod names;
mod register;
// What is compiled here is the template itself.
#[cfg(test)]
#[expect(unreachable_pub, reason = "public where it is copied to")]
mod template;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::Kinds;

use super::Ending;

pub(super) use names::Names;

const LAW: &str = include_str!("new_module/template.rs");
const TEST: &str = include_str!("new_module/template_loop.rs");
const SCHEME: &str = include_str!("new_module/template.scheme");
const SCENARIO: &str = include_str!("new_module/template.toml");

/// Write a new control law with a test of its loop, and register it.
///
/// In a project (`dimsart new-project`) or in the folder of this repository, it writes the law, a spring with one parameter,
/// two inputs and one output; a scheme with it; a scenario, a joint with a step; and a test that holds the law and the
/// step to their closed forms. Change the law in `compute`, then what the test expects.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct NewModule {
    /// Name in words, such as `damped-spring`.
    name: String,
    /// Writes the law alone into this folder, and registers nothing.
    #[arg(long)]
    folder: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Example, in the folder of a project or of the repository:
  dimsart new-module damped-spring     writes and registers DAMPED_SPRING_MOD
  cargo test --test damped_spring      its loop, against closed forms
  dimsart run scenarios/damped_spring.toml";

/// The library's kinds and those of a project, as a test has them.
const LAWS: &str = "dimsart_core::join_kinds![dimsart_modules::ALL, laws::modules::OWN]";

/// Where things are.
struct Place {
    /// The file with the list of modules, and where its modules are.
    list: &'static str,
    modules: &'static str,
    tests: &'static str,
    /// From the folder of the test's crate to that of schemes and scenarios.
    up: &'static str,
    /// The kinds that a test names.
    kinds: &'static str,
    /// How a test and the command are called.
    test: &'static str,
    command: &'static str,
}

/// A project of one's own, and this repository.
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
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let names = Names::new(&self.name, kinds)?;
        if let Some(folder) = &self.folder {
            let path = folder.join(format!("{}.rs", names.file));
            write_new(&path, &names.fill(LAW)).map_err(|error| advice(&path, &error))?;
            writeln!(out, "wrote {}; register it with these lines, each among its like:", path.display())?;
            for line in register::lines(&names) {
                writeln!(out, "  {}", line.trim())?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        let Some(place) = PLACES.iter().find(|place| Path::new(place.list).is_file()) else {
            let message = "this is neither a project of yours nor the repository: make one with `dimsart new-project NAME` \
                           and go there, or name a folder with --folder";
            return Err(message.into());
        };
        let list = Path::new(place.list);
        let text = std::fs::read_to_string(list).map_err(|error| advice(list, &error))?;
        let registered = register::register(&text, &names).ok_or_else(|| {
            format!("{} has no list of modules as `dimsart new-project` makes it", list.display())
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
             {test} {file:24} its loop, against closed forms\n  \
             {command} run scenarios/{file}.toml\n  \
             {command} modules {module}\n\nThe law is `compute` in {modules}/{file}.rs.",
            list.display()
        )?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Writes the first law of a new project and what goes with it.
///
/// # Errors
/// What cannot be written, or is there already.
pub(super) fn write_first(folder: &Path, names: &Names) -> Result<(), String> {
    let [project, _] = &PLACES;
    project.write(folder, names).map(drop)
}

impl Place {
    /// Writes all of it or, where a file is there already, nothing.
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
                "{} is there already: choose another name; nothing was changed",
                there.display()
            ));
        }
        for (path, text) in &files {
            write_new(path, text).map_err(|error| advice(path, &error))?;
        }
        Ok(files.map(|(path, _)| path).to_vec())
    }
}

/// Never writes over a file that is there.
fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes())
}

fn advice(path: &Path, error: &io::Error) -> String {
    let next = match error.kind() {
        io::ErrorKind::AlreadyExists => "choose another name; nothing was changed",
        io::ErrorKind::NotFound => "make the folder, or name another one with --folder",
        _ => "name another folder with --folder",
    };
    format!("cannot write {}: {error}; {next}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::{
        AxisKind, Command, DeviceDescriptor, Dimsart, ProvidedMemory, Tick, Value, Word, types,
    };

    /// What an engineer who registers the template gets.
    const WITH_TEMPLATE: dimsart_core::Kinds = dimsart_core::kinds![template::Template];

    #[test]
    fn the_template_is_a_module_that_runs_once_registered() {
        // A device that measures both positions lets the spring run by itself.
        let measured = &[types::POSITION, types::DES_POSITION];
        let device =
            DeviceDescriptor::new("arm", &[AxisKind::Linear; 2], 1e-3, measured, &[types::DES_FORCE]);
        let mut dimsart = Dimsart::new(ProvidedMemory::leaked(), device.unwrap(), WITH_TEMPLATE).unwrap();
        let module = WITH_TEMPLATE.module("TEMPLATE_MOD").unwrap();
        dimsart.command(Command::set(module, 0, Value::Real(1000.0))).unwrap();
        dimsart.command(Command::PlugIn(module)).unwrap();
        dimsart.command(Command::Check).unwrap();
        let mut force = [Word(0); 2];
        let measured = [0.25, 0.5, 0.75, 0.25].map(Word::from);
        assert_eq!(dimsart.tick(&measured, &mut force), Tick::Ran);
        assert_eq!(force, [500.0, -250.0].map(Word::from));
    }
}
