//! Minimal images from ELF files.

#[path = "image/elf.rs"]
mod elf;

use std::sync::Arc;

use cycles::image::{Image, ImageError};
use cycles::machine::Machine;
use cycles::timing::{Column, Flash, Profile, Timing};
use elf::{ABSOLUTE, Elf, FUNCTION, GLOBAL, OBJECT};

/// Address of code that is copied at startup.
const CCM: u32 = 0x1000_0000;

/// Two functions in flash, the first with two constants after its code, the second without a size; a
/// variable; and a function that runs at an address other than its flash address.
fn sample() -> Elf {
    Elf {
        machine: 40,
        // NOP; BX LR; constants that are not code; MOVS R0, #1; BX LR
        text: [0xBF00u16, 0x4770, 0xFFFF, 0xFFFF, 0x2001, 0x4770]
            .iter()
            .flat_map(|half| half.to_le_bytes())
            .collect(),
        data: vec![1, 2, 3, 4],
        // LDR R1, [R0]; ADDS R1, #1; STR R1, [R0]; BX LR
        ccm: [0x6801u16, 0x3101, 0x6001, 0x4770].iter().flat_map(|half| half.to_le_bytes()).collect(),
        stack_sizes: vec![0x01, 0, 0, 0x08, 0x90, 0x01, 0x09, 0, 0, 0x08, 0x08],
        symbols: vec![
            ("$t", 0x0800_0000, 0, 0, elf::TEXT),
            ("$d.1", 0x0800_0004, 0, 0, elf::TEXT),
            ("$t", 0x0800_0008, 0, 0, elf::TEXT),
            ("_ZN4core3foo17h0123456789abcdefE", 0x0800_0001, 8, FUNCTION, elf::TEXT),
            ("folded", 0x0800_0001, 8, FUNCTION | GLOBAL, elf::TEXT),
            ("assembly", 0x0800_0009, 0, FUNCTION | GLOBAL, elf::TEXT),
            ("VARIABLE", 0x2000_0000, 4, OBJECT, elf::DATA),
            ("$t", CCM, 0, 0, elf::CCM),
            ("tick", CCM + 1, 8, FUNCTION | GLOBAL, elf::CCM),
            ("_stack_start", 0x2000_8000, 0, GLOBAL, ABSOLUTE),
            ("in no memory", 0, 0, OBJECT, elf::STACK_SIZES),
        ],
    }
}

#[test]
fn an_image_has_memory_functions_and_code() {
    let image = Image::read(&sample().bytes()).unwrap();
    let addresses: Vec<u32> = image.code.keys().copied().collect();
    let in_ccm = [CCM, CCM + 2, CCM + 4, CCM + 6];
    assert_eq!(addresses, [&[0x0800_0000, 0x0800_0002, 0x0800_0008, 0x0800_000A], &in_ccm[..]].concat());
    assert!(image.undecoded.is_empty());

    assert_eq!(image.functions[&0x0800_0000].names, ["core::foo", "folded"]);
    assert_eq!(image.function("folded").unwrap().bytes, 8);
    assert_eq!(image.function("assembly").unwrap().bytes, 4);
    assert_eq!(image.function_at(0x0800_0006).unwrap().address, 0x0800_0000);
    assert!(image.function_at(0x0800_000C).is_none());

    assert_eq!(image.symbols["VARIABLE"], 0x2000_0000);
    assert_eq!(image.symbols["_stack_start"], 0x2000_8000);
    assert_eq!(image.symbols.len(), 2);
    assert_eq!(image.stack_sizes.into_iter().collect::<Vec<_>>(), [(0x0800_0000, 144), (0x0800_0008, 8)]);

    let [text, ccm, data] = &image.segments[..] else { panic!("three segments") };
    assert_eq!((ccm.address, ccm.load_address, ccm.is_writable), (CCM, 0x0800_0010, false));
    let uninitialised = CCM + 8..CCM + 16;
    assert_eq!(image.uninitialised.as_slice(), std::slice::from_ref(&uninitialised));
    assert_eq!((text.address, text.is_writable), (0x0800_0000, false));
    assert_eq!((data.address, data.load_address, data.is_writable), (0x2000_0000, 0x0800_000C, true));
}

