//! An ELF as it is flashed: code, data, symbols, RAM.

pub(crate) mod jump_table;
mod read;

use std::collections::BTreeMap;
use std::ops::Range;

use crate::instruction::{Instruction, Undecoded};

pub use read::ImageError;

/// A function of the image. Several functions can share an address (identical code is folded).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Start address; even.
    pub address: u32,
    /// Size in bytes, including the constants after its code.
    pub bytes: u32,
    /// Demangled names, without duplicates.
    pub names: Vec<String>,
}

impl Function {
    /// End address: the address after its last byte.
    #[must_use]
    pub fn end(&self) -> u32 {
        self.address.saturating_add(self.bytes)
    }
}

/// A range of bytes with contents in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// Address at run time.
    pub address: u32,
    /// Address in flash. It differs from `address` for initial values of variables and for code that is
    /// copied before it runs.
    pub load_address: u32,
    /// Contents.
    pub bytes: Vec<u8>,
    /// Whether the program may write to it.
    pub is_writable: bool,
}

/// A parsed ELF.
#[derive(Debug, Clone, Default)]
pub struct Image {
    /// Memory with contents, by address.
    pub segments: Vec<Segment>,
    /// Memory of variables without initial values in the file.
    pub uninitialised: Vec<Range<u32>>,
    /// Every function, by address.
    pub functions: BTreeMap<u32, Function>,
    /// Every other symbol with its address: linker marks (`_stack_start`, `__sbss`) and variables, demangled.
    pub symbols: BTreeMap<String, u32>,
    /// Every instruction, by address: the code of all functions according to the mapping symbols `$t` and
    /// `$d`.
    pub code: BTreeMap<u32, Instruction>,
    /// Code that is not modelled. [`code`](Self::code) has a gap from there to the next function or constant:
    /// execution that reaches the gap finds no instruction.
    pub undecoded: Vec<Undecoded>,
    /// Stack bytes of each function's own frame, by its address, from `.stack_sizes` if present.
    pub stack_sizes: BTreeMap<u32, u32>,
}

impl Image {
    /// The function with this name; any of them if there are several.
    #[must_use]
    pub fn function(&self, name: &str) -> Option<&Function> {
        self.functions.values().find(|function| function.names.iter().any(|known| known == name))
    }

    /// The function that contains an address.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        (address < function.end()).then_some(function)
    }

    /// An address for display: `function+0x1c`, or the address itself outside of functions.
    #[must_use]
    pub fn location(&self, address: u32) -> String {
        let named = self.function_at(address).and_then(|function| Some((function, function.names.first()?)));
        match named {
            Some((function, name)) if function.address == address => name.clone(),
            Some((function, name)) => format!("{name}+{:#x}", address - function.address),
            None => format!("{address:#010x}"),
        }
    }

    /// Bytes of the file at a run-time address; `None` unless all of them are present.
    #[must_use]
    pub fn bytes(&self, address: u32, length: usize) -> Option<&[u8]> {
        self.segments.iter().find_map(|segment| {
            let start = usize::try_from(address.checked_sub(segment.address)?).ok()?;
            segment.bytes.get(start..start.checked_add(length)?)
        })
    }
}
