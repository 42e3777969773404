//! The memory protection unit, for privileged code only (DDI 0403E B3.5).

use crate::state::AccessError;

const TYPE: u32 = 0xE000_ED90;
const CONTROL: u32 = 0xE000_ED94;
const NUMBER: u32 = 0xE000_ED98;
const BASE: u32 = 0xE000_ED9C;
const ATTRIBUTES: u32 = 0xE000_EDA0;
const REGIONS: usize = 8;

/// Regions of the MPU. Outside of regions, a privileged program has full access (`PRIVDEFENA`). If the MPU is
/// disabled, all accesses are allowed.
#[derive(Debug, Clone, Default)]
pub(super) struct MemoryProtection {
    control: u32,
    number: u32,
    /// Base address with its low bits; size and attributes.
    regions: [(u32, u32); REGIONS],
    /// Number of regions up to the last enabled region.
    used: usize,
}

impl MemoryProtection {
    /// Whether an access is allowed.
    pub(super) fn check(&self, address: u32, writes: bool) -> Result<(), AccessError> {
        if self.control & 1 == 0 {
            return Ok(());
        }
        let denied =
            self.regions.iter().take(self.used).rev().find(|region| contains(**region, address)).map(
                |(_, attributes)| match attributes >> 24 & 7 {
                    0 => true,
                    5 | 6 => writes,
                    _ => false,
                },
            );
        if denied == Some(true) { Err(AccessError::Protected { address }) } else { Ok(()) }
    }

    pub(super) fn load(&self, address: u32) -> Option<u32> {
        let (base, attributes) = self.region();
        Some(match address {
            TYPE => 0x800,
            CONTROL => self.control,
            NUMBER => self.number,
            BASE => base,
            ATTRIBUTES => attributes,
            _ => return None,
        })
    }

    /// Writes a register. Returns whether the address is one of its registers.
    pub(super) fn store(&mut self, address: u32, value: u32) -> bool {
        match address {
            TYPE => {}
            CONTROL => self.control = value & 7,
            NUMBER => self.number = value & 7,
            BASE => {
                // `VALID` also selects the region.
                if value & 0x10 != 0 {
                    self.number = value & 7;
                }
                if let Some(region) = self.region_mut() {
                    region.0 = value & !0x1F;
                }
            }
            ATTRIBUTES => {
                if let Some(region) = self.region_mut() {
                    region.1 = value;
                }
                let last = self.regions.iter().rposition(|(_, attributes)| attributes & 1 == 1);
                self.used = last.map_or(0, |last| last + 1);
            }
            _ => return false,
        }
        true
    }

    fn region(&self) -> (u32, u32) {
        self.regions.get(self.number as usize).copied().unwrap_or_default()
    }

    fn region_mut(&mut self) -> Option<&mut (u32, u32)> {
        self.regions.get_mut(self.number as usize)
    }
}

/// Whether an enabled region contains the address, outside its disabled subregions (eighths).
fn contains((base, attributes): (u32, u32), address: u32) -> bool {
    let exponent = (attributes >> 1 & 0x1F) + 1;
    if attributes & 1 == 0 || exponent < 5 {
        return false;
    }
    let offset = address.wrapping_sub(base);
    if exponent < 32 && offset >> exponent != 0 {
        return false;
    }
    let eighth = if exponent >= 8 { offset >> (exponent - 3) } else { 0 };
    attributes >> (8 + eighth) & 1 == 0
}
