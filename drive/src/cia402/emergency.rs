//! Emergency messages of a drive (EMCY).

use core::fmt;

/// Emergency with its error code, 0x1000 or above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Emergency(u16);

impl Cia402Emergency {
    /// Converts an error code; `None` below 0x1000 (error reset).
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        (code >= 0x1000).then_some(Self(code))
    }

    /// Returns the error code.
    #[must_use]
    pub fn code(self) -> u16 {
        self.0
    }

    /// Returns the recommended action.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.texts().1
    }

    /// Returns cause and action.
    fn texts(self) -> (&'static str, &'static str) {
        match self.0 {
            0x2120..=0x213f | 0x2230..=0x225f | 0x2320..=0x234f => {
                ("short circuit or earth fault", "check the motor's phases and insulation")
            }
            0x2000..=0x2fff => {
                ("overcurrent", "reduce the torque, check for a blocked joint, check the motor data")
            }
            0x3110..=0x311f | 0x3210..=0x321f | 0x3310..=0x331f => {
                ("overvoltage", "reduce braking, or add a brake resistor")
            }
            0x3120..=0x312f | 0x3220..=0x322f => ("undervoltage", "check supply, fuse and wiring under load"),
            0x3130..=0x313f => ("phase loss", "check the wiring of supply and motor"),
            0x3000..=0x3fff => ("voltage error", "check supply and motor wiring"),
            0x4110..=0x411f | 0x4210..=0x421f | 0x4310..=0x431f => {
                ("overtemperature", "let the drive cool, reduce the load or improve cooling")
            }
            0x4000..=0x4fff => ("temperature error", "check ambient temperature and sensors"),
            0x5000..=0x5fff => ("hardware error", "power-cycle the drive; replace it if the error persists"),
            0x6010..=0x601f => (
                "software reset (watchdog)",
                "update the drive's firmware; report the error to the manufacturer",
            ),
            0x6300..=0x63ff => ("invalid parameter data", "reload the drive's configuration"),
            0x6000..=0x6fff => {
                ("software error", "update the drive's firmware; report the error to the manufacturer")
            }
            0x7110..=0x711f => ("brake chopper error", "check the brake resistor"),
            0x7120..=0x712f => ("motor blocked or faulty", "check joint, motor and wiring"),
            0x7300..=0x73ff => {
                ("motor sensor error", "check the encoder's wiring and supply, or replace the encoder")
            }
            0x7000..=0x7fff => ("additional module error", "see the drive's manual"),
            0x8130..=0x813f => ("controller heartbeat missing", "check the bus, or increase the timeout"),
            0x8120..=0x812f | 0x8140..=0x814f => ("CAN bus errors", "check wiring, termination and bit rate"),
            0x8100..=0x82ff => ("communication error", "make sure no other controller sends to the drive"),
            0x8300..=0x83ff | 0x8500..=0x87ff => {
                ("following error", "check the load and the limits in the drive's configuration")
            }
            0x8000..=0x8fff => ("monitoring error", "see the drive's manual"),
            0x9000..=0x90ff => ("external error", "check the drive's inputs: safe torque off, switches"),
            0xf000..=0xffff => ("additional function error", "see the drive's manual"),
            _ => ("unknown error", "see the drive's manual"),
        }
    }
}

impl fmt::Display for Cia402Emergency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:#06x})", self.texts().0, self.0)
    }
}