/// Code and variables in a separate RAM.
#[test]
fn code_runs_where_it_is_copied_to() {
    let mut image = Image::read(&sample().bytes()).unwrap();
    let marks = [("_stack_end", 0x2000_1000), ("__sdata", 0x2000_0000), ("__euninit", 0x2000_1000)];
    image.symbols.extend(marks.map(|(name, address)| (name.to_owned(), address)));
    let timing = Timing::new(Profile::Flash(Flash::STM32G4), Column::Likely);
    let mut machine = Machine::new(Arc::new(image), timing).unwrap();
    let run = machine.call(CCM, [CCM + 8, 0, 0, 0]).unwrap();
    // 2 cycles for the load, 1 each for sum and store, 3 for the return: no wait states.
    assert_eq!(run.cycles, 7);
    let mut variable = [0; 4];
    machine.read(CCM + 8, &mut variable).unwrap();
    assert_eq!(variable, [1, 0, 0, 0]);
    let mut flashed = [0; 2];
    machine.read(0x0800_0010, &mut flashed).unwrap();
    assert_eq!(flashed, 0x6801_u16.to_le_bytes());
}

#[test]
fn places_have_names_and_memory_has_bytes() {
    let image = Image::read(&sample().bytes()).unwrap();
    assert_eq!(image.location(0x0800_0008), "assembly");
    assert_eq!(image.location(0x0800_000A), "assembly+0x2");
    assert_eq!(image.location(0x0900_0000), "0x09000000");
    assert_eq!(image.bytes(0x2000_0001, 2), Some(&[2, 3][..]));
    assert_eq!(image.bytes(0x2000_0003, 2), None);
    assert_eq!(image.bytes(0x1FFF_FFFF, 1), None);
}

/// Code that is not modelled leaves a gap; the functions after it are still decoded.
#[test]
fn undecoded_code_is_a_gap_up_to_the_next_function() {
    let mut elf = sample();
    elf.text[2..4].copy_from_slice(&0xB650u16.to_le_bytes());
    let image = Image::read(&elf.bytes()).unwrap();
    let addresses: Vec<u32> = image.code.keys().copied().collect();
    assert_eq!(addresses[..3], [0x0800_0000, 0x0800_0008, 0x0800_000A]);
    assert_eq!(image.undecoded[0].to_string(), "0xb650 at 0x08000002 is not a modelled instruction");
}

#[test]
fn files_that_cannot_be_analysed_return_the_reason() {
    let error = |elf: Elf| Image::read(&elf.bytes()).unwrap_err();
    assert!(matches!(Image::read(b"not an ELF"), Err(ImageError::NotElf(_))));
    assert!(matches!(error(Elf { machine: 243, ..sample() }), ImageError::NotArm { machine: 243 }));
    assert!(matches!(error(Elf { symbols: Vec::new(), ..sample() }), ImageError::Stripped));
    let functions = sample().symbols.into_iter().filter(|(name, ..)| !name.starts_with('$')).collect();
    assert!(matches!(error(Elf { symbols: functions, ..sample() }), ImageError::Unmapped));
    let stack_sizes = vec![0x01, 0, 0, 0x08, 0x90];
    assert!(matches!(error(Elf { stack_sizes, ..sample() }), ImageError::Truncated { part: ".stack_sizes" }));
}

/// Any truncated file is rejected or parsed, never a panic.
#[test]
fn damaged_files_do_not_panic() {
    let bytes = sample().bytes();
    for length in 0..bytes.len() {
        let _ = Image::read(&bytes[..length]);
    }
    for at in 0..bytes.len() {
        for value in [0, 0x7F, 0xFF] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            let _ = Image::read(&damaged);
        }
    }
}
