//! The names of a new module.

use dimsart_core::ModuleKinds;

/// Words reserved by Rust or used by the template.
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

/// The names of a module, from the words of its name.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::cli) struct Names {
    /// `damped_spring`
    pub(in crate::cli) file: String,
    /// `DampedSpring`
    pub(super) kind: String,
    /// `Damped spring`
    pub(super) words: String,
    /// `DAMPED_SPRING_MOD`
    pub(in crate::cli) module: String,
}

impl Names {
    /// Derives the names of a module from the words of its name.
    ///
    /// # Errors
    /// The name is invalid; the text suggests a valid one.
    pub(in crate::cli) fn new(name: &str, kinds: ModuleKinds) -> Result<Self, String> {
        let mut words: Vec<String> = name.split(['-', '_', ' ']).map(str::to_lowercase).collect();
        // `_MOD` is added to the name in schemes.
        words.pop_if(|last| last == "mod" && name.len() > "mod".len());
        let is_word = |word: &String| {
            word.starts_with(|first: char| first.is_ascii_lowercase())
                && word.chars().all(|letter| letter.is_ascii_alphanumeric())
        };
        let advice = "use words of ASCII letters and digits that start with a letter, such as damped-spring";
        if !words.iter().all(is_word) {
            return Err(format!("invalid module name '{name}': {advice}"));
        }
        let file = words.join("_");
        if RESERVED.contains(&file.as_str()) {
            return Err(format!(
                "module name '{name}' is reserved by Rust or by the template: add a word, such as my-{name}"
            ));
        }
        let module = format!("{}_MOD", file.to_uppercase());
        if kinds.list().iter().any(|kind| kind.name == module) {
            return Err(format!("module {module} already exists: choose another name"));
        }
        let kind = words.iter().map(|word| capitalised(word)).collect();
        Ok(Self { file, kind, words: capitalised(&words.join(" ")), module })
    }

    /// Fills these names into a template.
    pub(in crate::cli) fn fill(&self, template: &str) -> String {
        template
            .replace("TEMPLATE_MOD", &self.module)
            .replace("Template:", &format!("{}:", self.words))
            .replace("Template", &self.kind)
            .replace("template", &self.file)
    }
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;

    #[test]
    fn names_come_from_words_or_from_what_schemes_call_it() {
        let names = Names::new("Damped spring", ALL).unwrap();
        assert_eq!((names.file.as_str(), names.module.as_str()), ("damped_spring", "DAMPED_SPRING_MOD"));
        assert_eq!(Names::new("DAMPED_SPRING_MOD", ALL).unwrap(), names);
        let filled = names.fill("//! Template: Template, template and TEMPLATE_MOD");
        assert_eq!(filled, "//! Damped spring: DampedSpring, damped_spring and DAMPED_SPRING_MOD");
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
            ("pdctrl", "module PDCTRL_MOD already exists"),
        ] {
            let message = Names::new(name, ALL).unwrap_err();
            assert!(message.contains(way_out), "{name}: {message}");
        }
    }
}
