//! Parses tokens into statements.

use winnow::combinator::{Infix, Prefix, alt, expression, opt, repeat, separated};
use winnow::error::{ErrMode, ParserError};
use winnow::prelude::*;
use winnow::stream::{Stream, TokenSlice};
use winnow::token::any;

use super::error::Problem;
use super::syntax::{Axis, Binary, Expression, KEYWORDS, Number, Statement, What, Word};
use super::tokens::{Kind, Token, tokens};

type Input<'t> = TokenSlice<'t, Token<'t>>;
type Parsed<T> = Result<T, ErrMode<Problem>>;

/// Parses the statements of a text.
pub(super) fn parse(text: &str) -> Result<Vec<Statement>, Problem> {
    let tokens = tokens(text)?;
    let mut input = TokenSlice::new(&tokens);
    let mut statements = Vec::new();
    loop {
        let _ = repeat::<_, _, (), ErrMode<Problem>, _>(0.., end).parse_next(&mut input);
        if input.is_empty() {
            return Ok(statements);
        }
        let read = statement.parse_next(&mut input).map_err(problem)?;
        must(end, "the end of the statement", "start the next statement on a new line")
            .parse_next(&mut input)
            .map_err(problem)?;
        statements.push(read);
    }
}

fn problem(error: ErrMode<Problem>) -> Problem {
    match error {
        ErrMode::Backtrack(found) => {
            Problem::new(found.span, format!("unexpected {}", found.message), found.help)
        }
        ErrMode::Cut(problem) => problem,
        ErrMode::Incomplete(_) => {
            Problem::new(0..0, "unexpected end of the text", "add a newline at the end")
        }
    }
}

impl<'t> ParserError<Input<'t>> for Problem {
    type Inner = Self;

    fn from_input(input: &Input<'t>) -> Self {
        let (span, found) = match input.peek_token() {
            Some(token) if token.kind != Kind::End => (token.span.clone(), format!("`{}`", token.text)),
            Some(token) => (token.span.start..token.span.start, "the end of the line".to_owned()),
            None => (0..0, "the end of the text".to_owned()),
        };
        Self::new(span, found, "")
    }

    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}

/// Requires a match; reports any other token as "expected …, found …".
fn must<'t, O>(
    mut parser: impl Parser<Input<'t>, O, ErrMode<Problem>>,
    should: &'static str,
    help: &'static str,
) -> impl Parser<Input<'t>, O, ErrMode<Problem>> {
    move |input: &mut Input<'t>| {
        parser.parse_next(input).map_err(|error| match error {
            ErrMode::Backtrack(found) => ErrMode::Cut(Problem::new(
                found.span,
                format!("expected {should}, found {}", found.message),
                help,
            )),
            error => error,
        })
    }
}

fn of_kind<'t>(kind: Kind) -> impl Parser<Input<'t>, Token<'t>, ErrMode<Problem>> {
    any.verify(move |token: &&Token<'t>| token.kind == kind).map(|token: &Token<'t>| token.clone())
}

fn end(input: &mut Input<'_>) -> Parsed<()> {
    of_kind(Kind::End).void().parse_next(input)
}

