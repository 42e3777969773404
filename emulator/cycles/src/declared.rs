//! What an image does not say of itself: whom a call through a pointer calls, and how often a function nests.
//!
//! ```text
//! # A function that calls through pointers, and what they can point to.
//! embassy_executor::*::on_interrupt from CORDIC
//!     embassy_executor::raw::TaskStorage<F>::poll reaching dimsart_tick
//! # A function that can be on the stack more than once.
//! at most 2 __rustc::rust_begin_unwind
//! # A function that masks all interrupts and never returns.
//! last firmware::rescue::rescue
//! # Interrupts that do nothing before the program has come back from some functions.
//! late CORDIC
//! early dimsart_link::saved_scheme::load
//! ```
//!
//! Names are as [`Function::names`] has them, `*` stands for any text in them. `from` is for calls on behalf of this
//! interrupt handler alone; `reaching` and `not reaching` choose among functions of one name by what they call in turn.
//! `if any NAME` is a callee that an image can lack: without it the call is never made.

use crate::image::Function;

/// A text of that form, read.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Declared {
    /// Calls through pointers.
    pub callers: Vec<Caller>,
    /// Functions that can be on the stack this often, all of them together.
    pub nesting: Vec<(u32, Name)>,
    /// Functions that nothing interrupts but what cannot be masked, and that never return.
    pub last: Vec<Name>,
    /// Interrupt handlers that do nothing while the program is in one of the early functions.
    pub late: Vec<Name>,
    /// Functions that the program has left for good when a late handler does something.
    pub early: Vec<Name>,
}

/// A function that calls through pointers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caller {
    /// Its name.
    pub name: Name,
    /// The interrupt handler that it is called from, if only such calls are meant.
    pub from: Option<Name>,
    /// What it can call.
    pub callees: Vec<Callee>,
}

/// What can be called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Callee {
    /// Its name.
    pub name: Name,
    /// Whether an image can lack it.
    pub is_optional: bool,
    /// A function that it reaches (true) or does not.
    pub reaching: Option<(bool, Name)>,
}

/// Names of functions, `*` for any text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Name(String);

/// Why a text is none of that form.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct DeclaredError {
    line: usize,
    problem: &'static str,
}

impl Declared {
    /// Reads a text.
    ///
    /// # Errors
    /// [`DeclaredError`].
    pub fn read(text: &str) -> Result<Self, DeclaredError> {
        let mut declared = Self::default();
        let mut line_of_caller = 0;
        for (line, text) in (1..).zip(text.lines()) {
            let error = |problem| DeclaredError { line, problem };
            let words = text.trim();
            if words.is_empty() || words.starts_with('#') {
                continue;
            }
            if text.starts_with(char::is_whitespace) {
                let caller = declared.callers.last_mut();
                let caller = caller.ok_or(error("an indented line names a callee; no caller is above it"))?;
                caller.callees.push(Callee::read(words));
            } else if let Some(rest) = words.strip_prefix("at most ") {
                let (times, name) = rest.split_once(' ').ok_or(error("write `at most N NAME`"))?;
                let times = times.parse().map_err(|_| error("write `at most N NAME`"))?;
                declared.nesting.push((times, Name::new(name)));
            } else if let Some(name) = words.strip_prefix("last ") {
                declared.last.push(Name::new(name));
            } else if let Some(name) = words.strip_prefix("late ") {
                declared.late.push(Name::new(name));
            } else if let Some(name) = words.strip_prefix("early ") {
                declared.early.push(Name::new(name));
            } else {
                let (name, from) = match words.split_once(" from ") {
                    Some((name, from)) => (name, Some(Name::new(from))),
                    None => (words, None),
                };
                declared.has_callees(line_of_caller)?;
                line_of_caller = line;
                declared.callers.push(Caller { name: Name::new(name), from, callees: Vec::new() });
            }
        }
        declared.has_callees(line_of_caller)?;
        Ok(declared)
    }

