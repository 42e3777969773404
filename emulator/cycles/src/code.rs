//! Instructions and their prices, indexed by address without a search.

use crate::instruction::Instruction;
use crate::timing::{Price, Timing};

/// Minimum gap without code that separates two areas.
const GAP_BYTES: u32 = 0x1_0000;

/// All instructions of an image.
#[derive(Debug, Default)]
pub(crate) struct Code {
    areas: Vec<Area>,
    instructions: Vec<(Instruction, Price)>,
}

/// A contiguous area of code.
#[derive(Debug)]
struct Area {
    /// Address of the first instruction.
    address: u32,
    /// For every halfword: index + 1 of the instruction that starts there, or 0.
    places: Vec<u32>,
}

impl Code {
    /// Builds the index from instructions by ascending address, with their prices in this model.
    pub(crate) fn new<'a>(instructions: impl Iterator<Item = &'a Instruction>, timing: &Timing) -> Self {
        let mut code = Self::default();
        let mut end = None;
        for instruction in instructions {
            if end.is_none_or(|end| instruction.address - end >= GAP_BYTES) {
                code.areas.push(Area { address: instruction.address, places: Vec::new() });
            }
            end = Some(instruction.next());
            code.instructions.push((*instruction, timing.price(instruction)));
            let place = u32::try_from(code.instructions.len()).unwrap_or(0);
            if let Some(area) = code.areas.last_mut() {
                area.places.resize((instruction.address - area.address) as usize / 2, 0);
                area.places.push(place);
            }
        }
        code
    }

    /// The instruction that starts at an address.
    pub(crate) fn at(&self, address: u32) -> Option<&(Instruction, Price)> {
        self.instructions.get(self.place(address)?)
    }

    /// Like [`at`](Self::at), but fast if the instruction directly follows the one at index `last`. Updates
    /// `last`.
    #[inline]
    pub(crate) fn at_behind(&self, last: &mut usize, address: u32) -> Option<&(Instruction, Price)> {
        let next = self.instructions.get(last.wrapping_add(1));
        if next.is_some_and(|(instruction, _)| instruction.address == address) {
            *last = last.wrapping_add(1);
            return next;
        }
        *last = self.place(address)?;
        self.instructions.get(*last)
    }

    fn place(&self, address: u32) -> Option<usize> {
        let place = self.areas.iter().find_map(|area| {
            let halfword = address.wrapping_sub(area.address) as usize / 2;
            area.places.get(halfword)?.checked_sub(1)
        })?;
        usize::try_from(place).ok()
    }
}
