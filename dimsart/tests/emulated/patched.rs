//! Copies of an image with other instructions.

use std::fs;
use std::path::PathBuf;

use object::{Object, ObjectSection, ObjectSymbol};
use tempfile::TempDir;

/// Returns the image with other instructions at the start of functions.
pub(crate) fn patched(elf: &[u8], folder: &TempDir, patches: &[(&[&str], &[u16])]) -> PathBuf {
    let mut bytes = elf.to_vec();
    for (function, instructions) in patches {
        let (_, place) = symbol(elf, function);
        let place = place.unwrap();
        let instructions: Vec<u8> = instructions.iter().flat_map(|half| half.to_le_bytes()).collect();
        bytes[place..place + instructions.len()].copy_from_slice(&instructions);
    }
    let path = folder.path().join("patched");
    fs::write(&path, bytes).unwrap();
    path
}

/// Returns address and file offset, if any, of the symbol whose name contains all `parts`.
pub(crate) fn symbol(elf: &[u8], parts: &[&str]) -> (u64, Option<usize>) {
    let file = object::File::parse(elf).unwrap();
    let is_it = |name: &str| parts.iter().all(|part| name.contains(part));
    let found: Vec<_> = file.symbols().filter(|symbol| symbol.name().is_ok_and(is_it)).collect();
    assert_eq!(found.len(), 1, "{parts:?}: {found:?}; the name must match one function of the image");
    // The lowest bit marks Thumb code.
    let address = found[0].address() & !1;
    let section = file.section_by_index(found[0].section_index().unwrap()).unwrap();
    let place = section.file_range().map(|(start, _)| start + address - section.address());
    (address, place.map(|place| place.try_into().unwrap()))
}
