//! SDO abort codes: why a drive refused to read or write an object.

use core::fmt;

/// SDO abort code of a refused object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Abort(u8);

/// Codes of CiA 301 with their meaning; the first also stands for unknown codes.
const CODES: [(u32, &str); 22] = [
    (0x0800_0000, "general error"),
    (0x0504_0000, "SDO timeout"),
    (0x0504_0001, "unknown SDO command"),
    (0x0504_0005, "out of memory"),
    (0x0601_0000, "unsupported access to the object"),
    (0x0601_0001, "object is write-only"),
    (0x0601_0002, "object is read-only"),
    (0x0602_0000, "object does not exist"),
    (0x0604_0041, "object cannot be mapped to a PDO"),
    (0x0604_0042, "PDO length exceeded"),
    (0x0604_0043, "incompatible parameters"),
    (0x0604_0047, "internal incompatibility"),
    (0x0606_0000, "hardware error"),
    (0x0607_0010, "wrong data length"),
    (0x0607_0012, "data too long"),
    (0x0607_0013, "data too short"),
    (0x0609_0011, "sub-index does not exist"),
    (0x0609_0030, "value out of range"),
    (0x0609_0031, "value too high"),
    (0x0609_0032, "value too low"),
    (0x0800_0021, "drive under local control"),
    (0x0800_0022, "not possible in the present state"),
];

impl Cia402Abort {
    /// Looks up an abort code; unknown codes become 0x08000000.
    #[must_use]
    pub fn from_code(code: u32) -> Self {
        let known = (0_u8..).zip(CODES).find(|(_, (of_known, _))| *of_known == code);
        Self(known.map_or(0, |(place, _)| place))
    }

    /// Returns the abort code; 0x08000000 for an unknown one.
    #[must_use]
    pub fn code(self) -> u32 {
        self.entry().0
    }

    /// Returns its index in the list.
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
