//! Chip names and memory maps against the data of the flashing tool.

use std::fs::read_to_string;
use std::ops::Range;
use std::path::Path;

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use probe_rs::config::{MemoryRegion, Registry};

/// Parses the `NAME (attributes) : ORIGIN = address, LENGTH = size` lines of a linker's memory map.
fn regions(memory_map: &str) -> Option<Vec<(&str, Range<u64>)>> {
    let lines = memory_map.lines().filter(|line| line.contains("ORIGIN =") && line.contains("LENGTH ="));
    lines
        .map(|line| {
            let (name, rest) = line.split_once(':')?;
            let (origin, length) = rest.split_once(',')?;
            let value = |text: &str| number(text.split_once('=')?.1.trim());
            let (origin, length) = (value(origin)?, value(length)?);
            Some((name.split_whitespace().next()?, origin..origin + length))
        })
        .collect()
}

fn number(text: &str) -> Option<u64> {
    if let Some(digits) = text.strip_prefix("0x") {
        return u64::from_str_radix(digits, 16).ok();
    }
    let (digits, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()));
    let unit = match unit {
        "" => 1,
        "K" => 1024,
        "M" => 1024 * 1024,
        _ => return None,
    };
    Some(digits.parse::<u64>().ok()? * unit)
}

/// Returns every board with a chip.
fn chips() -> impl Iterator<Item = (&'static BoardInfo, &'static str)> {
    BOARDS.iter().filter_map(|board| Some((board, board.tooling.chip?)))
}

/// Returns whether the chip's regions cover all of `range` without gaps.
fn is_covered(mut range: Range<u64>, chip: &[Range<u64>]) -> bool {
    while !range.is_empty() {
        match chip.iter().find(|region| region.contains(&range.start)) {
            Some(region) => range.start = region.end.min(range.end),
            None => return false,
        }
    }
    true
}

/// Size of an STM32G4's flash page in each bank configuration.
const PAGE_BYTES: u64 = 2048;

#[test]
fn every_board_s_memory_map_is_its_chip_s() {
    let registry = Registry::from_builtin_families();
    for (board, chip) in chips() {
        let target = registry.get_target_by_name(chip).unwrap();
        assert_eq!(target.name, chip, "not the chip's full name");
        let of_kind = |is_flash: bool| -> Vec<Range<u64>> {
            let ranges = target.memory_map.iter().filter_map(|region| match region {
                MemoryRegion::Nvm(flash) if is_flash && !flash.is_alias => Some(flash.range.clone()),
                MemoryRegion::Ram(ram) if !is_flash => Some(ram.range.clone()),
                _ => None,
            });
            ranges.collect()
        };
        let (flash, ram) = (of_kind(true), of_kind(false));
        let mapped = regions(board.memory_map).unwrap();
        let names: Vec<_> = mapped.iter().map(|(name, _)| *name).collect();
        // A variant with keys needs pages for them.
        let has_keys = board.tooling.variants.contains(&"auth");
        let runs_in_ccm = board.memory_map.lines().any(|line| line.starts_with("INCLUDE ccm"));
        let expected = ["FLASH", "STORAGE", "STACK", "RAM"].into_iter();
        let expected = expected.chain(runs_in_ccm.then_some("CCM")).chain(has_keys.then_some("KEYS"));
        assert!(names.iter().copied().eq(expected), "{}: {names:?}", board.name);
        for (name, range) in &mapped {
            let memory = if ["FLASH", "STORAGE", "KEYS"].contains(name) { &flash } else { &ram };
            assert!(is_covered(range.clone(), memory), "{}: {name} {range:x?} in {memory:x?}", board.name);
        }
        // The image at the start of the flash, then schemes in whole pages, at least two.
        let (image, storage) = (&mapped[0].1, &mapped[1].1);
        assert!(flash.iter().any(|flash| flash.start == image.start), "{}: {image:x?}", board.name);
        assert!(image.end <= storage.start, "{}: {image:x?} reaches into {storage:x?}", board.name);
        let pages = (storage.start % PAGE_BYTES, storage.end % PAGE_BYTES);
        assert_eq!(pages, (0, 0), "{}: {storage:x?} is not made of whole pages", board.name);
        assert!(storage.end - storage.start >= 2 * PAGE_BYTES, "{}: {storage:x?}", board.name);
        if let Some((_, keys)) = mapped.iter().find(|(name, _)| *name == "KEYS") {
            assert!(keys.start >= storage.end, "{}: {keys:x?} reaches into {storage:x?}", board.name);
            let pages = (keys.start % PAGE_BYTES, keys.end - keys.start);
            assert_eq!(pages, (0, 2 * PAGE_BYTES), "{}: {keys:x?}", board.name);
        }
        // The stack ends where there is no memory.
        let below_stack = mapped[2].1.start - 1;
        let is_memory = |regions: &[Range<u64>]| regions.iter().any(|region| region.contains(&below_stack));
        assert!(!is_memory(&flash) && !is_memory(&ram), "{}: an overflowing stack overwrites", board.name);
    }
}

#[test]
fn no_memory_is_used_through_both_of_its_addresses() {
    // The CCM SRAM has two addresses: a location used at one must not be used at the other.
    let registry = Registry::from_builtin_families();
    for (board, chip) in chips() {
        let target = registry.get_target_by_name(chip).unwrap();
        let named = |name: &str| {
            let mut ranges = target.memory_map.iter().filter_map(|region| match region {
                MemoryRegion::Ram(ram) if ram.name.as_deref() == Some(name) => Some(ram.range.clone()),
                _ => None,
            });
            ranges.next().unwrap()
        };
        let (code, data) = (named("CCMRAM_ICODE"), named("CCMRAM_DCODE"));
        let mapped = regions(board.memory_map).unwrap();
        // Each region of a map, as an offset in the CCM SRAM.
        let parts = |memory: &Range<u64>| -> Vec<Range<u64>> {
            let inside = mapped.iter().map(|(_, range)| {
                range.start.max(memory.start) - memory.start
                    ..range.end.clamp(memory.start, memory.end) - memory.start
            });
            inside.filter(|range| !range.is_empty()).collect()
        };
        let (as_code, as_data) = (parts(&code), parts(&data));
        assert!(!as_code.is_empty() || !as_data.is_empty(), "{}: it is not used", board.name);
        for (one, other) in as_code.iter().flat_map(|one| as_data.iter().map(move |other| (one, other))) {
            let is_apart = one.end <= other.start || other.end <= one.start;
            assert!(is_apart, "{}: {one:x?} of {code:x?} and {other:x?} of {data:x?}", board.name);
        }
    }
}

#[test]
fn every_board_has_its_features_and_every_memory_map_its_board() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR"));
    for manifest in ["Cargo.toml", "../firmware/Cargo.toml"] {
        let features = read_to_string(top.join(manifest)).unwrap();
        for board in BOARDS {
            assert!(
                features.contains(&format!("\n{} = [", board.name)),
                "{manifest}: no feature {}",
                board.name
            );
        }
    }
    for file in std::fs::read_dir(top.join("memory")).unwrap() {
        let name = file.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned();
        assert!(BOARDS.iter().any(|board| board.name == name), "memory/{name}.x: no such board");
    }
}
