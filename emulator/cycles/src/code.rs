//! Instructions by their address, found without a search.

use crate::instruction::Instruction;

/// Bytes without code between two areas from which on they are kept apart.
const GAP_BYTES: u32 = 0x1_0000;

/// All instructions of an image.
#[derive(Debug, Default)]
pub(crate) struct Code {
    areas: Vec<Area>,
}

/// Code that lies close together.
#[derive(Debug)]
struct Area {
    /// Address of the first instruction.
    address: u32,
    /// For every halfword, 1 + the place in `instructions` of the one that begins there, or 0.
    places: Vec<u32>,
    instructions: Vec<Instruction>,
}

impl Code {
    /// Of instructions by ascending address.
    pub(crate) fn new<'a>(instructions: impl Iterator<Item = &'a Instruction>) -> Self {
        let mut areas: Vec<Area> = Vec::new();
        for instruction in instructions {
            let area = match areas.last_mut() {
                Some(area) if instruction.address - area.end() < GAP_BYTES => area,
                _ => {
                    areas.push(Area {
                        address: instruction.address,
                        places: Vec::new(),
                        instructions: Vec::new(),
                    });
                    let Some(area) = areas.last_mut() else { continue };
                    area
                }
            };
            area.push(*instruction);
        }
        Self { areas }
    }

    /// The instruction that begins at an address.
    #[inline]
    pub(crate) fn at(&self, address: u32) -> Option<&Instruction> {
        self.areas.iter().find_map(|area| {
            let halfword = address.wrapping_sub(area.address) as usize / 2;
            let place = area.places.get(halfword)?.checked_sub(1)?;
            area.instructions.get(place as usize)
        })
    }
}

impl Area {
    fn end(&self) -> u32 {
        self.instructions.last().map_or(self.address, Instruction::next)
    }

    fn push(&mut self, instruction: Instruction) {
        let halfword = (instruction.address - self.address) as usize / 2;
        self.instructions.push(instruction);
        self.places.resize(halfword, 0);
        self.places.push(u32::try_from(self.instructions.len()).unwrap_or(0));
    }
}
