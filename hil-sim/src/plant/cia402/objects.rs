//! Object dictionary of a drive.

use std::collections::BTreeMap;

use super::{OFF, TORQUE_MODE};

const UNSUPPORTED_ACCESS: u32 = 0x0601_0000;
const READ_ONLY: u32 = 0x0601_0002;
const NO_OBJECT: u32 = 0x0602_0000;
const NOT_MAPPABLE: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;
const OTHER_LENGTH: u32 = 0x0607_0010;
const NO_PART: u32 = 0x0609_0011;
const OUT_OF_RANGE: u32 = 0x0609_0030;

#[derive(Debug, Clone, Copy)]
struct Object {
    value: u32,
    bytes: u8,
    is_writable: bool,
    is_mappable: bool,
}

/// By index and subindex.
#[derive(Debug, Clone)]
pub(super) struct Objects {
    all: BTreeMap<(u16, u8), Object>,
    forgotten: Vec<u16>,
}

impl Objects {
    pub(super) fn new(node: u8, rated_nm: f64) -> Self {
        let mut objects = Self { all: BTreeMap::new(), forgotten: Vec::new() };
        objects.reset(node, rated_nm);
        objects
    }

    pub(super) fn forget(&mut self, object: u16) {
        self.forgotten.push(object);
        self.all.retain(|(index, _), _| *index != object);
    }

    /// Power-on defaults.
    pub(super) fn reset(&mut self, node: u8, rated_nm: f64) {
        self.all.clear();
        let mut add = |index, part, bytes, value, is_writable, is_mappable| {
            self.all.insert((index, part), Object { value, bytes, is_writable, is_mappable });
        };
        add(0x1016, 1, 4, 0, true, false);
        add(0x1017, 0, 2, 0, true, false);
        add(0x6007, 0, 2, 1, true, false);
        for (index, bytes) in [(0x6040, 2), (0x6071, 2), (0x6060, 1)] {
            add(index, 0, bytes, 0, true, true);
        }
        for (index, bytes) in [(0x6041, 2), (0x6061, 1), (0x6064, 4), (0x606c, 4), (0x6077, 2)] {
            add(index, 0, bytes, 0, false, true);
        }
        add(0x6072, 0, 2, 3000, true, false);
        add(0x6076, 0, 4, super::whole(1e3 * rated_nm), false, false);
        add(0x6079, 0, 4, 48_000, false, true);
        for (place, parameters) in (0..).zip([0x1400, 0x1800, 0x1801, 0x1802, 0x1803]) {
            // All transmit PDOs are enabled and event-driven.
            let function = if parameters == 0x1400 { 0x200 } else { 0x80 + 0x100 * place };
            add(parameters, 1, 4, function + u32::from(node), true, false);
            add(parameters, 2, 1, 255, true, false);
            (0..=8).for_each(|part| {
                add(parameters + 0x200, part, if part == 0 { 1 } else { 4 }, 0, true, false)
            });
        }
        let Self { all, forgotten } = self;
        all.retain(|(index, _), _| !forgotten.contains(index));
    }

    /// Returns the value of an object; 0 if missing.
    pub(super) fn value(&self, index: u16, part: u8) -> u32 {
        self.all.get(&(index, part)).map_or(0, |object| object.value)
    }

    /// Sets the value of an object by the drive.
    pub(super) fn show(&mut self, index: u16, value: u32) {
        self.all.entry((index, 0)).and_modify(|object| object.value = value);
    }

    pub(super) fn read(&self, index: u16, part: u8) -> Result<(u8, u32), u32> {
        self.find(index, part).map(|object| (object.bytes, object.value))
    }

    fn find(&self, index: u16, part: u8) -> Result<Object, u32> {
        let is_there = self.all.range((index, 0)..=(index, u8::MAX)).next().is_some();
        self.all.get(&(index, part)).copied().ok_or(if is_there { NO_PART } else { NO_OBJECT })
    }

    pub(super) fn write(&mut self, index: u16, part: u8, bytes: u8, value: u32) -> Result<(), u32> {
        let object = self.find(index, part)?;
        let is_off = |parameters: u16| self.value(parameters, 1) & OFF != 0;
        match index {
            _ if !object.is_writable => return Err(READ_ONLY),
            _ if object.bytes != bytes => return Err(OTHER_LENGTH),
            0x6060 if value != TORQUE_MODE => return Err(OUT_OF_RANGE),
            // An identifier can be changed only while disabled.
            0x1400..=0x15ff | 0x1800..=0x19ff
                if part == 1 && !is_off(index) && value & OFF == 0 && value != object.value =>
            {
                return Err(OUT_OF_RANGE);
            }
            0x1600..=0x17ff | 0x1a00..=0x1bff if !is_off(index - 0x200) => return Err(UNSUPPORTED_ACCESS),
            0x1600..=0x17ff | 0x1a00..=0x1bff if part > 0 => {
                if self.value(index, 0) != 0 {
                    return Err(UNSUPPORTED_ACCESS);
                }
                let [bits, of_part, low, high] = value.to_le_bytes();
                let mapped = self.find(u16::from_le_bytes([low, high]), of_part)?;
                let is_direction = index >= 0x1a00 || mapped.is_writable;
                if !(mapped.is_mappable && is_direction && bits == 8 * mapped.bytes) {
                    return Err(NOT_MAPPABLE);
                }
            }
            0x1600..=0x17ff | 0x1a00..=0x1bff => {
                let bits: u32 = (1..=8)
                    .filter(|part| u32::from(*part) <= value)
                    .map(|part| self.value(index, part) & 0xff)
                    .sum();
                if value > 8 || bits > 64 {
                    return Err(TOO_LONG);
                }
            }
            _ => {}
        }
        if index == 0x6060 {
            self.show(0x6061, value);
        }
        self.all.insert((index, part), Object { value, ..object });
        Ok(())
    }

    /// Indices, subindices and sizes mapped by a process data object.
    fn entries(&self, mapping: u16) -> Vec<(u16, u8, usize)> {
        let parts = (1..=8).take_while(|part| u32::from(*part) <= self.value(mapping, 0));
        let entry = |part| {
            let [bits, of_part, low, high] = self.value(mapping, part).to_le_bytes();
            (u16::from_le_bytes([low, high]), of_part, usize::from(bits / 8))
        };
        parts.map(entry).collect()
    }

    /// Size of a process data object, bytes.
    pub(super) fn length(&self, mapping: u16) -> usize {
        self.entries(mapping).iter().map(|(.., bytes)| bytes).sum()
    }

    /// Returns the data of a transmit PDO.
    pub(super) fn mapped(&self, mapping: u16) -> Vec<u8> {
        let entries = self.entries(mapping).into_iter();
        entries
            .flat_map(|(index, part, bytes)| self.value(index, part).to_le_bytes().into_iter().take(bytes))
            .collect()
    }

    /// Writes the data of a receive PDO to its objects.
    pub(super) fn take(&mut self, mapping: u16, mut data: &[u8]) {
        for (index, part, bytes) in self.entries(mapping) {
            let Some((own, rest)) = data.split_at_checked(bytes) else { return };
            let value = own.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            self.all.entry((index, part)).and_modify(|object| object.value = value);
            data = rest;
        }
    }
}
