//! Splits text into words, numbers and signs.

use winnow::ascii::digit1;
use winnow::combinator::{alt, delimited, fail, opt, repeat};
use winnow::error::{ContextError, ErrMode};
use winnow::prelude::*;
use winnow::stream::{LocatingSlice, Location as _};
use winnow::token::{any, none_of, one_of, take_while};

use super::error::Problem;
use super::syntax::Span;

/// A token with its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token<'t> {
    pub(super) kind: Kind,
    pub(super) text: &'t str,
    pub(super) span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Word,
    Number,
    /// Including quotation marks.
    Text,
    Sign,
    /// The end of a statement, or of the text.
    End,
}

/// Maximum open parentheses, and maximum tokens per statement: limits the recursion of the parser.
const MAX_OPEN: usize = 32;
const MAX_TOKENS: usize = 300;

type Input<'t> = LocatingSlice<&'t str>;

/// Signs of two characters come first.
const SIGNS: [&str; 19] =
    ["..", "<=", ">=", "==", "!=", "<", ">", "=", "+", "-", "*", "/", "(", ")", "[", "]", ":", ",", "."];

/// Splits a text into tokens; the last one is [`Kind::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<Token<'_>>, Problem> {
    let mut input = LocatingSlice::new(text);
    let (mut tokens, mut open) = (Vec::new(), 0_usize);
    loop {
        if blank.parse_next(&mut input).is_err() || input.is_empty() {
            break;
        }
        let start = input.current_token_start();
        let Ok((kind, found)) = token.parse_next(&mut input) else {
            let rest = text.get(start..).unwrap_or_default();
            let wrong: String = rest.chars().take(1).collect();
            let span = start..start + wrong.len();
            return Err(match wrong.as_str() {
                "\"" => Problem::new(
                    span,
                    "missing closing quotation mark",
                    "close the text with a quotation mark on the same line",
                ),
                _ => Problem::new(
                    span,
                    format!("invalid character `{wrong}`"),
                    "a law consists of words, numbers, quoted texts, and + - * / < > = ( ) [ ] : ,",
                ),
            });
        };
        let depth = tokens.iter().rev().take_while(|token: &&Token<'_>| token.kind != Kind::End).count();
        if open > MAX_OPEN || depth > MAX_TOKENS {
            let help = "split the statement with `let`";
            return Err(Problem::new(start..start + found.len(), "statement too long", help));
        }
        match found {
            "(" => open += 1,
            ")" => open = open.saturating_sub(1),
            _ => {}
        }
        // Inside parentheses a newline does not end the statement.
        if kind != Kind::End || open == 0 {
            tokens.push(Token { kind, text: found, span: start..input.current_token_start() });
        }
    }
    tokens.push(Token { kind: Kind::End, text: "", span: text.len()..text.len() });
    Ok(tokens)
}

/// Skips whitespace and comments.
fn blank(input: &mut Input<'_>) -> Result<(), ErrMode<ContextError>> {
    let comment = ('#', take_while(0.., |letter| letter != '\n')).void();
    let blanks = take_while(1.., |letter: char| letter != '\n' && letter.is_whitespace()).void();
    repeat(0.., alt((blanks, comment))).parse_next(input)
}

fn token<'t>(input: &mut Input<'t>) -> Result<(Kind, &'t str), ErrMode<ContextError>> {
    let word = (
        any.verify(|letter: &char| letter.is_alphabetic() || *letter == '_'),
        take_while(0.., |letter: char| letter.is_alphanumeric() || letter == '_'),
    );
    let fraction = ('.', digit1);
    let exponent = (one_of(['e', 'E']), opt(one_of(['+', '-'])), digit1);
    let number = (digit1, opt(fraction), opt(exponent));
    let letters = repeat::<_, _, (), _, _>(0.., none_of(['"', '\n']));
    alt((
        word.take().map(|found| (Kind::Word, found)),
        number.take().map(|found| (Kind::Number, found)),
        delimited('"', letters, '"').take().map(|found| (Kind::Text, found)),
        '\n'.take().map(|found| (Kind::End, found)),
        sign.map(|found| (Kind::Sign, found)),
    ))
    .parse_next(input)
}

fn sign<'t>(input: &mut Input<'t>) -> Result<&'t str, ErrMode<ContextError>> {
    let rest: &str = input.as_ref();
    match SIGNS.iter().copied().find(|sign| rest.starts_with(*sign)) {
        Some(mut found) => found.parse_next(input),
        None => fail.parse_next(input),
    }
}
