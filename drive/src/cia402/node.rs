//! A node's number, and the identifiers of its frames.

/// Number of a node on a `CANopen` bus, 1 to 127.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cia402Node(u8);

impl Cia402Node {
    /// Network management, of the bus as a whole.
    pub const NMT_ID: u16 = 0x000;
    /// The beat of the bus.
    pub const SYNC_ID: u16 = 0x080;

    /// None for a number that no node has.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if matches!(number, 1..=127) { Some(Self(number)) } else { None }
    }

    /// 1 to 127.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }

    /// An emergency of it.
    #[must_use]
    pub const fn emergency_id(self) -> u16 {
        self.of(0x080)
    }

    /// What it sends in its process data object `pdo`, 1 to 4.
    #[must_use]
    pub const fn tpdo_id(self, pdo: u8) -> u16 {
        self.of(0x080 + 0x100 * pdo as u16)
    }

    /// What it takes in its process data object `pdo`, 1 to 4.
    #[must_use]
    pub const fn rpdo_id(self, pdo: u8) -> u16 {
        self.of(0x100 + 0x100 * pdo as u16)
    }

    /// Its answer about an object.
    #[must_use]
    pub const fn answer_id(self) -> u16 {
        self.of(0x580)
    }

    /// A question to it about an object.
    #[must_use]
    pub const fn question_id(self) -> u16 {
        self.of(0x600)
    }

    /// Its heartbeat.
    #[must_use]
    pub const fn heartbeat_id(self) -> u16 {
        self.of(0x700)
    }

    const fn of(self, function: u16) -> u16 {
        function | self.0 as u16
    }
}
