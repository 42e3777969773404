//! Parsing of the file: program headers, symbols, code, stack sizes.

use core::ops::Range;
use std::collections::BTreeMap;

use object::elf::{EM_ARM, PF_W, PT_LOAD, SHF_ALLOC};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{LittleEndian, Object, ObjectSection, ObjectSymbol, SectionFlags, SymbolKind, SymbolSection};

use super::{Function, Image, Segment};
use crate::instruction::decode_all;

type File<'a> = ElfFile32<'a, LittleEndian>;

/// Reason that a file cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Not a 32-bit little-endian ELF, or a damaged one.
    #[error("invalid 32-bit little-endian ELF ({0}): use the linker's output, not a .bin or .hex file")]
    NotElf(#[from] object::Error),
    /// A part extends beyond the end of the file.
    #[error("truncated ELF: {part} is incomplete; copy or link the file again")]
    Truncated {
        /// The part.
        part: &'static str,
    },
    /// An ELF for another processor.
    #[error("ELF for another processor (machine {machine}, Arm is 40): build it for thumbv7em-none-eabihf")]
    NotArm {
        /// Machine number in the header.
        machine: u16,
    },
    /// The ELF has no functions.
    #[error("no function symbols: link the image without stripping it (`strip = \"none\"` in its profile)")]
    Stripped,
    /// The ELF does not distinguish code from data.
    #[error(
        "no mapping symbols ($t, $d) to separate code from constants: link without stripping local symbols"
    )]
    Unmapped,
}

impl Image {
    /// Parses an ELF.
    ///
    /// # Errors
    /// [`ImageError`]. Code that is not modelled is not an error: see [`undecoded`](Self::undecoded).
    pub fn read(bytes: &[u8]) -> Result<Self, ImageError> {
        let file = File::parse(bytes)?;
        let machine = file.elf_header().e_machine(LittleEndian);
        if machine != EM_ARM {
            return Err(ImageError::NotArm { machine });
        }
        let mut image =
            Self { segments: segments(&file)?, uninitialised: uninitialised(&file), ..Self::default() };
        let mapping = image.read_symbols(&file)?;
        if image.functions.is_empty() {
            return Err(ImageError::Stripped);
        }
        if !mapping.values().any(|&is_code| is_code) {
            return Err(ImageError::Unmapped);
        }
        image.measure_functions(&file);
        image.read_code(&mapping);
        image.stack_sizes = stack_sizes(&file)?;
        Ok(image)
    }

    /// Reads functions and other symbols. Returns where code starts (true) and ends (false).
    fn read_symbols(&mut self, file: &File<'_>) -> Result<BTreeMap<u32, bool>, ImageError> {
        let mut mapping = BTreeMap::new();
        let mut locals = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| is_in_memory(file, symbol.section())) {
            let Ok(address) = u32::try_from(symbol.address()) else { continue };
            let name = symbol.name()?;
            if symbol.kind() == SymbolKind::Text {
                let address = address & !1;
                let bytes = u32::try_from(symbol.size()).unwrap_or(0);
                let empty = Function { address, bytes: 0, names: Vec::new() };
                let function = self.functions.entry(address).or_insert(empty);
                function.bytes = function.bytes.max(bytes);
                let name = demangled(name);
                if !function.names.contains(&name) {
                    function.names.push(name);
                }
            } else if let Some(is_code) = mapped(name) {
                mapping.insert(address, is_code);
            } else if symbol.is_global() {
                self.symbols.insert(demangled(name), address);
            } else if !name.is_empty() {
                locals.insert(demangled(name), address);
            }
        }
        for (name, address) in locals {
            self.symbols.entry(name).or_insert(address);
        }
        Ok(mapping)
    }

    /// Functions whose symbols have no size (from assembly) extend to the next function or the end of their
    /// section.
    fn measure_functions(&mut self, file: &File<'_>) {
        let starts: Vec<u32> = self.functions.keys().copied().collect();
        let ends = starts.iter().skip(1).copied().map(Some).chain([None]);
        for (function, next) in
            self.functions.values_mut().zip(ends).filter(|(function, _)| function.bytes == 0)
        {
            let address = u64::from(function.address);
            let section = file
                .sections()
                .find(|section| (section.address()..section.address() + section.size()).contains(&address));
            let end = section.and_then(|section| u32::try_from(section.address() + section.size()).ok());
            let end = [next, end].into_iter().flatten().min().unwrap_or(function.address);
            function.bytes = end - function.address;
        }
    }

    /// Decodes the code of all functions. An IT block never extends into another function or across
    /// constants.
    fn read_code(&mut self, mapping: &BTreeMap<u32, bool>) {
        let (mut code, mut undecoded) = (BTreeMap::new(), Vec::new());
        for range in self.functions.values().flat_map(|function| code_ranges(function, mapping)) {
            let bytes = usize::try_from(range.end - range.start).ok();
            let bytes = bytes.and_then(|length| self.bytes(range.start, length)).unwrap_or_default();
            for decoded in decode_all(range.start, bytes) {
                match decoded {
                    Ok(instruction) => drop(code.insert(instruction.address, instruction)),
                    Err(error) => undecoded.push(error),
                }
            }
        }
        (self.code, self.undecoded) = (code, undecoded);
    }
}

