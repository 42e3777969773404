//! Who sends a frame, and which drive it is for.

/// All drives listen to this one: never the place of a single joint.
const BROADCAST: u8 = 0x7f;
const REPLY_REQUESTED: u32 = 0x8000;

/// A host and a drive on a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MoteusAddress {
    host: u8,
    drive: u8,
}

impl MoteusAddress {
    /// Of a host, 0 to 126, and a drive with the `id.id` of its configuration, 0 to 126; none for others, and for a drive
    /// that has the host's own number.
    #[must_use]
    pub const fn new(host: u8, drive: u8) -> Option<Self> {
        if host < BROADCAST && drive < BROADCAST && host != drive { Some(Self { host, drive }) } else { None }
    }

    /// Arbitration id of a frame to the drive, which is to reply. It is an extended one, of 29 bits.
    #[must_use]
    pub fn command_id(self) -> u32 {
        REPLY_REQUESTED | u32::from(self.host) << 8 | u32::from(self.drive)
    }

    /// Arbitration id of the drive's reply, standard or extended.
    #[must_use]
    pub fn reply_id(self) -> u32 {
        u32::from(self.drive) << 8 | u32::from(self.host)
    }
}
