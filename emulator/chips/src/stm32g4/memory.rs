//! Flash and RAM as bytes. CCM SRAM is mapped twice: at its own address and after SRAM 2 (RM0440, 2.4).

use cycles::image::Image;
use cycles::instruction::Width;

use super::ChipModel;

pub(super) const FLASH: u32 = 0x0800_0000;
const CCM: u32 = 0x1000_0000;
const SRAM: u32 = 0x2000_0000;
/// Message RAM of the CAN controllers.
pub(super) const MESSAGES: u32 = 0x4000_A400;
const MESSAGE_BYTES: u32 = 0x350;
/// Address of the chip's 96-bit unique ID.
const UNIQUE_ID: u32 = 0x1FFF_7590;
const SERIAL: [u8; 12] = *b"EMULATED-G4\0";
/// Value of RAM bytes after power-on: a program must not rely on it.
const AFTER_POWER_ON: u8 = 0xA5;
/// Value of erased flash bytes.
pub(super) const ERASED: u8 = 0xFF;

/// All memory of a chip.
#[derive(Debug, Clone)]
pub(super) struct Memory {
    pub(super) flash: Vec<u8>,
    /// SRAM 1, SRAM 2, CCM SRAM.
    sram: Vec<u8>,
    ccm_begins: usize,
    /// Message RAM.
    pub(super) messages: Vec<u8>,
    /// Serial number of the chip.
    pub(super) serial: [u8; 12],
}

impl Memory {
    pub(super) fn new(part: ChipModel, image: &Image) -> Self {
        let mut flash = vec![ERASED; part.flash_bytes()];
        for segment in &image.segments {
            let begin = segment.load_address.wrapping_sub(FLASH) as usize;
            let room = flash.get_mut(begin..).and_then(|rest| rest.get_mut(..segment.bytes.len()));
            if let Some(room) = room {
                room.copy_from_slice(&segment.bytes);
            }
        }
        let (plain, ccm) = part.sram_bytes();
        Self {
            flash,
            sram: vec![AFTER_POWER_ON; plain + ccm],
            ccm_begins: plain,
            messages: vec![AFTER_POWER_ON; MESSAGE_BYTES as usize],
            serial: SERIAL,
        }
    }

    pub(super) fn load(&self, address: u32, width: Width) -> Option<u32> {
        let bytes = self.place(address)?;
        Some(match width {
            Width::Byte => bytes.first_chunk::<1>()?.map(u32::from)[0],
            Width::Half => u16::from_le_bytes(*bytes.first_chunk()?).into(),
            Width::Word => u32::from_le_bytes(*bytes.first_chunk()?),
        })
    }

    fn place(&self, address: u32) -> Option<&[u8]> {
        match address {
            SRAM..0x2010_0000 => self.sram.get((address - SRAM) as usize..),
            FLASH..CCM => self.flash.get((address - FLASH) as usize..),
            CCM..0x1010_0000 => self.sram.get(self.ccm_begins + (address - CCM) as usize..),
            MESSAGES..0x4000_B000 => self.messages.get((address - MESSAGES) as usize..),
            UNIQUE_ID..0x1FFF_759C => self.serial.get((address - UNIQUE_ID) as usize..),
            _ => None,
        }
    }

    /// Returns `false` if the address is not in RAM.
    pub(super) fn store(&mut self, address: u32, width: Width, value: u32) -> bool {
        let (memory, begin) = match address {
            SRAM..0x2010_0000 => (&mut self.sram, (address - SRAM) as usize),
            CCM..0x1010_0000 => (&mut self.sram, self.ccm_begins + (address - CCM) as usize),
            MESSAGES..0x4000_B000 => (&mut self.messages, (address - MESSAGES) as usize),
            _ => return false,
        };
        let bytes = value.to_le_bytes();
        let count = match width {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        };
        let room = memory.get_mut(begin..).and_then(|rest| rest.get_mut(..count));
        let Some((room, bytes)) = room.zip(bytes.get(..count)) else { return false };
        room.copy_from_slice(bytes);
        true
    }
}