/// Code ranges of a function.
fn code_ranges(function: &Function, mapping: &BTreeMap<u32, bool>) -> Vec<Range<u32>> {
    let before = mapping.range(..=function.address).next_back();
    let mut code_since = before.filter(|&(_, &is_code)| is_code).map(|_| function.address);
    let mut ranges = Vec::new();
    for (&address, &is_code) in
        mapping.range(function.address..).take_while(|&(&mark, _)| mark < function.end())
    {
        match code_since {
            Some(start) if !is_code => {
                ranges.push(start..address);
                code_since = None;
            }
            None if is_code => code_since = Some(address),
            _ => {}
        }
    }
    ranges.extend(code_since.map(|start| start..function.end()));
    ranges
}

/// Ranges with contents in the file, by address.
fn segments(file: &File<'_>) -> Result<Vec<Segment>, ImageError> {
    let mut segments = Vec::new();
    for header in file.elf_program_headers() {
        if header.p_type(LittleEndian) != PT_LOAD || header.p_filesz(LittleEndian) == 0 {
            continue;
        }
        segments.push(Segment {
            address: header.p_vaddr(LittleEndian),
            load_address: header.p_paddr(LittleEndian),
            bytes: header
                .data(LittleEndian, file.data())
                .map_err(|()| ImageError::Truncated { part: "a segment" })?
                .to_vec(),
            is_writable: header.p_flags(LittleEndian) & PF_W != 0,
        });
    }
    segments.sort_by_key(|segment| segment.address);
    Ok(segments)
}

/// Ranges without contents in the file, after the contents of their segment.
fn uninitialised(file: &File<'_>) -> Vec<Range<u32>> {
    let loaded = file.elf_program_headers().iter().filter(|header| header.p_type(LittleEndian) == PT_LOAD);
    let behind = loaded.map(|header| {
        let start = header.p_vaddr(LittleEndian);
        let [filled, all] = [header.p_filesz(LittleEndian), header.p_memsz(LittleEndian)];
        start.saturating_add(filled)..start.saturating_add(all)
    });
    behind.filter(|range| !range.is_empty()).collect()
}

/// Whether a symbol of this section has an address in the processor's memory.
fn is_in_memory(file: &File<'_>, section: SymbolSection) -> bool {
    match section {
        SymbolSection::Absolute => true,
        SymbolSection::Section(index) => file.section_by_index(index).is_ok_and(|section| {
            matches!(section.flags(), SectionFlags::Elf { sh_flags } if sh_flags & u64::from(SHF_ALLOC) != 0)
        }),
        _ => false,
    }
}

/// The kind of the bytes after a mapping symbol: code (true), or data or code of another instruction set
/// (false).
fn mapped(name: &str) -> Option<bool> {
    let kind = name.split('.').next()?;
    match kind {
        "$t" => Some(true),
        "$d" | "$a" => Some(false),
        _ => None,
    }
}

/// Demangled, without the hash that distinguishes compilations. Non-printable characters become `?`.
fn demangled(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name)).replace(|letter: char| !matches!(letter, ' '..='~'), "?")
}

/// `.stack_sizes`: an address and a number of bytes in LEB128 for each function.
fn stack_sizes(file: &File<'_>) -> Result<BTreeMap<u32, u32>, ImageError> {
    let mut sizes = BTreeMap::new();
    for section in file.sections().filter(|section| section.name() == Ok(".stack_sizes")) {
        let mut rest = section.data()?;
        while let Some((address, behind)) = rest.split_first_chunk() {
            let (bytes, behind) =
                unsigned_leb128(behind).ok_or(ImageError::Truncated { part: ".stack_sizes" })?;
            sizes.insert(u32::from_le_bytes(*address) & !1, bytes);
            rest = behind;
        }
    }
    Ok(sizes)
}

/// A LEB128 number (seven bits per byte, lowest first, bit 7 clear in the last byte), and the remaining
/// bytes.
fn unsigned_leb128(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let length = bytes.iter().position(|byte| byte & 0x80 == 0)? + 1;
    let (number, behind) = bytes.split_at_checked(length)?;
    let value = number
        .iter()
        .rev()
        .try_fold(0u32, |value, byte| value.checked_mul(0x80)?.checked_add(u32::from(byte & 0x7F)))?;
    Some((value, behind))
}
