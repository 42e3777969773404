//! An ELF as it is flashed: code, data, symbols, RAM.

pub(crate) mod jump_table;
mod read;

use std::collections::BTreeMap;
use std::ops::Range;

use crate::instruction::{Instruction, Undecoded};

pub use read::ImageError;

/// A function of the image. Several can have one address (identical ones are folded).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Where it begins; even.
    pub address: u32,
    /// Bytes, with the constants that stand behind its code.
    pub bytes: u32,
    /// Names, demangled, each once.
    pub names: Vec<String>,
}

impl Function {
    /// Where it ends: the address behind its last byte.
    #[must_use]
    pub fn end(&self) -> u32 {
        self.address.saturating_add(self.bytes)
    }
}

/// A range of bytes that the file fills.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Address while the program runs.
    pub address: u32,
    /// Address that it is flashed to; another one for initial values of variables, and for code that is copied to
    /// where it runs.
    pub flashed_at: u32,
    /// What is there.
    pub bytes: Vec<u8>,
    /// Whether the program may write there.
    pub is_writable: bool,
}

/// An ELF, read.
#[derive(Debug, Clone, Default)]
pub struct Image {
    /// Filled memory, by address.
    pub segments: Vec<Segment>,
    /// Memory of variables that the file has no initial value for.
    pub unfilled: Vec<Range<u32>>,
    /// Every function, by address.
    pub functions: BTreeMap<u32, Function>,
    /// Every other symbol with its address: linker marks (`_stack_start`, `__sbss`) and variables, demangled.
    pub symbols: BTreeMap<String, u32>,
    /// Every instruction, by address: code of all functions by the mapping symbols `$t` and `$d`.
    pub code: BTreeMap<u32, Instruction>,
    /// What of that code is not modelled. [`code`](Self::code) lacks it and what stands behind it up to the next
    /// function or constant: who gets there finds no instruction.
    pub undecoded: Vec<Undecoded>,
    /// Bytes of stack that a function's own frame takes, by its address, from `.stack_sizes` where it is there.
    pub stack_sizes: BTreeMap<u32, u32>,
}

impl Image {
    /// The function of this name, one of them if there are several.
    #[must_use]
    pub fn function(&self, name: &str) -> Option<&Function> {
        self.functions.values().find(|function| function.names.iter().any(|known| known == name))
    }

    /// The function that the address stands in.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        (address < function.end()).then_some(function)
    }

    /// An address for a reader: `function+0x1c`, or the address itself where no function is.
    #[must_use]
    pub fn place(&self, address: u32) -> String {
        let named = self.function_at(address).and_then(|function| Some((function, function.names.first()?)));
        match named {
            Some((function, name)) if function.address == address => name.clone(),
            Some((function, name)) => format!("{name}+{:#x}", address - function.address),
            None => format!("{address:#010x}"),
        }
    }

    /// Bytes that the file puts at an address while the program runs; none unless all of them are there.
    #[must_use]
    pub fn bytes(&self, address: u32, length: usize) -> Option<&[u8]> {
        self.segments.iter().find_map(|segment| {
            let start = usize::try_from(address.checked_sub(segment.address)?).ok()?;
            segment.bytes.get(start..start.checked_add(length)?)
        })
    }
}
