//! `dimsart new-module`: writes the template of a new control law.
//!
//! The template is a module that the tests compile and run; a new one is a copy with other names.

// What is compiled here is the template itself.
#[cfg(test)]
#[expect(unreachable_pub, reason = "public where it is copied to")]
mod template;

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dimsart_core::ModuleList;
use dimsart_core::modules::Standard;

use super::Ending;

const TEMPLATE: &str = include_str!("new_module/template.rs");

/// Words that Rust or the template itself uses: no name for a file or a type.
const RESERVED: &[&str] = &[
    "abstract",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "const",
    "context",
    "continue",
    "crate",
    "declare",
    "do",
    "dyn",
    "else",
    "enum",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gains",
    "gen",
    "if",
    "impl",
    "in",
    "input",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "module",
    "move",
    "mut",
    "output",
    "override",
    "parameters",
    "per_axis",
    "ports",
    "priv",
    "pub",
    "ref",
    "return",
    "self",
    "static",
    "struct",
    "super",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "unit",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "words",
    "yield",
];

/// Write a new module from the template and say how to register it.
///
/// The file is a whole module: a spring with one parameter, two inputs and one output. Change the law in `compute`,
/// then the parameters and ports that it needs.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct NewModule {
    /// Name in words, such as `damped-spring`.
    name: String,
    /// Folder for the file.
    #[arg(long, default_value = "dimsart-core/src/modules")]
    folder: PathBuf,
}

const EXAMPLES: &str = "\
Example, in the folder of the repository:
  dimsart new-module damped-spring     writes dimsart-core/src/modules/damped_spring.rs with DAMPED_SPRING_MOD
  (add the three lines that it prints to dimsart-core/src/modules.rs)
  cargo run --release -- modules DAMPED_SPRING_MOD";

/// The names of a module, from the words of its name.
#[derive(Debug, PartialEq, Eq)]
struct Names {
    /// `damped_spring`
    file: String,
    /// `DampedSpring`
    kind: String,
    /// `Damped spring`
    words: String,
    /// `DAMPED_SPRING_MOD`
    module: String,
}

impl Names {
    fn new(name: &str) -> Result<Self, String> {
        let mut words: Vec<String> = name.split(['-', '_', ' ']).map(str::to_lowercase).collect();
        // Its name in schemes says the same.
        words.pop_if(|last| last == "mod" && name.len() > "mod".len());
        let is_word = |word: &String| {
            word.starts_with(|first: char| first.is_ascii_lowercase())
                && word.chars().all(|letter| letter.is_ascii_alphanumeric())
        };
        let advice = "use words of ASCII letters and digits, such as damped-spring";
        if !words.iter().all(is_word) {
            return Err(format!("'{name}' is no name for a module: {advice}"));
        }
        let file = words.join("_");
        if RESERVED.contains(&file.as_str()) {
            return Err(format!(
                "'{name}' is taken by the language or the template: add a word, such as my-{name}"
            ));
        }
        let module = format!("{}_MOD", file.to_uppercase());
        if Standard::KINDS.iter().any(|kind| kind.name == module) {
            return Err(format!("there is a module {module} already: choose another name"));
        }
        let kind = words.iter().map(|word| capitalised(word)).collect();
        Ok(Self { file, kind, words: capitalised(&words.join(" ")), module })
    }

    /// The lines that make it part of the library.
    fn registration(&self) -> [String; 3] {
        let Self { file, kind, .. } = self;
        [format!("pub mod {file};"), format!("pub use {file}::{kind};"), format!("{kind}({kind}),")]
    }

    /// The template with these names, to stand within the core.
    fn text(&self) -> String {
        TEMPLATE
            .replace("TEMPLATE_MOD", &self.module)
            .replace("//! Template:", &format!("//! {}:", self.words))
            .replace("Template", &self.kind)
            .replace("use dimsart_core::", "use crate::")
    }
}

