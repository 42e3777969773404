//! Syntax tree of a law, before name resolution.

use std::ops::Range;

use dimsart_core::online::Opcode;

/// Position in the text, bytes.
pub(super) type Span = Range<usize>;

/// A word with its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Word {
    pub(super) text: String,
    pub(super) span: Span,
}

/// A statement.
#[derive(Debug, Clone)]
pub(super) enum Statement {
    Law { name: Word, summary: String },
    Port { name: Word, is_output: bool, signal: Word },
    Parameter { name: Word, unit: Option<Word>, default: Number, range: Option<[Number; 2]>, summary: String },
    State { name: Word, first: Expression },
    Let { name: Word, value: Expression },
    Assign { name: Word, axis: Option<Axis>, value: Expression },
}

/// A number with its position.
#[derive(Debug, Clone)]
pub(super) struct Number {
    pub(super) value: f32,
    pub(super) span: Span,
}

/// An axis index.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) number: u8,
    pub(super) span: Span,
}

/// An expression with its position.
#[derive(Debug, Clone)]
pub(super) struct Expression {
    pub(super) what: What,
    pub(super) span: Span,
}

#[derive(Debug, Clone)]
pub(super) enum What {
    Number(f32),
    Name { name: Word, axis: Option<Axis> },
    Last { output: Word, axis: Option<Axis> },
    Call { function: Word, arguments: Vec<Expression> },
    Binary { operator: Binary, sides: Box<[Expression; 2]> },
    Negate(Box<Expression>),
    Not(Box<Expression>),
    If { parts: Box<[Expression; 3]> },
}

/// A binary operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
    And,
    Or,
}

/// Functions by name, with opcode and number of arguments.
pub(super) const FUNCTIONS: &[(&str, Opcode, usize)] = &[
    ("abs", Opcode::Absolute, 1),
    ("sqrt", Opcode::SquareRoot, 1),
    ("sin", Opcode::Sine, 1),
    ("cos", Opcode::Cosine, 1),
    ("atan2", Opcode::Arctangent, 2),
    ("min", Opcode::Minimum, 2),
    ("max", Opcode::Maximum, 2),
    ("clamp", Opcode::Clamp, 3),
];

/// Reserved words.
pub(super) const KEYWORDS: &[&str] = &[
    "law", "in", "out", "param", "state", "let", "if", "then", "else", "and", "or", "not", "last", "pi",
    "period",
];