    /// Refuses a last caller without callees: it would be taken to call nothing.
    fn has_callees(&self, line: usize) -> Result<(), DeclaredError> {
        let is_empty = self.callers.last().is_some_and(|caller| caller.callees.is_empty());
        let problem = "a caller without callees; name them below it, indented";
        if is_empty { Err(DeclaredError { line, problem }) } else { Ok(()) }
    }
}

impl Callee {
    fn read(words: &str) -> Self {
        let (is_optional, words) = words.strip_prefix("if any ").map_or((false, words), |rest| (true, rest));
        let split = |mark| words.split_once(mark);
        let (name, reaching) = match (split(" not reaching "), split(" reaching ")) {
            (Some((name, other)), _) => (name, Some((false, Name::new(other)))),
            (None, Some((name, other))) => (name, Some((true, Name::new(other)))),
            (None, None) => (words, None),
        };
        Self { name: Name::new(name), is_optional, reaching }
    }
}

impl Name {
    /// Of a text.
    #[must_use]
    pub fn new(text: &str) -> Self {
        Self(text.trim().to_owned())
    }

    /// Whether a function has such a name.
    #[must_use]
    pub fn is_of(&self, function: &Function) -> bool {
        function.names.iter().any(|name| self.fits(name))
    }

    fn fits(&self, name: &str) -> bool {
        let Some((begin, rest)) = self.0.split_once('*') else { return self.0 == name };
        let Some(mut left) = name.strip_prefix(begin) else { return false };
        let (middle, end) = rest.rsplit_once('*').map_or((None, rest), |(middle, end)| (Some(middle), end));
        for part in middle.into_iter().flat_map(|middle| middle.split('*')) {
            let Some(place) = left.find(part) else { return false };
            left = left.get(place + part.len()..).unwrap_or_default();
        }
        left.ends_with(end)
    }
}

impl core::fmt::Display for Name {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{Callee, Declared, Name};

    #[test]
    fn a_text_declares_callers_callees_and_nesting() {
        let text = "# why\na::* from H\n    b reaching tick\n    b not reaching tick\n\nat most 2 panic\nc\n    if any d\n";
        let declared = Declared::read(text).unwrap();
        assert_eq!(declared.nesting, [(2, Name::new("panic"))]);
        let [a, c] = &declared.callers[..] else { panic!("two callers") };
        assert_eq!((&a.name, &a.from), (&Name::new("a::*"), &Some(Name::new("H"))));
        let b = |reaches| Callee {
            name: Name::new("b"),
            is_optional: false,
            reaching: Some((reaches, Name::new("tick"))),
        };
        assert_eq!(a.callees, [b(true), b(false)]);
        let d = Callee { name: Name::new("d"), is_optional: true, reaching: None };
        assert_eq!((&c.from, &c.callees[..]), (&None, &[d][..]));
    }

    #[test]
    fn what_is_not_of_the_form_is_refused_with_its_line() {
        let error = |text| Declared::read(text).unwrap_err().to_string();
        assert!(error("\n    callee").starts_with("line 2: "));
        assert!(error("at most two f").starts_with("line 1: "));
        // It would be taken to call nothing.
        assert!(error("# why\na\n\nb\n    c").starts_with("line 2: "));
        assert!(error("a\n    b\nc from d\nat most 2 e").starts_with("line 3: "));
    }

    #[test]
    fn a_star_stands_for_any_text() {
        let fits = |pattern: &str, name| Name::new(pattern).fits(name);
        assert!(fits("a::b", "a::b") && !fits("a::b", "a::bc"));
        assert!(fits("a::*", "a::b::c") && !fits("a::*", "b::a::c"));
        assert!(fits("*::c", "a::c") && !fits("*::c", "a::cd"));
        assert!(fits("a*b*c", "axxbyyc") && !fits("a*b*c", "axxcyyb"));
        assert!(fits("a*a", "aa") && !fits("a*a", "a"));
    }
}
