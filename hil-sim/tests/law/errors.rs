//! Each error of a law points to its place and suggests a remedy.

use hil_sim::law::Law;

const HEAD: &str = "law L\nin x: POSITION\nout f: DES_FORCE\nparam k = 1\n";

/// A text after [`HEAD`] or alone, the place of the mark, and a part of the message and of the help.
type Wrong = (&'static str, bool, (usize, usize), &'static str, &'static str);

const WRONG: &[Wrong] = &[
    ("in x: POSITION", false, (1, 1), "missing law name", "start the text with `law"),
    ("law", false, (1, 4), "expected a name, found the end of the line", "choose a word"),
    ("law L\nlaw M", false, (2, 5), "second law", "one law per file"),
    ("law L\nin x POSITION", false, (2, 6), "expected `:`, found `POSITION`", "in position: POSITION"),
    ("law L\nin x: POSITIN", false, (2, 7), "unknown data type POSITIN", "did you mean `POSITION`?"),
    ("law L\nin x: LINK_AGE", false, (2, 7), "not a vector with one real number", "vectors of real numbers"),
    ("law L\nin x: POSITION\nin y: POSITION", false, (3, 7), "signal already bound to `x`", "POSITION.2"),
    ("law L\nin x: POSITION", false, (2, 15), "missing output", "out force: DES_FORCE"),
    ("law L\nout out: FORCE", false, (2, 5), "found `out`", "not a keyword"),
    ("law L \"text\nf = 1", false, (1, 7), "missing closing", "quotation mark"),
    ("param b: Stifness = 1\nf = b", true, (5, 10), "unknown unit Stifness", "did you mean `Stiffness`?"),
    ("param b = 3 in 4..9\nf = b", true, (5, 11), "outside the range 4 to 9", "change the range"),
    ("param b = 3 in 9..4\nf = b", true, (5, 19), "minimum is above the maximum", "minimum first"),
    ("param b = 3 in 9\nf = b", true, (5, 17), "expected `..`, found the end of the line", "in 0..1000"),
    ("param b = 1e39\nf = b", true, (5, 11), "too large", "3.4e38"),
    ("param k = 2", true, (5, 7), "duplicate name `k`", "another name"),
    ("f = k * y", true, (5, 9), "unknown name `y`", "declare the name"),
    ("f = stifness\nlet stiffness = 1", true, (5, 5), "unknown name", "declare the name"),
    ("let gain = 1\nf = gian * x", true, (6, 5), "unknown name", "did you mean `gain`?"),
    ("f = k * ", true, (5, 9), "expected a value, found the end of the line", "write a number"),
    ("f = (k + x", true, (5, 11), "expected `)`, found the end of the line", "close the parentheses"),
    ("f = k x", true, (5, 7), "expected the end of the statement, found `x`", "a new line"),
    ("f = k $ x", true, (5, 7), "invalid character `$`", "a law consists of words"),
    ("f = if x then 1 else 0", true, (5, 8), "expected a condition, found a number", "comparison"),
    ("f = x > 0", true, (5, 5), "expected a number, found a condition", "if ... then 1 else 0"),
    ("f = if x > 0 then 1", true, (5, 20), "expected `else`, found", "if condition then value else value"),
    ("f = if x > 0 then 1 else x < 0", true, (5, 26), "differ in type", "both branches"),
    ("f = tan(x)", true, (5, 5), "unknown function `tan`", "sqrt, sin, cos"),
    ("f = clamp(x, 1)", true, (5, 5), "expects 3 argument(s), found 2", "clamp(value, min, max)"),
    ("f = last(f)", true, (5, 5), "available only when the law starts", "initial value"),
    ("state s = last(x)\nf = s", true, (5, 16), "`x` is not an output", "last(force)"),
    (
        "state s = 0\nstate t = s\nf = t",
        true,
        (6, 11),
        "not initialised yet",
        "inputs, parameters and numbers",
    ),
    ("f = f", true, (5, 5), "read before it is assigned", "use a `state`"),
    ("f = 1\nf = 2", true, (6, 1), "assigned twice", "use `let`"),
    ("x = 1", true, (5, 1), "cannot assign to `x`", "use `let`"),
    ("g = 1", true, (5, 1), "unknown name `g`", "let g = ..."),
    ("let a = 1", true, (5, 10), "`f` is not assigned", "add a line `f = ...`"),
    ("f[1] = 1", true, (5, 9), "`f[0]` is not assigned", "add a line `f[0] = ...`"),
    ("f[0] = x", true, (5, 8), "missing axis index of `x`", "write `x[0]`"),
    ("f[0] = x[1]", true, (5, 9), "axis 1 is out of range", "axes 0 to 0"),
    ("f[9] = 1", true, (5, 3), "axis 9 is out of range", "axes are 0 to 7"),
    ("f[a] = 1", true, (5, 3), "expected an axis number, found `a`", "position[0]"),
    ("f = pi[0]", true, (5, 7), "has no axis index", "without an index"),
    ("then = 1", true, (5, 1), "cannot start with `then`", "start with `law`"),
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
    assert!(error.message.contains("more than 32 values in use"), "{error}");
    let long: String = (1..120).map(|n| format!("let a{n} = a{} * x + 1\n", n - 1)).collect();
    let error = Law::compile(&format!("{HEAD}let a0 = x\n{long}f = a119"), "l").unwrap_err();
    assert!(error.message.contains("maximum 120"), "{error}");
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
    let expected = "error: unknown name `y`
 --> spring.law:5:14
  |
5 | f = k * (x - y)
  |              ^
  |
  = help: declare the name first with `in`, `param`, `state` or `let`";
    assert_eq!(error.to_string(), expected);
}