impl NewModule {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let names = Names::new(&self.name)?;
        let path = self.folder.join(format!("{}.rs", names.file));
        write_new(&path, &names.text()).map_err(|error| advice(&path, &error))?;
        writeln!(out, "wrote {}", path.display())?;
        writeln!(out, "register it with these lines, each among its like, in dimsart-core/src/modules.rs:")?;
        for line in names.registration() {
            writeln!(out, "  {line}")?;
        }
        writeln!(out, "then see it with `cargo run --release -- modules {}`", names.module)?;
        Ok(ExitCode::SUCCESS)
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
        io::ErrorKind::NotFound => "run it in the folder of the repository, or name a folder with --folder",
        _ => "name another folder with --folder",
    };
    format!("cannot write {}: {error}; {next}", path.display())
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::{AxisKind, Command, DeviceDescriptor, Dimsart, Engine, Tick, Value, Word, types};

    dimsart_core::module_list! {
        /// What an engineer who registers the template gets.
        enum WithTemplate { Template(template::Template) }
    }

    #[test]
    fn the_template_is_a_module_that_runs_once_registered() {
        // A device that measures both positions lets the spring run by itself.
        let measured = &[types::POSITION, types::DES_POSITION];
        let device =
            DeviceDescriptor::new("arm", &[AxisKind::Linear; 2], 1e-3, measured, &[types::DES_FORCE]);
        let mut dimsart: Dimsart<WithTemplate> = Dimsart::new(device.unwrap()).unwrap();
        let module = Engine::<WithTemplate>::module("TEMPLATE_MOD").unwrap();
        dimsart.command(Command::set(module, 0, Value::Real(1000.0))).unwrap();
        dimsart.command(Command::PlugIn(module)).unwrap();
        dimsart.command(Command::Check).unwrap();
        let mut force = [Word(0); 2];
        let measured = [0.25, 0.5, 0.75, 0.25].map(Word::from);
        assert_eq!(dimsart.tick(&measured, &mut force), Tick::Ran);
        assert_eq!(force, [500.0, -250.0].map(Word::from));
    }

    #[test]
    fn a_new_module_is_the_template_under_its_own_names() {
        let names = Names::new("Damped spring").unwrap();
        assert_eq!((names.file.as_str(), names.module.as_str()), ("damped_spring", "DAMPED_SPRING_MOD"));
        assert_eq!(Names::new("DAMPED_SPRING_MOD").unwrap(), names);
        let text = names.text();
        assert!(text.starts_with("//! Damped spring: "), "{text}");
        assert!(!text.to_lowercase().contains("template") && !text.contains("dimsart_core"), "{text}");
        assert_eq!(text.matches("DampedSpring").count(), TEMPLATE.matches("Template").count() - 1);
        // Under the template's own names it is the template again: no line comes or goes.
        let again = text.replace("DAMPED_SPRING_MOD", "TEMPLATE_MOD").replace("DampedSpring", "Template");
        let again = again.replace("//! Damped spring:", "//! Template:").replace("crate::", "dimsart_core::");
        assert_eq!(again, TEMPLATE);
    }

    #[test]
    fn a_module_is_registered_like_those_that_are() {
        let library = include_str!("../../../dimsart-core/src/modules.rs");
        let text = || String::new();
        let p = Names { file: "p".into(), kind: "P".into(), words: text(), module: text() };
        for line in p.registration() {
            assert!(library.lines().any(|found| found.trim() == line), "{line}");
        }
    }

    #[test]
    fn a_name_that_would_not_compile_is_refused_with_a_way_out() {
        for (name, way_out) in [
            ("9x", "use words"),
            ("", "use words"),
            ("damped--spring", "use words"),
            ("Ünwucht", "use words"),
            ("type", "add a word, such as my-type"),
            ("per-axis", "add a word"),
            ("Input", "add a word"),
            ("pdctrl", "there is a module PDCTRL_MOD already"),
        ] {
            let message = Names::new(name).unwrap_err();
            assert!(message.contains(way_out), "{name}: {message}");
        }
    }
}
