//! Declarations that an image does not contain: the targets of calls through pointers, and the nesting of
//! functions.
//!
//! ```text
//! # A function that calls through pointers, and the possible targets.
//! embassy_executor::*::on_interrupt from CORDIC
//!     embassy_executor::raw::TaskStorage<F>::poll reaching dimsart_tick
//! # A function that can be on the stack more than once.
//! at most 2 __rustc::rust_begin_unwind
//! # A function that masks all interrupts and never returns.
//! last firmware::rescue::rescue
//! # Interrupts that do nothing until the program has returned from the early functions.
//! late CORDIC
//! early dimsart_link::saved_scheme::load
//! ```
//!
//! Names have the form of [`Function::names`]; `*` matches any text. `from` applies to calls from this
//! interrupt handler only; `reaching` and `not reaching` select among functions with the same name by their
//! direct and indirect callees. `if any NAME` is an optional callee: if the image does not contain it, the
//! call is never made.

use crate::image::Function;

/// A parsed declaration text.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CallDeclarations {
    /// Calls through pointers.
    pub callers: Vec<Caller>,
    /// Functions with the maximum number of times that they can be on the stack, in total per name.
    pub nesting: Vec<(u32, NamePattern)>,
    /// Functions that only non-maskable exceptions can interrupt and that never return.
    pub last: Vec<NamePattern>,
    /// Interrupt handlers that do nothing while the program is in one of the early functions.
    pub late: Vec<NamePattern>,
    /// Functions that the program never executes again after a late handler first does something.
    pub early: Vec<NamePattern>,
}

/// A function that calls through pointers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caller {
    /// Name of the function.
    pub name: NamePattern,
    /// The interrupt handler from which the function is called, if the declaration is limited to these calls.
    pub from: Option<NamePattern>,
    /// Possible callees.
    pub callees: Vec<Callee>,
}

/// A possible callee.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Callee {
    /// Name of the function.
    pub name: NamePattern,
    /// Whether the image may lack it.
    pub is_optional: bool,
    /// A function that the callee calls directly or indirectly (true) or does not call (false).
    pub reaching: Option<(bool, NamePattern)>,
}

/// A function name pattern; `*` matches any text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamePattern(String);

/// Syntax error in a declaration text.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct DeclarationError {
    line: usize,
    problem: &'static str,
}

impl CallDeclarations {
    /// Parses a declaration text.
    ///
    /// # Errors
    /// [`DeclarationError`].
    pub fn read(text: &str) -> Result<Self, DeclarationError> {
        let mut declared = Self::default();
        let mut line_of_caller = 0;
        for (line, text) in (1..).zip(text.lines()) {
            let error = |problem| DeclarationError { line, problem };
            let words = text.trim();
            if words.is_empty() || words.starts_with('#') {
                continue;
            }
            if text.starts_with(char::is_whitespace) {
                let caller = declared.callers.last_mut();
                let caller = caller.ok_or(error("indented callee without a caller line above it"))?;
                caller.callees.push(Callee::read(words));
            } else if let Some(rest) = words.strip_prefix("at most ") {
                let (times, name) = rest.split_once(' ').ok_or(error("expected `at most N NAME`"))?;
                let times = times.parse().map_err(|_| error("expected `at most N NAME`"))?;
                declared.nesting.push((times, NamePattern::new(name)));
            } else if let Some(name) = words.strip_prefix("last ") {
                declared.last.push(NamePattern::new(name));
            } else if let Some(name) = words.strip_prefix("late ") {
                declared.late.push(NamePattern::new(name));
            } else if let Some(name) = words.strip_prefix("early ") {
                declared.early.push(NamePattern::new(name));
            } else {
                let (name, from) = match words.split_once(" from ") {
                    Some((name, from)) => (name, Some(NamePattern::new(from))),
                    None => (words, None),
                };
                declared.has_callees(line_of_caller)?;
                line_of_caller = line;
                declared.callers.push(Caller { name: NamePattern::new(name), from, callees: Vec::new() });
            }
        }
        declared.has_callees(line_of_caller)?;
        Ok(declared)
    }

    /// Rejects a last caller without callees: it would count as a function without calls.
    fn has_callees(&self, line: usize) -> Result<(), DeclarationError> {
        let is_empty = self.callers.last().is_some_and(|caller| caller.callees.is_empty());
        let problem = "caller without callees: list them indented below it";
        if is_empty { Err(DeclarationError { line, problem }) } else { Ok(()) }
    }
}

impl Callee {
    fn read(words: &str) -> Self {
        let (is_optional, words) = words.strip_prefix("if any ").map_or((false, words), |rest| (true, rest));
        let split = |mark| words.split_once(mark);
        let (name, reaching) = match (split(" not reaching "), split(" reaching ")) {
            (Some((name, other)), _) => (name, Some((false, NamePattern::new(other)))),
            (None, Some((name, other))) => (name, Some((true, NamePattern::new(other)))),
            (None, None) => (words, None),
        };
        Self { name: NamePattern::new(name), is_optional, reaching }
    }
}

impl NamePattern {
    /// Creates a pattern from its text.
    #[must_use]
    pub fn new(text: &str) -> Self {
        Self(text.trim().to_owned())
    }

    /// Whether a name of the function matches.
    #[must_use]
    pub fn matches(&self, function: &Function) -> bool {
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

impl core::fmt::Display for NamePattern {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{CallDeclarations, Callee, NamePattern};

    #[test]
    fn a_text_declares_callers_callees_and_nesting() {
        let text = "# why\na::* from H\n    b reaching tick\n    b not reaching tick\n\nat most 2 panic\nc\n    if any d\n";
        let declared = CallDeclarations::read(text).unwrap();
        assert_eq!(declared.nesting, [(2, NamePattern::new("panic"))]);
        let [a, c] = &declared.callers[..] else { panic!("two callers") };
        assert_eq!((&a.name, &a.from), (&NamePattern::new("a::*"), &Some(NamePattern::new("H"))));
        let b = |reaches| Callee {
            name: NamePattern::new("b"),
            is_optional: false,
            reaching: Some((reaches, NamePattern::new("tick"))),
        };
        assert_eq!(a.callees, [b(true), b(false)]);
        let d = Callee { name: NamePattern::new("d"), is_optional: true, reaching: None };
        assert_eq!((&c.from, &c.callees[..]), (&None, &[d][..]));
    }

    #[test]
    fn a_syntax_error_names_its_line() {
        let error = |text| CallDeclarations::read(text).unwrap_err().to_string();
        assert!(error("\n    callee").starts_with("line 2: "));
        assert!(error("at most two f").starts_with("line 1: "));
        // Otherwise it would count as a function without calls.
        assert!(error("# why\na\n\nb\n    c").starts_with("line 2: "));
        assert!(error("a\n    b\nc from d\nat most 2 e").starts_with("line 3: "));
    }

    #[test]
    fn a_star_matches_any_text() {
        let fits = |pattern: &str, name| NamePattern::new(pattern).fits(name);
        assert!(fits("a::b", "a::b") && !fits("a::b", "a::bc"));
        assert!(fits("a::*", "a::b::c") && !fits("a::*", "b::a::c"));
        assert!(fits("*::c", "a::c") && !fits("*::c", "a::cd"));
        assert!(fits("a*b*c", "axxbyyc") && !fits("a*b*c", "axxcyyb"));
        assert!(fits("a*a", "aa") && !fits("a*a", "a"));
    }
}
