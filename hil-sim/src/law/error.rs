//! Errors of laws: message, position and remedy.

use std::fmt;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};

/// An error at a position of the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Problem {
    /// Position in the text, bytes.
    pub(super) span: Range<usize>,
    /// Message.
    pub(super) message: String,
    /// Remedy.
    pub(super) help: String,
}

impl Problem {
    pub(super) fn new(span: Range<usize>, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { span, message: message.into(), help: help.into() }
    }
}

/// Compile error of a law: line, column, the marked line, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LawError {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// Message.
    pub message: String,
    /// Remedy.
    pub help: String,
    text: String,
}

impl LawError {
    pub(super) fn new(problem: Problem, text: &str, origin: &str) -> Self {
        let Problem { span, message, help } = problem;
        let before = text.get(..span.start).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        let mark = AnnotationKind::Primary.span(span);
        let snippet = Snippet::source(text).path(origin).annotation(mark);
        let title = Level::ERROR.primary_title(message.as_str()).element(snippet);
        let report = &[title.element(Level::HELP.message(help.as_str()))];
        let text = Renderer::plain().render(report);
        Self { line, column, message, help, text }
    }
}

impl fmt::Display for LawError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for LawError {}
