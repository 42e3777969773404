//! Node number and the identifiers of its frames.

/// Number of a node on a `CANopen` bus, 1 to 127.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Node(u8);

impl Cia402Node {
    /// Network management (NMT).
    pub const NMT_ID: u16 = 0x000;
    /// Synchronisation.
    pub const SYNC_ID: u16 = 0x080;

    /// Creates a node; `None` outside 1 to 127.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if matches!(number, 1..=127) { Some(Self(number)) } else { None }
    }

    /// Returns the number, 1 to 127.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }

    /// Identifier of its emergencies (EMCY).
    #[must_use]
    pub const fn emergency_id(self) -> u16 {
        self.of(0x080)
    }

    /// Identifier of its transmit PDO `pdo`, 1 to 4.
    #[must_use]
    pub const fn tpdo_id(self, pdo: u8) -> u16 {
        self.of(0x080 + 0x100 * pdo as u16)
    }

    /// Identifier of its receive PDO `pdo`, 1 to 4.
    #[must_use]
    pub const fn rpdo_id(self, pdo: u8) -> u16 {
        self.of(0x100 + 0x100 * pdo as u16)
    }

    /// Identifier of its SDO responses.
    #[must_use]
    pub const fn response_id(self) -> u16 {
        self.of(0x580)
    }

    /// Identifier of SDO requests to it.
    #[must_use]
    pub const fn request_id(self) -> u16 {
        self.of(0x600)
    }

    /// Identifier of its heartbeat.
    #[must_use]
    pub const fn heartbeat_id(self) -> u16 {
        self.of(0x700)
    }

    const fn of(self, function: u16) -> u16 {
        function | self.0 as u16
    }
}
