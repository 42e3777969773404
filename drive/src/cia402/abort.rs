//! Why a drive refused to set or show an object.

use core::fmt;

/// A drive's refusal of one object, by its SDO abort code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Abort(u8);

/// Codes of CiA 301, and what they mean; the first stands for those that it has not.
const CODES: [(u32, &str); 22] = [
    (0x0800_0000, "for a reason of its own"),
    (0x0504_0000, "its answer took too long"),
    (0x0504_0001, "it does not know the request"),
    (0x0504_0005, "its memory is full"),
    (0x0601_0000, "the object cannot be accessed so, or not now"),
    (0x0601_0001, "the object can only be written"),
    (0x0601_0002, "the object can only be read"),
    (0x0602_0000, "it has no such object"),
    (0x0604_0041, "the object cannot be part of a process data object"),
    (0x0604_0042, "a process data object would become too long"),
    (0x0604_0043, "its parameters do not go together"),
    (0x0604_0047, "it is incompatible in itself"),
    (0x0606_0000, "its hardware failed"),
    (0x0607_0010, "the object has another length"),
    (0x0607_0012, "the object is shorter"),
    (0x0607_0013, "the object is longer"),
    (0x0609_0011, "the object has no such part"),
    (0x0609_0030, "the value is out of its range"),
    (0x0609_0031, "the value is too high"),
    (0x0609_0032, "the value is too low"),
    (0x0800_0021, "it is under local control"),
    (0x0800_0022, "not in its present state"),
];

impl Cia402Abort {
    /// What a drive answered.
    #[must_use]
    pub fn from_code(code: u32) -> Self {
        let known = (0_u8..).zip(CODES).find(|(_, (of_known, _))| *of_known == code);
        Self(known.map_or(0, |(place, _)| place))
    }

    /// As the drive has it; of those that are unknown here 0x08000000.
    #[must_use]
    pub fn code(self) -> u32 {
        self.entry().0
    }

    /// Its place in the list, from 0.
    pub(super) fn place(self) -> u8 {
        self.0
    }

    pub(super) fn from_place(place: u32) -> Option<Self> {
        u8::try_from(place).ok().filter(|place| usize::from(*place) < CODES.len()).map(Self)
    }

    fn entry(self) -> (u32, &'static str) {
        CODES.get(usize::from(self.0)).copied().unwrap_or_default()
    }
}

impl fmt::Display for Cia402Abort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (code, text) = self.entry();
        write!(f, "{text} ({code:#010x})")
    }
}
