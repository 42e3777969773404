//! `cargo xtask panic-free`: nothing that a tick can reach in the machine code may panic.
//!
//! The release build of a program that runs ticks is disassembled; from `Dimsart::tick` and
//! `Engine::step` on, every function that a reachable one mentions is reachable too. All of them must
//! be the core's own, its mathematics' or plain memory moves: a panic, a formatter or an allocator is a
//! fault, and so is a call whose target cannot be seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::setup::install;
use crate::shell::{Outcome, cargo, command, succeeds, top};

/// Where a tick begins, in the example `step_cost`.
const ROOTS: [&str; 2] = ["::counted_table1", "::counted_step"];
/// What a tick may be made of.
const ALLOWED: [&str; 3] = ["dimsart_core::", "micromath::", "step_cost::"];
const MEMORY_MOVES: [&str; 4] = ["memcpy", "memset", "memmove", "memcmp"];

/// Names of functions and what they mention, by address.
type Functions<'a> = BTreeMap<u64, (&'a str, Vec<&'a str>)>;

/// Builds, disassembles and follows every path of a tick.
pub(crate) fn run() -> Outcome {
    if std::env::consts::ARCH != "x86_64" {
        return Err("the check reads x86-64 machine code: run this on such a machine".into());
    }
    if !succeeds(&mut command("objdump", ["--version"])) {
        install(&["binutils"], "reading machine code")?;
    }
    // Without position independence a call names its target instead of a table entry.
    let folder = top().join("target/panic-free");
    let build = ["build", "--release", "--package", "dimsart-core", "--example", "step_cost"];
    let flags = "-C relocation-model=static";
    crate::shell::run(cargo(&build).env("RUSTFLAGS", flags).env("CARGO_TARGET_DIR", &folder))?;
    let listing = disassemble(folder.join("release/examples/step_cost"))?;
    let reached = reach(&functions(&listing))?;
    println!("a tick reaches {reached} functions, none of which can panic");
    Ok(())
}

fn disassemble(program: PathBuf) -> Result<String, String> {
    let flags = ["--disassemble", "--demangle", "--no-show-raw-insn", "--disassembler-options=intel"];
    let output = command("objdump", flags).arg(&program).output();
    let output = output.map_err(|error| format!("objdump could not be started: {error}"))?;
    String::from_utf8(output.stdout).map_err(|error| format!("objdump of {}: {error}", program.display()))
}

/// Splits a listing into functions and their instructions, operands only.
fn functions(listing: &str) -> Functions<'_> {
    let mut functions = Functions::new();
    let mut current = None;
    for line in listing.lines() {
        if let Some((address, name)) = line.strip_suffix(">:").and_then(|line| line.split_once(" <")) {
            current = u64::from_str_radix(address, 16).ok();
            current.map(|address| functions.insert(address, (name, Vec::new())));
        } else if let (Some(address), Some((_, instruction))) = (current, line.split_once(":\t"))
            && let Some((_, instructions)) = functions.get_mut(&address)
        {
            instructions.push(instruction);
        }
    }
    functions
}

/// Follows all that the roots mention; gives how many functions that are.
fn reach(functions: &Functions<'_>) -> Result<usize, String> {
    let is_root = |name: &str| ROOTS.iter().any(|root| name.ends_with(root));
    let roots =
        functions.iter().filter(|(_, (name, _))| is_root(name)).map(|(address, _)| (*address, "a tick"));
    let mut waiting: Vec<(u64, &str)> = roots.collect();
    if waiting.is_empty() {
        return Err("the program holds no tick to start from".into());
    }
    let mut reached = BTreeSet::new();
    let mut faults = BTreeSet::new();
    while let Some((address, from)) = waiting.pop() {
        let Some((name, instructions)) = functions.get(&address) else { continue };
        if !reached.insert(address) {
            continue;
        }
        if !is_allowed(name) {
            faults.insert(format!("{from}\n    reaches {name}"));
            continue;
        }
        for instruction in instructions {
            if is_blind(instruction) {
                faults.insert(format!("{name}\n    calls what cannot be seen: {instruction}"));
            }
            let mentioned = numbers(instruction).filter(|number| functions.contains_key(number));
            waiting.extend(mentioned.map(|number| (number, *name)));
        }
    }
    if faults.is_empty() {
        return Ok(reached.len());
    }
    let faults: Vec<String> = faults.into_iter().collect();
    Err(format!("a tick reaches what it must not:\n{}", faults.join("\n")))
}

fn is_allowed(name: &str) -> bool {
    ALLOWED.iter().any(|part| name.contains(part)) || MEMORY_MOVES.iter().any(|part| name.starts_with(part))
}

/// Whether an instruction leads out of sight: a call through memory, or an entry of a linker's table. A
/// jump through a table stays inside its function, and what is called through a register was named
/// where the register was loaded.
fn is_blind(instruction: &str) -> bool {
    let is_memory_move = MEMORY_MOVES.iter().any(|name| instruction.contains(&format!("<{name}")));
    let through_memory = instruction.starts_with("call") && instruction.contains('[');
    let by_table = ["<_DYNAMIC", "<_GLOBAL_OFFSET_TABLE_", "@"].iter().any(|mark| instruction.contains(mark));
    (through_memory || by_table) && !is_memory_move
}

/// Every number of an instruction that could be an address.
fn numbers(instruction: &str) -> impl Iterator<Item = u64> {
    let words = instruction.split(|letter: char| !letter.is_ascii_alphanumeric());
    words.filter_map(|word| u64::from_str_radix(word.trim_start_matches("0x"), 16).ok())
}

#[cfg(test)]
mod tests {
    use super::{functions, reach};

    const CLEAN: &str = "\
0000000000001000 <step_cost::counted_step>:
    1000:\tpush   rax
    1001:\tcall   2000 <dimsart_core::engine::step>
    1002:\tret

0000000000002000 <dimsart_core::engine::step>:
    2000:\tmov    r15,QWORD PTR [rip+0x9]        # 9000 <memcpy@GLIBC_2.14>
    2001:\tcall   r15
    2002:\tjmp    QWORD PTR [rax*8+0x7000]

0000000000003000 <core::panicking::panic_fmt>:
    3000:\tud2
";

    #[test]
    fn what_a_tick_does_not_reach_may_panic() {
        assert_eq!(reach(&functions(CLEAN)), Ok(2));
    }

    #[test]
    fn a_panic_a_tick_can_reach_is_named_with_its_caller() {
        let fault =
            reach(&functions(&CLEAN.replace("call   r15", "call   3000 <core::panicking>"))).unwrap_err();
        assert!(
            fault.contains("dimsart_core::engine::step\n    reaches core::panicking::panic_fmt"),
            "{fault}"
        );
    }

    #[test]
    fn a_call_through_a_table_is_refused() {
        let fault = reach(&functions(&CLEAN.replace("call   r15", "call   QWORD PTR [rax+0x18]")));
        assert!(fault.unwrap_err().contains("cannot be seen"));
    }

    #[test]
    fn a_program_without_a_tick_is_refused() {
        assert!(reach(&functions("")).is_err());
    }
}
