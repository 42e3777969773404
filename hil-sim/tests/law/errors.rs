//! What is wrong with a law is pointed to, with what to do.

use hil_sim::law::Law;

const HEAD: &str = "law L\nin x: POSITION\nout f: DES_FORCE\nparam k = 1\n";

/// A text behind [`HEAD`], or alone; where the mark stands; and of what is said, something of both parts.
type Wrong = (&'static str, bool, (usize, usize), &'static str, &'static str);

const WRONG: &[Wrong] = &[
    ("in x: POSITION", false, (1, 1), "no name", "begin the text with `law"),
    ("law", false, (1, 4), "a name stands here", "give it a word"),
    ("law L\nlaw M", false, (2, 5), "second law", "one law in a file"),
    ("law L\nin x POSITION", false, (2, 6), "`POSITION` is not expected here: `:`", "in position: POSITION"),
    ("law L\nin x: POSITIN", false, (2, 7), "no data type POSITIN", "did you mean `POSITION`?"),
    ("law L\nin x: LINK_AGE", false, (2, 7), "not one real number", "such signals only"),
    ("law L\nin x: POSITION\nin y: POSITION", false, (3, 7), "`x` has this signal already", "POSITION.2"),
    ("law L\nin x: POSITION", false, (2, 15), "no output", "out force: DES_FORCE"),
    ("law L\nout out: FORCE", false, (2, 5), "`out` is not expected", "not one of the language"),
    ("law L \"text\nf = 1", false, (1, 7), "does not end", "quotation mark"),
    ("param b: Stifness = 1\nf = b", true, (5, 10), "no unit Stifness", "did you mean `Stiffness`?"),
    ("param b = 3 in 4..9\nf = b", true, (5, 11), "outside 4 to 9", "change the range"),
    ("param b = 3 in 9..4\nf = b", true, (5, 19), "wrong way round", "smaller end first"),
    ("param b = 3 in 9\nf = b", true, (5, 17), "`..` stands here", "in 0..1000"),
    ("param b = 1e39\nf = b", true, (5, 11), "too large", "3.4e38"),
    ("param k = 2", true, (5, 7), "already", "another name"),
    ("f = k * y", true, (5, 9), "`y` is not known", "declare it"),
    ("f = stifness\nlet stiffness = 1", true, (5, 5), "not known", "declare it"),
    ("let gain = 1\nf = gian * x", true, (6, 5), "not known", "did you mean `gain`?"),
    ("f = k * ", true, (5, 9), "the end of the line is not expected here: a value", "write a number"),
    ("f = (k + x", true, (5, 11), "`)` stands here", "close the parentheses"),
    ("f = k x", true, (5, 7), "has an end here", "a line of its own"),
    ("f = k $ x", true, (5, 7), "`$` means nothing", "a law has words"),
    ("f = if x then 1 else 0", true, (5, 8), "a number, not true or false", "compare it"),
    ("f = x > 0", true, (5, 5), "true or false, and no number", "if ... then 1 else 0"),
    ("f = if x > 0 then 1", true, (5, 20), "`else` stands here", "if condition then value else value"),
    ("f = if x > 0 then 1 else x < 0", true, (5, 26), "not of the kind", "both sides"),
    ("f = tan(x)", true, (5, 5), "no function `tan`", "sqrt, sin, cos"),
    ("f = clamp(x, 1)", true, (5, 5), "takes 3 value(s), and here are 2", "clamp(value, smallest, largest)"),
    ("f = last(f)", true, (5, 5), "known when the law begins", "where a state begins"),
    ("state s = last(x)\nf = s", true, (5, 16), "no output", "last(force)"),
    ("state s = 0\nstate t = s\nf = t", true, (6, 11), "has not begun", "inputs, parameters and numbers"),
    ("f = f", true, (5, 5), "not written before", "keep it in a `state`"),
    ("f = 1\nf = 2", true, (6, 1), "a second time", "with `let`"),
    ("x = 1", true, (5, 1), "`x` is not written by the law", "use `let`"),
    ("g = 1", true, (5, 1), "`g` is not known", "let g = ..."),
    ("let a = 1", true, (5, 10), "nothing is written to `f`", "add a line `f = ...`"),
    ("f[1] = 1", true, (5, 9), "nothing is written to `f[0]`", "add a line `f[0] = ...`"),
    ("f[0] = x", true, (5, 8), "which axis of `x`?", "write `x[0]`"),
    ("f[0] = x[1]", true, (5, 9), "has no axis 1", "axes 0 to 0"),
    ("f[9] = 1", true, (5, 3), "no device has an axis 9", "axes are 0 to 7"),
    ("f[a] = 1", true, (5, 3), "number of an axis", "position[0]"),
    ("f = pi[0]", true, (5, 7), "has no axes", "its name alone"),
    ("then = 1", true, (5, 1), "no statement begins with `then`", "begin with `law`"),
];

#[test]
fn each_error_points_to_its_place_and_says_what_to_do() {
    for (text, has_head, place, message, help) in WRONG {
        let text = if *has_head { format!("{HEAD}{text}") } else { (*text).to_owned() };
        let error = Law::compile(&text, "wrong.law").err().unwrap_or_else(|| panic!("{text} is right"));
        let said = error.to_string();
        assert_eq!((error.line, error.column), *place, "{said}");
        assert!(error.message.contains(message), "{said}");
        assert!(error.help.contains(help), "{said}");
        let line = text.lines().nth(place.0 - 1).unwrap();
        assert!(
            said.contains(&format!("wrong.law:{}:{}", place.0, place.1)) && said.contains(line.trim()),
            "{said}"
        );
    }
}

#[test]
fn more_than_fits_is_refused_with_what_fits() {
    let many: String = (0..50).map(|n| format!("let a{n} = sin(x * {n}.5)\n")).collect();
    let sum = (0..50).rev().fold("f = 0".to_owned(), |sum, n| sum + &format!(" + a{n} * x"));
    let product = (0..50).fold("let p = 1".to_owned(), |product, n| product + &format!(" * a{n}"));
    let error = Law::compile(&format!("{HEAD}{many}{product}\n{sum} + p"), "l").unwrap_err();
    assert!(error.message.contains("more than 32 values"), "{error}");
    let long: String = (1..120).map(|n| format!("let a{n} = a{} * x + 1\n", n - 1)).collect();
    let error = Law::compile(&format!("{HEAD}let a0 = x\n{long}f = a119"), "l").unwrap_err();
    assert!(error.message.contains("and 120 fit"), "{error}");
    let ports: String = (2..9).map(|n| format!("in y{n}: POSITION.{n}\n")).collect();
    let error = Law::compile(&format!("{HEAD}{ports}f = x"), "l").unwrap_err();
    assert!(error.message.contains("more than 6 inputs"), "{error}");
    for deep in ["(".repeat(100_000), "-".repeat(100_000), "if ".repeat(100_000)] {
        let error = Law::compile(&format!("{HEAD}f = {deep}"), "l").unwrap_err();
        assert!(error.message.contains("too long"), "{}", error.message);
    }
}

#[test]
fn the_whole_of_an_error_is_a_line_with_a_mark_under_it() {
    let error = Law::compile(&format!("{HEAD}f = k * (x - y)"), "spring.law").unwrap_err();
    let expected = "error: `y` is not known
 --> spring.law:5:14
  |
5 | f = k * (x - y)
  |              ^
  |
  = help: declare it with `in`, `param`, `state` or `let` first";
    assert_eq!(error.to_string(), expected);
}
