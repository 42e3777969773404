//! Chip names and memory maps against the data that the flashing tool itself uses.

use std::fs::read_to_string;
use std::ops::Range;
use std::path::Path;

use boards::chips::CHIPS;
use probe_rs::config::{MemoryRegion, Registry};

/// The `NAME (attributes) : ORIGIN = address, LENGTH = size` lines of a linker's memory map.
fn regions(memory_map: &str) -> Vec<(&str, Range<u64>)> {
    let lines = memory_map.lines().filter(|line| line.contains("ORIGIN =") && line.contains("LENGTH ="));
    lines
        .map(|line| {
            let (name, rest) = line.split_once(':').unwrap();
            let (origin, length) = rest.split_once(',').unwrap();
            let value = |text: &str| number(text.split_once('=').unwrap().1.trim());
            let (origin, length) = (value(origin), value(length));
            (name.split_whitespace().next().unwrap(), origin..origin + length)
        })
        .collect()
}

fn number(text: &str) -> u64 {
    if let Some(digits) = text.strip_prefix("0x") {
        return u64::from_str_radix(digits, 16).unwrap();
    }
    let (digits, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()));
    let unit = match unit {
        "" => 1,
        "K" => 1024,
        "M" => 1024 * 1024,
        _ => panic!("{text}: no unit of the linker"),
    };
    digits.parse::<u64>().unwrap() * unit
}

/// Whether the chip's regions cover all of `range`, one behind the other.
fn is_covered(mut range: Range<u64>, chip: &[Range<u64>]) -> bool {
    while !range.is_empty() {
        match chip.iter().find(|region| region.contains(&range.start)) {
            Some(region) => range.start = region.end.min(range.end),
            None => return false,
        }
    }
    true
}

#[test]
fn every_board_s_memory_map_is_its_chip_s() {
    let registry = Registry::from_builtin_families();
    for chip in CHIPS {
        let target = registry.get_target_by_name(chip.name).unwrap();
        assert_eq!(target.name, chip.name, "not the chip's full name");
        let of_kind = |is_flash: bool| -> Vec<Range<u64>> {
            let ranges = target.memory_map.iter().filter_map(|region| match region {
                MemoryRegion::Nvm(flash) if is_flash && !flash.is_alias => Some(flash.range.clone()),
                MemoryRegion::Ram(ram) if !is_flash => Some(ram.range.clone()),
                _ => None,
            });
            ranges.collect()
        };
        let (flash, ram) = (of_kind(true), of_kind(false));
        let mapped = regions(chip.memory_map);
        let names: Vec<_> = mapped.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["FLASH", "STACK", "RAM"], "{}", chip.board);
        for (name, range) in &mapped {
            let memory = if *name == "FLASH" { &flash } else { &ram };
            assert!(is_covered(range.clone(), memory), "{}: {name} {range:x?} in {memory:x?}", chip.board);
        }
        // All the flash there is, and a stack that ends where no memory is.
        assert!(flash.contains(&mapped[0].1), "{}: {:x?} in {flash:x?}", chip.board, mapped[0].1);
        let below_stack = mapped[1].1.start - 1;
        let is_memory = |regions: &[Range<u64>]| regions.iter().any(|region| region.contains(&below_stack));
        assert!(!is_memory(&flash) && !is_memory(&ram), "{}: an overflowing stack overwrites", chip.board);
    }
}

#[test]
fn the_second_sight_of_a_chip_s_memory_is_not_used_twice() {
    // The CCM SRAM is the stack; behind the SRAM, at the stack's size from the end, it shows up again.
    for chip in CHIPS {
        let mapped = regions(chip.memory_map);
        let [_, (_, stack), (_, ram)] = mapped.as_slice() else { panic!("{}", chip.board) };
        let registry = Registry::from_builtin_families();
        let target = registry.get_target_by_name(chip.name).unwrap();
        let named = |name: &str| {
            target.memory_map.iter().find_map(|region| match region {
                MemoryRegion::Ram(ram) if ram.name.as_deref() == Some(name) => Some(ram.range.clone()),
                _ => None,
            })
        };
        assert_eq!(named("CCMRAM_ICODE").as_ref(), Some(stack), "{}", chip.board);
        assert_eq!(named("CCMRAM_DCODE").map(|alias| alias.start), Some(ram.end), "{}", chip.board);
    }
}

#[test]
fn every_memory_map_belongs_to_a_board() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("memory");
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|file| file.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    let mut boards: Vec<_> = CHIPS.iter().map(|chip| chip.board.to_owned()).collect();
    boards.sort();
    assert_eq!(files, boards);
    let features = read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).unwrap();
    for chip in CHIPS {
        assert!(features.contains(&format!("\n{} = [", chip.board)), "{}: no such feature", chip.board);
    }
}