fn sign<'t>(text: &'static str) -> impl Parser<Input<'t>, Token<'t>, ErrMode<Problem>> {
    of_kind(Kind::Sign).verify(move |token: &Token<'t>| token.text == text)
}

fn keyword<'t>(text: &'static str) -> impl Parser<Input<'t>, Token<'t>, ErrMode<Problem>> {
    of_kind(Kind::Word).verify(move |token: &Token<'t>| token.text == text)
}

fn word(input: &mut Input<'_>) -> Parsed<Word> {
    let token = of_kind(Kind::Word).parse_next(input)?;
    Ok(Word { text: token.text.to_owned(), span: token.span })
}

fn name(input: &mut Input<'_>) -> Parsed<Word> {
    word.verify(|word: &Word| !KEYWORDS.contains(&word.text.as_str())).parse_next(input)
}

/// A name that this statement declares.
fn new_name(input: &mut Input<'_>) -> Parsed<Word> {
    must(name, "a name", "choose a word that is not a keyword, such as `force`").parse_next(input)
}

fn equals(input: &mut Input<'_>) -> Parsed<()> {
    must(sign("="), "`=`", "write `name = value`").void().parse_next(input)
}

fn summary(input: &mut Input<'_>) -> Parsed<String> {
    let text = opt(of_kind(Kind::Text)).parse_next(input)?;
    Ok(text.map_or_else(String::new, |token| token.text.trim_matches('"').to_owned()))
}

fn statement(input: &mut Input<'_>) -> Parsed<Statement> {
    let first = must(
        word,
        "a statement",
        "start with `law`, `in`, `out`, `param`, `state`, `let`, or the name of an output or state",
    )
    .parse_next(input)?;
    match first.text.as_str() {
        "law" => Ok(Statement::Law { name: new_name(input)?, summary: summary(input)? }),
        "in" | "out" => {
            let name = new_name(input)?;
            let help = "write a colon and the signal, such as `in position: POSITION`";
            must(sign(":"), "`:`", help).parse_next(input)?;
            Ok(Statement::Port { name, is_output: first.text == "out", signal: signal(input)? })
        }
        "param" => parameter(input),
        "state" => {
            let name = new_name(input)?;
            equals(input)?;
            Ok(Statement::State { name, first: value(input)? })
        }
        "let" => {
            let name = new_name(input)?;
            equals(input)?;
            Ok(Statement::Let { name, value: value(input)? })
        }
        keyword if KEYWORDS.contains(&keyword) => {
            let help =
                "start with `law`, `in`, `out`, `param`, `state`, `let`, or the name of an output or state";
            Err(ErrMode::Cut(Problem::new(
                first.span,
                format!("a statement cannot start with `{keyword}`"),
                help,
            )))
        }
        _ => {
            let axis = axis(input)?;
            equals(input)?;
            Ok(Statement::Assign { name: first, axis, value: value(input)? })
        }
    }
}

/// `DES_FORCE` or `DES_FORCE.2`.
fn signal(input: &mut Input<'_>) -> Parsed<Word> {
    let help = "write a data type, such as POSITION, or DES_FORCE.2 for the second signal of this type";
    let mut found = must(word, "a data type", help).parse_next(input)?;
    if opt(sign(".")).parse_next(input)?.is_some() {
        let number = must(of_kind(Kind::Number), "a number", help).parse_next(input)?;
        found.text = format!("{}.{}", found.text, number.text);
        found.span.end = number.span.end;
    }
    Ok(found)
}

fn parameter(input: &mut Input<'_>) -> Parsed<Statement> {
    let name = new_name(input)?;
    let unit = if opt(sign(":")).parse_next(input)?.is_some() {
        let help = "write a unit, such as `param stiffness: Stiffness = 100`, or remove the colon for a \
        dimensionless number";
        Some(must(word, "a unit", help).parse_next(input)?)
    } else {
        None
    };
    equals(input)?;
    let default = number(input)?;
    let range = if opt(keyword("in")).parse_next(input)?.is_some() {
        let min = number(input)?;
        let help = "write a range as minimum and maximum, such as `in 0..1000`";
        must(sign(".."), "`..`", help).parse_next(input)?;
        Some([min, number(input)?])
    } else {
        None
    };
    Ok(Statement::Parameter { name, unit, default, range, summary: summary(input)? })
}

fn number(input: &mut Input<'_>) -> Parsed<Number> {
    let minus = opt(sign("-")).parse_next(input)?;
    let token = must(of_kind(Kind::Number), "a number", "write a number such as 100, -0.5 or 1e-3")
        .parse_next(input)?;
    let value = read(&token)?;
    let start = minus.as_ref().map_or(token.span.start, |minus| minus.span.start);
    Ok(Number { value: if minus.is_some() { -value } else { value }, span: start..token.span.end })
}

fn read(token: &Token<'_>) -> Parsed<f32> {
    let value = token.text.parse().ok().filter(|value: &f32| value.is_finite());
    value.ok_or_else(|| {
        let help = "the maximum is 3.4e38";
        ErrMode::Cut(Problem::new(token.span.clone(), "number too large", help))
    })
}

fn axis(input: &mut Input<'_>) -> Parsed<Option<Axis>> {
    let Some(open) = opt(sign("[")).parse_next(input)? else { return Ok(None) };
    let help = "write the axis number, such as `position[0]`";
    let number = must(of_kind(Kind::Number), "an axis number", help).parse_next(input)?;
    let close = must(sign("]"), "`]`", help).parse_next(input)?;
    let axis = number.text.parse().ok().filter(|axis| usize::from(*axis) < dimsart_core::limits::MAX_DOF);
    let number = axis.ok_or_else(|| {
        let most = dimsart_core::limits::MAX_DOF - 1;
        ErrMode::Cut(Problem::new(
            number.span.clone(),
            format!("axis {} is out of range", number.text),
            format!("axes are 0 to {most}"),
        ))
    })?;
    Ok(Some(Axis { number, span: open.span.start..close.span.end }))
}

/// A required expression.
fn value(input: &mut Input<'_>) -> Parsed<Expression> {
    let help = "write a number, a name, a function call, or an expression in parentheses";
    must(whole, "a value", help).parse_next(input)
}

fn binary(operator: Binary, left: Expression, right: Expression) -> Parsed<Expression> {
    let span = left.span.start..right.span.end;
    Ok(Expression { what: What::Binary { operator, sides: Box::new([left, right]) }, span })
}

macro_rules! infix {
    ($side:ident $power:literal $operator:ident) => {
        Infix::$side($power, |_: &mut Input<'_>, left, right| binary(Binary::$operator, left, right))
    };
}

fn whole(input: &mut Input<'_>) -> Parsed<Expression> {
    let operator = any.verify_map(|token: &Token<'_>| {
        Some(match token.text {
            "or" => infix!(Left 2 Or),
            "and" => infix!(Left 4 And),
            "<" => infix!(Neither 8 Less),
            "<=" => infix!(Neither 8 LessOrEqual),
            ">" => infix!(Neither 8 Greater),
            ">=" => infix!(Neither 8 GreaterOrEqual),
            "==" => infix!(Neither 8 Equal),
            "!=" => infix!(Neither 8 NotEqual),
            "+" => infix!(Left 10 Add),
            "-" => infix!(Left 10 Subtract),
            "*" => infix!(Left 12 Multiply),
            "/" => infix!(Left 12 Divide),
            _ => return None,
        })
    });
    let prefix = any.verify_map(|token: &Token<'_>| match token.text {
        "-" => Some(Prefix(14, |_: &mut Input<'_>, value: Expression| {
            let span = value.span.clone();
            Ok(Expression { what: What::Negate(Box::new(value)), span })
        })),
        "not" => Some(Prefix(6, |_: &mut Input<'_>, value: Expression| {
            let span = value.span.clone();
            Ok(Expression { what: What::Not(Box::new(value)), span })
        })),
        _ => None,
    });
    expression(operand).prefix(prefix).infix(operator).parse_next(input)
}

