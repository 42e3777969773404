//! The firmware's functions that copy and fill memory, for every alignment, length and overlap, compared with the standard
//! library.

use cycles::machine::Machine;
use cycles::timing::{Column, Profile, Timing};

use crate::common::firmware;

/// RAM at an address that no board uses.
const SCRATCH: u32 = 0x6000_0000;
const SCRATCH_BYTES: usize = 256;
const LENGTHS: std::ops::RangeInclusive<usize> = 0..=80;
/// Start addresses of a copy of words.
const ALIGNMENTS: std::ops::Range<usize> = 0..8;

/// The image's functions, and memory for them.
struct Bench(Machine);

impl Bench {
    fn new() -> Option<Self> {
        let mut machine =
            Machine::new(firmware()?.image, Timing::new(Profile::ZeroWait, Column::Likely)).unwrap();
        machine.map(SCRATCH, SCRATCH_BYTES.try_into().unwrap());
        Some(Self(machine))
    }

    /// Calls a function with these arguments on memory of distinct bytes, and compares all of it with the result of
    /// `expected`.
    fn hold(&mut self, name: &str, arguments: [u32; 3], expected: impl FnOnce(&mut [u8])) {
        let mut memory: Vec<u8> = (0..=u8::MAX).collect();
        self.0.write(SCRATCH, &memory).unwrap();
        let function = self.0.image().function(name).unwrap_or_else(|| panic!("no {name} in the image"));
        let [first, second, third] = arguments;
        let run = self.0.call(function.address, [first, second, third, 0]).unwrap();
        expected(&mut memory);
        let mut found = [0; SCRATCH_BYTES];
        self.0.read(SCRATCH, &mut found).unwrap();
        assert!(found == *memory, "{name} {arguments:x?}");
        // Return values of the run-time ABI's functions are not checked.
        assert!(
            name.starts_with("__aeabi") || run.result == first,
            "{name} {arguments:x?} gives {:x}",
            run.result
        );
    }
}

fn at(offset: usize) -> u32 {
    SCRATCH + u32::try_from(offset).unwrap()
}

fn word(value: usize) -> u32 {
    value.try_into().unwrap()
}

#[test]
fn memory_is_copied_whatever_the_alignment() {
    let Some(mut bench) = Bench::new() else { return };
    for (to, from) in ALIGNMENTS.flat_map(|to| ALIGNMENTS.map(move |from| (to + 8, from + 128))) {
        for length in LENGTHS {
            for (to, from) in [(to, from), (from, to)] {
                bench.hold("memcpy", [at(to), at(from), word(length)], |memory| {
                    memory.copy_within(from..from + length, to);
                });
            }
        }
    }
}

#[test]
fn memory_that_overlaps_is_moved_in_both_directions() {
    let Some(mut bench) = Bench::new() else { return };
    for (from, to) in (80..84).flat_map(|from| (from - 72..=from + 72).map(move |to| (from, to))) {
        for length in LENGTHS {
            bench.hold("memmove", [at(to), at(from), word(length)], |memory| {
                memory.copy_within(from..from + length, to);
            });
        }
    }
}

#[test]
fn memory_is_filled_with_the_lowest_byte_whatever_the_alignment() {
    let Some(mut bench) = Bench::new() else { return };
    for (to, length) in ALIGNMENTS.flat_map(|to| LENGTHS.map(move |length| (to + 8, length))) {
        let filled = |byte| move |memory: &mut [u8]| memory[to..to + length].fill(byte);
        bench.hold("memset", [at(to), 0xFA5, word(length)], filled(0xA5));
        bench.hold("__aeabi_memset", [at(to), word(length), 0xFA5], filled(0xA5));
        bench.hold("__aeabi_memclr", [at(to), word(length), 0xFA5], filled(0));
    }
}

#[test]
fn the_run_time_abi_s_names_are_the_same_functions() {
    let Some(Bench(machine)) = Bench::new() else { return };
    let address = |name: &str| machine.image().function(name).unwrap_or_else(|| panic!("no {name}")).address;
    for (name, alias) in [
        ("memcpy", "__aeabi_memcpy"),
        ("memmove", "__aeabi_memmove"),
        ("__aeabi_memset", "__aeabi_memset"),
        ("__aeabi_memclr", "__aeabi_memclr"),
    ] {
        for alias in [alias.to_owned(), format!("{alias}4"), format!("{alias}8")] {
            assert_eq!(address(name), address(&alias), "{name} and {alias}");
        }
    }
}
