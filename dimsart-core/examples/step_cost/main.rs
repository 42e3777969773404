//! Runs schemes for `cargo xtask bench`, which counts instructions of the `counted_*` functions.
//!
//! `table1 TICKS` · `table1-silent TICKS` · `empty MODULES TICKS` · `p ACTIVE INACTIVE DOF TYPES DATA_BASE TICKS`
#![expect(clippy::expect_used, reason = "a benchmark: errors end it")]

mod engine_cost;
mod table1;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let number = |word: &str| word.parse::<u32>().expect("a whole number");
    let small = |word: &str| word.parse::<u8>().expect("a number up to 255");
    match words.as_slice() {
        ["table1", ticks] => table1::run(number(ticks), true),
        ["table1-silent", ticks] => table1::run(number(ticks), false),
        ["empty", modules, ticks] => engine_cost::run_empty(small(modules), number(ticks)),
        ["p", active, inactive, dof, types, data_base, ticks] => {
            let scheme = engine_cost::Scheme {
                active: small(active),
                inactive: small(inactive),
                dof: usize::from(small(dof)),
                has_many_types: *types == "many",
                has_large_data_base: *data_base == "large",
            };
            engine_cost::run_scheme(scheme, number(ticks));
        }
        _ => {
            eprintln!("usage: see the head of examples/step_cost/main.rs");
            std::process::exit(2);
        }
    }
}
