//! The CRCs of what travels or is kept.

/// AUTOSAR's CRC-32 (polynomial 0xF4ACFB13), Hamming distance 6 up to 256 bytes. One table for all, also for who keeps
/// more than the core does.
pub static CRC: crc::Crc<u32, Table> = crc::Crc::<u32, Table>::new(&crc::CRC_32_AUTOSAR);

/// AUTOSAR's CRC-8 (polynomial 0x2F), Hamming distance 4 up to 14 bytes: for frames of 8.
pub(crate) static CRC_8: crc::Crc<u8, Table> = crc::Crc::<u8, Table>::new(&crc::CRC_8_AUTOSAR);

/// A step per byte; contents with tags go through it three times as often.
pub type Table = crc::Table<1>;
