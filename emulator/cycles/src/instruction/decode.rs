//! Decoding of bytes into instructions.

use super::bits::Bits;
use super::{Condition, Instruction, ItState, Operation, narrow, wide};

/// Bytes that are not an instruction of a Cortex-M4F, that are not modelled, or whose effect is UNPREDICTABLE
/// according to the manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Undecoded {
    /// A 16-bit encoding.
    #[error("{code:#06x} at {address:#010x} is not a modelled instruction")]
    Narrow {
        /// Address.
        address: u32,
        /// The halfword.
        code: u16,
    },
    /// A 32-bit encoding.
    #[error("{code:#010x} at {address:#010x} is not a modelled instruction")]
    Wide {
        /// Address.
        address: u32,
        /// The encoding, with its first halfword on top.
        code: u32,
    },
    /// The code ends within an instruction.
    #[error("the code ends within the instruction at {address:#010x}")]
    Truncated {
        /// Start address.
        address: u32,
    },
}

/// Decodes the first instruction in `bytes`, at `address` and in the IT block `block`.
///
/// # Errors
/// [`Undecoded`].
pub fn decode(address: u32, bytes: &[u8], block: ItState) -> Result<Instruction, Undecoded> {
    let half = |index: usize| match bytes.get(index..index + 2) {
        Some(&[low, high]) => Ok(u16::from_le_bytes([low, high])),
        _ => Err(Undecoded::Truncated { address }),
    };
    let first = half(0)?;
    let in_it_block = block.length() > 0;
    let is_wide = first >> 11 >= 0b11101;
    let (bytes, decoded, undecoded) = if is_wide {
        let code = u32::from(first) << 16 | u32::from(half(2)?);
        (4, wide::decode(Bits(code), address), Undecoded::Wide { address, code })
    } else {
        let code = Bits(u32::from(first));
        (2, narrow::decode(code, address, in_it_block), Undecoded::Narrow { address, code: first })
    };
    let (condition, operation) = decoded.ok_or(undecoded)?;
    if in_it_block && (condition != Condition::Always || !may_stand_in_block(&operation, block)) {
        return Err(undecoded);
    }
    let condition = match (operation, block.condition()) {
        (Operation::Breakpoint(_), _) | (_, None) => condition,
        (_, Some(of_block)) => of_block,
    };
    Ok(Instruction { address, bytes, condition, in_it_block, operation })
}

/// A jump must be the last instruction of its IT block; some instructions are not allowed in any.
fn may_stand_in_block(operation: &Operation, block: ItState) -> bool {
    match operation {
        Operation::CompareBranch { .. } | Operation::IfThen { .. } | Operation::ChangeState { .. } => false,
        _ => block.length() == 1 || !operation.jumps(),
    }
}

/// Decodes code from start to end. After an [`Undecoded`], the iteration ends.
#[must_use]
pub fn decode_all(address: u32, bytes: &[u8]) -> Instructions<'_> {
    Instructions { address, bytes, block: ItState::NOT_IN_BLOCK }
}

/// The instructions of a piece of code, in order; see [`decode_all`].
#[derive(Debug, Clone)]
pub struct Instructions<'a> {
    address: u32,
    bytes: &'a [u8],
    block: ItState,
}

impl Iterator for Instructions<'_> {
    type Item = Result<Instruction, Undecoded>;

    fn next(&mut self) -> Option<Self::Item> {
        let &[governing, ..] = self.bytes else { return None };
        let decoded = decode(self.address, self.bytes, self.block);
        self.bytes = match &decoded {
            Ok(instruction) => {
                self.address = instruction.next();
                self.block = match instruction.operation {
                    Operation::IfThen { .. } => ItState::behind(governing),
                    _ => self.block.advanced(),
                };
                self.bytes.get(usize::from(instruction.bytes)..).unwrap_or_default()
            }
            Err(_) => &[],
        };
        Some(decoded)
    }
}
