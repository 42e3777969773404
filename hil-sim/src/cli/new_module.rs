//! `dimsart new-module`: writes the template of a new control law.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::Ending;

const TEMPLATE: &str = include_str!("template.rs.txt");

/// Write a new module from the template and say how to register it.
#[derive(Debug, Args)]
pub(super) struct NewModule {
    /// Name in words, such as `damped-spring`.
    name: String,
    /// Folder for the file.
    #[arg(long, default_value = "dimsart-core/src/modules")]
    folder: PathBuf,
}

impl NewModule {
    pub(super) fn execute(self) -> Ending {
        let words: Vec<String> = self.name.split(['-', '_', ' ']).map(str::to_lowercase).collect();
        let is_word = |word: &String| {
            word.starts_with(|first: char| first.is_ascii_lowercase())
                && word.chars().all(|letter| letter.is_ascii_alphanumeric())
        };
        if !words.iter().all(is_word) {
            return Err(format!(
                "'{}' is no name for a module: use words of ASCII letters and digits, such as damped-spring",
                self.name
            )
            .into());
        }
        let file = words.join("_");
        let path = self.folder.join(format!("{file}.rs"));
        let text = TEMPLATE
            .replace("{Type}", &words.iter().map(|word| capitalised(word)).collect::<String>())
            .replace("{Words}", &capitalised(&words.join(" ")))
            .replace("{NAME}", &file.to_uppercase());
        write_new(&path, &text).map_err(|error| {
            format!(
                "cannot write {}: {error}; choose another name, or another folder with --folder",
                path.display()
            )
        })?;
        let kind = words.iter().map(|word| capitalised(word)).collect::<String>();
        println!("wrote {}", path.display());
        println!("register it in dimsart-core/src/modules.rs:");
        println!("  mod {file};");
        println!("  pub use {file}::{kind};");
        println!("  {kind}({kind}),          in the list");
        Ok(ExitCode::SUCCESS)
    }
}

/// Never writes over a file that is there.
fn write_new(path: &std::path::Path, text: &str) -> std::io::Result<()> {
    use std::io::Write;
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).open(path)?;
    file.write_all(text.as_bytes())
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}
