//! Flash, RAM and additionally mapped memory.

use std::ops::Range;

use crate::concrete::Concrete;
use crate::image::Image;
use crate::instruction::Width;
use crate::state::{AccessError, Memory};

/// All memory; RAM is first because it is used most.
#[derive(Debug, Clone)]
pub(super) struct Regions {
    regions: Vec<Region>,
    /// Address of the first access since this was last cleared.
    pub(super) first_access: Option<u32>,
}

#[derive(Debug, Clone)]
struct Region {
    address: u32,
    bytes: Vec<u8>,
    is_writable: bool,
}

impl Region {
    #[inline]
    fn offset(&self, address: u32) -> usize {
        address.wrapping_sub(self.address) as usize
    }

    #[inline]
    fn get<const N: usize>(&self, address: u32) -> Option<&[u8; N]> {
        self.bytes.get(self.offset(address)..)?.first_chunk()
    }

    fn slice(&self, address: u32, bytes: usize) -> Option<&[u8]> {
        let offset = self.offset(address);
        self.bytes.get(offset..offset.checked_add(bytes)?)
    }

    fn slice_mut(&mut self, address: u32, bytes: usize) -> Option<&mut [u8]> {
        let offset = self.offset(address);
        self.bytes.get_mut(offset..offset.checked_add(bytes)?)
    }
}

impl Regions {
    /// RAM (zero except for initial values), flashed contents, and other RAM that the image uses.
    pub(super) fn new(ram: Range<u32>, image: &Image) -> Self {
        let mut regions = Self { regions: Vec::new(), first_access: None };
        regions.map(ram.start, ram.end.saturating_sub(ram.start));
        for variables in image.uninitialised.iter().filter(|variables| !ram.contains(&variables.start)) {
            regions.map(variables.start, variables.end - variables.start);
        }
        for segment in &image.segments {
            let in_ram = regions.bytes_mut(segment.address, segment.bytes.len()).ok();
            if let Some(bytes) = in_ram {
                bytes.copy_from_slice(&segment.bytes);
            } else {
                regions.add(segment.address, segment.bytes.clone(), segment.is_writable);
            }
            if segment.load_address != segment.address {
                regions.add(segment.load_address, segment.bytes.clone(), false);
            }
        }
        regions
    }

    pub(super) fn map(&mut self, address: u32, bytes: u32) {
        self.add(address, vec![0; bytes as usize], true);
    }

    fn add(&mut self, address: u32, bytes: Vec<u8>, is_writable: bool) {
        self.regions.push(Region { address, bytes, is_writable });
    }

    pub(super) fn writable(&self) -> impl Iterator<Item = (u32, &[u8])> {
        let writable = self.regions.iter().filter(|region| region.is_writable);
        writable.map(|region| (region.address, region.bytes.as_slice()))
    }

    pub(super) fn slice(&self, range: Range<u32>) -> Option<&[u8]> {
        self.regions.iter().find_map(|region| region.slice(range.start, range.len()))
    }

    pub(super) fn slice_mut(&mut self, range: Range<u32>) -> Option<&mut [u8]> {
        self.bytes_mut(range.start, range.len()).ok()
    }

    pub(super) fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), AccessError> {
        let source = self.regions.iter().find_map(|region| region.slice(address, bytes.len()));
        bytes.copy_from_slice(source.ok_or(AccessError::Unmapped { address })?);
        Ok(())
    }

    pub(super) fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), AccessError> {
        self.bytes_mut(address, bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }

    /// Bytes for a write.
    #[inline]
    fn bytes_mut(&mut self, address: u32, bytes: usize) -> Result<&mut [u8], AccessError> {
        for region in &mut self.regions {
            let is_writable = region.is_writable;
            if let Some(slice) = region.slice_mut(address, bytes) {
                return if is_writable { Ok(slice) } else { Err(AccessError::ReadOnly { address }) };
            }
        }
        Err(AccessError::Unmapped { address })
    }

    #[inline]
    fn get<const N: usize>(&self, address: u32) -> Result<[u8; N], AccessError> {
        let found = self.regions.iter().find_map(|region| region.get(address));
        found.copied().ok_or(AccessError::Unmapped { address })
    }
}

impl Memory<Concrete> for Regions {
    #[inline]
    fn load(&mut self, _domain: &mut Concrete, address: u32, width: Width) -> Result<u32, AccessError> {
        self.first_access.get_or_insert(address);
        Ok(match width {
            Width::Byte => self.get::<1>(address)?.map(u32::from)[0],
            Width::Half => u16::from_le_bytes(self.get(address)?).into(),
            Width::Word => u32::from_le_bytes(self.get(address)?),
        })
    }

    #[inline]
    fn store(
        &mut self,
        _domain: &mut Concrete,
        address: u32,
        width: Width,
        value: u32,
    ) -> Result<(), AccessError> {
        self.first_access.get_or_insert(address);
        let [a, b, c, d] = value.to_le_bytes();
        match width {
            Width::Byte => self.write(address, &[a]),
            Width::Half => self.write(address, &[a, b]),
            Width::Word => self.write(address, &[a, b, c, d]),
        }
    }
}