fn operand(input: &mut Input<'_>) -> Parsed<Expression> {
    alt((literal, parentheses, choice, last, named)).parse_next(input)
}

fn literal(input: &mut Input<'_>) -> Parsed<Expression> {
    let token = of_kind(Kind::Number).parse_next(input)?;
    Ok(Expression { what: What::Number(read(&token)?), span: token.span })
}

fn parentheses(input: &mut Input<'_>) -> Parsed<Expression> {
    let open = sign("(").parse_next(input)?;
    let inner = value(input)?;
    let close = close(input)?;
    Ok(Expression { span: open.span.start..close.span.end, ..inner })
}

fn close<'t>(input: &mut Input<'t>) -> Parsed<Token<'t>> {
    must(sign(")"), "`)`", "close the parentheses").parse_next(input)
}

fn choice(input: &mut Input<'_>) -> Parsed<Expression> {
    let start = keyword("if").parse_next(input)?.span.start;
    let help = "write `if condition then value else value`";
    let condition = value(input)?;
    must(keyword("then"), "`then`", help).parse_next(input)?;
    let yes = value(input)?;
    must(keyword("else"), "`else`", help).parse_next(input)?;
    let no = value(input)?;
    let span = start..no.span.end;
    Ok(Expression { what: What::If { parts: Box::new([condition, yes, no]) }, span })
}

fn last(input: &mut Input<'_>) -> Parsed<Expression> {
    let start = keyword("last").parse_next(input)?.span.start;
    let help = "write `last(force)` with the name of an output";
    must(sign("("), "`(`", help).parse_next(input)?;
    let output = must(name, "the name of an output", help).parse_next(input)?;
    let axis = axis(input)?;
    let end = close(input)?.span.end;
    Ok(Expression { what: What::Last { output, axis }, span: start..end })
}

fn named(input: &mut Input<'_>) -> Parsed<Expression> {
    let word = word
        .verify(|word: &Word| {
            ["pi", "period"].contains(&word.text.as_str()) || !KEYWORDS.contains(&word.text.as_str())
        })
        .parse_next(input)?;
    let start = word.span.start;
    if opt(sign("(")).parse_next(input)?.is_some() {
        let arguments = separated(0.., value, sign(",")).parse_next(input)?;
        let end = close(input)?.span.end;
        return Ok(Expression { what: What::Call { function: word, arguments }, span: start..end });
    }
    let axis = axis(input)?;
    let end = axis.as_ref().map_or(word.span.end, |axis| axis.span.end);
    Ok(Expression { what: What::Name { name: word, axis }, span: start..end })
}
