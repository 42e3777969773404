//! What a drive sends when something goes wrong.

use core::fmt;

/// An emergency by its code, 0x1000 and more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Emergency(u16);

impl Cia402Emergency {
    /// Of a drive's code; none for one that says that all is well again.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        (code >= 0x1000).then_some(Self(code))
    }

    /// As the drive has it.
    #[must_use]
    pub fn code(self) -> u16 {
        self.0
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.texts().1
    }

    /// What it is, and what to do.
    fn texts(self) -> (&'static str, &'static str) {
        match self.0 {
            0x2120..=0x213f | 0x2230..=0x225f | 0x2320..=0x234f => {
                ("short circuit, or current to earth", "look at the motor's phases and their insulation")
            }
            0x2000..=0x2fff => {
                ("too much current", "ask for less, look for a blocked joint, check the motor's data")
            }
            0x3110..=0x311f | 0x3210..=0x321f | 0x3310..=0x331f => {
                ("the supply is too high", "brake less, or add a brake resistor")
            }
            0x3120..=0x312f | 0x3220..=0x322f => {
                ("the supply is too low", "look at supply, fuse and wires under load")
            }
            0x3130..=0x313f => ("a phase is missing", "look at the wires of supply and motor"),
            0x3000..=0x3fff => ("its voltage is wrong", "look at supply and motor wires"),
            0x4110..=0x411f | 0x4210..=0x421f | 0x4310..=0x431f => {
                ("it is too hot", "let it cool, command less, or cool it better")
            }
            0x4000..=0x4fff => ("its temperature is wrong", "look at its surroundings and its sensors"),
            0x5000..=0x5fff => ("its hardware failed", "switch it off and on; else replace it"),
            0x6010..=0x601f => ("its software was reset", "update its firmware, and tell its maker"),
            0x6300..=0x63ff => ("its data are wrong", "load its configuration again"),
            0x6000..=0x6fff => ("its software failed", "update its firmware, and tell its maker"),
            0x7110..=0x711f => ("its brake chopper failed", "look at the brake resistor"),
            0x7120..=0x712f => {
                ("the motor is blocked or fails", "look at the joint, the motor and their wires")
            }
            0x7300..=0x73ff => ("a sensor of the motor failed", "look at the encoder, its wires and supply"),
            0x7000..=0x7fff => ("something added to it failed", "look it up in the drive's manual"),
            0x8130..=0x813f => {
                ("it missed heartbeats of the controller", "see why none came: the bus, or a longer timeout")
            }
            0x8120..=0x812f | 0x8140..=0x814f => {
                ("the bus has many errors", "look at its wires, termination and bit rate")
            }
            0x8100..=0x82ff => ("what came over the bus was wrong", "let nobody else send to it"),
            0x8300..=0x83ff | 0x8500..=0x87ff => {
                ("it could not follow", "look at load and limits in its configuration")
            }
            0x8000..=0x8fff => ("its supervision has struck", "look it up in the drive's manual"),
            0x9000..=0x90ff => {
                ("an outside signal says so", "look at its inputs: a safe torque off, a switch")
            }
            0xf000..=0xffff => ("a function added to it failed", "look it up in the drive's manual"),
            _ => ("an error that has no name here", "look it up in the drive's manual"),
        }
    }
}

impl fmt::Display for Cia402Emergency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({:#06x})", self.texts().0, self.0)
    }
}
