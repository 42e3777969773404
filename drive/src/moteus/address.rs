//! Addresses of host and drive.

/// Broadcast address; not valid for a single drive.
const BROADCAST: u8 = 0x7f;
const REPLY_REQUESTED: u32 = 0x8000;

/// Addresses of a host and a drive on a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusAddress {
    host: u8,
    drive: u8,
}

impl MoteusAddress {
    /// Creates an address from a host, 0 to 126, and the `id.id` of a drive, 0 to 126. Returns `None` for other numbers
    /// and if both are equal.
    #[must_use]
    pub const fn new(host: u8, drive: u8) -> Option<Self> {
        if host < BROADCAST && drive < BROADCAST && host != drive { Some(Self { host, drive }) } else { None }
    }

    /// Returns the 29-bit arbitration id of a frame to the drive that requests a reply.
    #[must_use]
    pub fn command_id(self) -> u32 {
        REPLY_REQUESTED | u32::from(self.host) << 8 | u32::from(self.drive)
    }

    /// Returns the arbitration id of the drive's reply, standard or extended.
    #[must_use]
    pub fn reply_id(self) -> u32 {
        u32::from(self.drive) << 8 | u32::from(self.host)
    }
}
