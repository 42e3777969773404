//! Pin configuration of an image compared with the plan in the catalogue.

use std::collections::BTreeMap;
use std::fs;

use boards::BOARDS;
use boards::catalogue::{BoardInfo, PinMode, PinPlan};
use chips::{Bench, Board};

use crate::common::image;

/// Modes in MODER.
const OUTPUT: u32 = 1;
const ALTERNATE: u32 = 2;

/// Longer than the pin configuration of a board.
const START_S: f64 = 0.05;

/// Mode and alternate function of every pin that differs from its reset state (RM0440, 9.4.1), or did.
fn set_pins(writes: &[String]) -> BTreeMap<String, (u32, u32)> {
    let mut registers = BTreeMap::<String, u32>::new();
    for line in writes {
        let (register, value) = line.split_once(' ').unwrap_or((line, "0x0"));
        let value = u32::from_str_radix(value.trim().trim_start_matches("0x"), 16).unwrap();
        registers.insert(register.to_owned(), value);
    }
    let mut pins = BTreeMap::new();
    for (port, reset) in
        [('A', 0xABFF_FFFF), ('B', 0xFFFF_FEBF), ('C', u32::MAX), ('D', u32::MAX), ('F', u32::MAX)]
    {
        let value = |name: &str, otherwise: u32| {
            registers.get(&format!("GPIO{port}_{name}")).copied().unwrap_or(otherwise)
        };
        let modes = value("MODER", reset);
        for pin in 0..16 {
            let [mode, before] = [modes, reset].map(|modes: u32| modes >> (2 * pin) & 3);
            let functions = value(if pin < 8 { "AFRL" } else { "AFRH" }, 0);
            let function = if mode == ALTERNATE { functions >> (pin % 8 * 4) & 15 } else { 0 };
            if mode != before || function != 0 {
                pins.insert(format!("P{port}{pin}"), (mode, function));
            }
        }
    }
    pins
}

/// Differences between an image and a plan.
fn differences(plan: &PinPlan, writes: &[String]) -> Vec<String> {
    let mut set = set_pins(writes);
    let mut wrong = Vec::new();
    for pin in plan.groups.iter().flat_map(|group| group.pins) {
        let found = set.remove(pin.name);
        let wanted = match pin.mode {
            PinMode::Alternate(0) | PinMode::Analog => None,
            PinMode::Alternate(function) => Some((ALTERNATE, function.into())),
            PinMode::Output => Some((OUTPUT, 0)),
        };
        if found != wanted && !(pin.depends_on_configuration && found.is_none()) {
            wrong.push(format!("{} is {found:?}, but {:?} in the plan", pin.name, pin.mode));
        }
    }
    wrong.extend(set.iter().map(|(pin, found)| format!("{pin} is {found:?}, but missing in the plan")));
    wrong
}

fn plan<'a>(board: &'a BoardInfo, variant: &str) -> &'a PinPlan {
    let mut plans = board.tooling.pins.iter().filter(|plan| plan.variants.contains(&variant));
    let plan = plans.next().unwrap_or_else(|| panic!("{}: no pin plan for '{variant}'", board.name));
    assert!(plans.next().is_none(), "{}: two pin plans for '{variant}'", board.name);
    plan
}

/// Review of a plain image; see `register_writes.rs`.
fn reviewed(name: &str) -> Vec<String> {
    fs::read_to_string(format!("../boards/boot/{name}.txt")).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn every_pin_that_an_image_sets_is_in_its_plan_with_that_function() {
    for board in BOARDS.iter().filter(|board| board.tooling.chip.is_some()) {
        assert_eq!(differences(plan(board, ""), &reviewed(board.name)), [] as [&str; 0], "{}", board.name);
        for variant in board.tooling.variants {
            let plan = plan(board, variant);
            let name = format!("{}-{}", board.name, variant.replace(',', "-"));
            let Some(image) = image(&name) else { return };
            let mut bench = Bench::new(Board::find(board.name).unwrap(), image).unwrap();
            bench.run_for(START_S).unwrap();
            assert_eq!(differences(plan, bench.chip().journal.lines()), [] as [&str; 0], "{name}");
        }
    }
}

#[test]
fn no_pin_has_two_purposes() {
    for plan in BOARDS.iter().flat_map(|board| board.tooling.pins) {
        let mut names: Vec<_> = plan.groups.iter().flat_map(|group| group.pins).map(|pin| pin.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{:?}", plan.variants);
    }
}

#[test]
fn a_pin_that_the_plan_lacks_and_one_with_another_function_are_told() {
    let board = BOARDS.iter().find(|board| board.name == "nucleo-g474re").unwrap();
    let mut writes = reviewed(board.name);
    // PA15 becomes an output, and PA8 gets function 5.
    writes.push("GPIOA_MODER      0x6aaaafaa".to_owned());
    writes.push("GPIOA_AFRH       0x00099665".to_owned());
    let wrong = differences(plan(board, ""), &writes).join("; ");
    assert!(
        wrong.contains("PA15 is (1, 0), but missing in the plan") && wrong.contains("PA8 is Some((2, 5))"),
        "{wrong}"
    );
}
