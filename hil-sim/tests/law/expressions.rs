//! Any expression, against an evaluator of its own: the same bits.

use dimsart_core::math;
use hil_sim::law::Law;
use proptest::prelude::*;

use super::{controller, run, tick};

/// An expression of numbers, or one that is true or false.
#[derive(Debug, Clone)]
enum Number {
    Constant(f32),
    Input(usize),
    Parameter(usize),
    State,
    Period,
    Unary(&'static str, Box<Number>),
    Binary(&'static str, Box<[Number; 2]>),
    Call(&'static str, Vec<Number>),
    If(Box<Truth>, Box<[Number; 2]>),
}

#[derive(Debug, Clone)]
enum Truth {
    Compare(&'static str, Box<[Number; 2]>),
    Join(&'static str, Box<[Truth; 2]>),
    Not(Box<Truth>),
}

/// What there is on an axis.
struct Axis {
    inputs: [f32; 3],
    parameters: [f32; 2],
    state: f32,
}

impl Number {
    fn text(&self) -> String {
        match self {
            Self::Constant(value) if *value < 0.0 => format!("(-{:?})", -value),
            Self::Constant(value) => format!("{value:?}"),
            Self::Input(number) => ["x", "v", "d"][*number].to_owned(),
            Self::Parameter(number) => ["k", "b"][*number].to_owned(),
            Self::State => "s".to_owned(),
            Self::Period => "period".to_owned(),
            Self::Unary(sign, value) => format!("({sign}{})", value.text()),
            Self::Binary(sign, sides) => format!("({} {sign} {})", sides[0].text(), sides[1].text()),
            Self::Call(name, arguments) => {
                let arguments: Vec<String> = arguments.iter().map(Self::text).collect();
                format!("{name}({})", arguments.join(", "))
            }
            Self::If(condition, sides) => {
                format!("(if {} then {} else {})", condition.text(), sides[0].text(), sides[1].text())
            }
        }
    }

    fn value(&self, on: &Axis) -> f32 {
        match self {
            Self::Constant(value) => *value,
            Self::Input(number) => on.inputs[*number],
            Self::Parameter(number) => on.parameters[*number],
            Self::State => on.state,
            Self::Period => 1e-3,
            Self::Unary(_, value) => -value.value(on),
            Self::Binary(sign, sides) => {
                let [a, b] = [sides[0].value(on), sides[1].value(on)];
                match *sign {
                    "+" => a + b,
                    "-" => a - b,
                    "*" => a * b,
                    _ => a / b,
                }
            }
            Self::Call(name, arguments) => {
                let of: Vec<f32> = arguments.iter().map(|argument| argument.value(on)).collect();
                match (*name, &of[..]) {
                    ("abs", [a]) => a.abs(),
                    ("sqrt", [a]) => math::sqrt(*a),
                    ("sin", [a]) => math::sin(*a),
                    ("cos", [a]) => math::cos(*a),
                    ("atan2", [a, b]) => math::atan2(*a, *b),
                    ("min", [a, b]) => {
                        if a < b {
                            *a
                        } else {
                            *b
                        }
                    }
                    ("max", [a, b]) => {
                        if a > b {
                            *a
                        } else {
                            *b
                        }
                    }
                    ("clamp", [a, low, high]) => {
                        let a = if a < low { low } else { a };
                        if a > high { *high } else { *a }
                    }
                    other => panic!("{other:?}"),
                }
            }
            Self::If(condition, sides) => sides[usize::from(!condition.holds(on))].value(on),
        }
    }
}

impl Truth {
    fn text(&self) -> String {
        match self {
            Self::Compare(sign, sides) => format!("({} {sign} {})", sides[0].text(), sides[1].text()),
            Self::Join(sign, sides) => format!("({} {sign} {})", sides[0].text(), sides[1].text()),
            Self::Not(inner) => format!("(not {})", inner.text()),
        }
    }

    #[expect(clippy::float_cmp, reason = "what the law does")]
    fn holds(&self, on: &Axis) -> bool {
        match self {
            Self::Compare(sign, sides) => {
                let [a, b] = [sides[0].value(on), sides[1].value(on)];
                match *sign {
                    "<" => a < b,
                    "<=" => a <= b,
                    ">" => a > b,
                    ">=" => a >= b,
                    "==" => a == b,
                    _ => a != b,
                }
            }
            Self::Join("and", sides) => sides[0].holds(on) && sides[1].holds(on),
            Self::Join(_, sides) => sides[0].holds(on) || sides[1].holds(on),
            Self::Not(inner) => !inner.holds(on),
        }
    }
}

fn any_number() -> impl Strategy<Value = Number> {
    let leaf = prop_oneof![
        (-100.0_f32..100.0).prop_map(Number::Constant),
        (0_usize..3).prop_map(Number::Input),
        (0_usize..2).prop_map(Number::Parameter),
        Just(Number::State),
        Just(Number::Period),
    ];
    leaf.prop_recursive(4, 24, 3, |inner| {
        let pair = (inner.clone(), inner.clone()).prop_map(|(a, b)| Box::new([a, b]));
        let sign = prop_oneof![Just("<"), Just("<="), Just(">"), Just(">="), Just("=="), Just("!=")];
        let compare = (sign, pair.clone()).prop_map(|(sign, sides)| Truth::Compare(sign, sides));
        let truth = compare.prop_recursive(2, 4, 2, |inner| {
            let both = (inner.clone(), inner.clone()).prop_map(|(a, b)| Box::new([a, b]));
            prop_oneof![
                (prop_oneof![Just("and"), Just("or")], both)
                    .prop_map(|(sign, sides)| Truth::Join(sign, sides)),
                inner.prop_map(|inner| Truth::Not(Box::new(inner))),
            ]
        });
        let one = prop_oneof![Just("abs"), Just("sqrt"), Just("sin"), Just("cos")];
        let two = prop_oneof![Just("atan2"), Just("min"), Just("max")];
        prop_oneof![
            inner.clone().prop_map(|value| Number::Unary("-", Box::new(value))),
            (prop_oneof![Just("+"), Just("-"), Just("*"), Just("/")], pair.clone())
                .prop_map(|(sign, sides)| Number::Binary(sign, sides)),
            (one, inner.clone()).prop_map(|(name, of)| Number::Call(name, vec![of])),
            (two, pair.clone()).prop_map(|(name, of)| Number::Call(name, of.to_vec())),
            (inner.clone(), inner.clone(), inner.clone())
                .prop_map(|(a, b, c)| Number::Call("clamp", vec![a, b, c])),
            (truth, pair).prop_map(|(condition, sides)| Number::If(Box::new(condition), sides)),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_compiled_law_has_the_bits_of_its_expressions(
        force in any_number(),
        next in any_number(),
        first in -10.0_f32..10.0,
        gains in prop::array::uniform4(-50.0_f32..50.0),
        measured in prop::collection::vec(-3.0_f32..3.0, 18),
    ) {
        let text = format!(
            "law ANY\nin x: POSITION\nin v: VELOCITY\nin d: DES_POSITION\nout f: DES_FORCE\nparam k = 1\nparam b = 2\n\
             state s = {first:?}\nf = {}\ns = {}\n",
            force.text(),
            next.text(),
        );
        // What does not fit says so, and is none of this test's.
        let Ok(law) = Law::compile(&text, "any.law") else { return Ok(()) };
        let mut dimsart = controller(2);
        let [k0, k1, b0, b1] = gains;
        let gains = [(1, Some(0), k0), (1, Some(1), k1), (2, Some(0), b0), (2, Some(1), b1)];
        run(&mut dimsart, &law, &gains);
        let mut states = [first; 2];
        for measured in measured.chunks(6) {
            let expected: Vec<f32> = (0..2).map(|axis| {
                let inputs = [0, 2, 4].map(|from| measured[from + axis]);
                let on = Axis { inputs, parameters: [[k0, k1][axis], [b0, b1][axis]], state: states[axis] };
                let value = force.value(&on);
                // The state sees nothing of the force.
                states[axis] = next.value(&on);
                value
            }).collect();
            // What cannot be a force cuts the module out, in this tick: the engine's part.
            if expected.iter().any(|force| force.is_nan() || force.abs() > 1e9) {
                return Ok(());
            }
            let found = super::tick(&mut dimsart, measured);
            let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&found), bits(&expected), "{}: {:?} {:?}", text, found, expected);
        }
    }
}

#[test]
fn an_axis_by_number_is_that_of_the_device() {
    let text = "law FOLLOW\nin x: POSITION\nout f: DES_FORCE\nparam k = 2\nf = k[1] * x[1] - x";
    let law = Law::compile(text, "follow.law").unwrap();
    let mut dimsart = controller(3);
    run(&mut dimsart, &law, &[(1, Some(1), 4.0)]);
    let found = tick(&mut dimsart, &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(found, [7.0, 6.0, 5.0]);
}
