//! CRCs of packets and stored data.

/// AUTOSAR CRC-32 (polynomial 0xF4ACFB13): Hamming distance 6 up to 256 bytes. Shared, so that an image has
/// one table.
pub static CRC: crc::Crc<u32, Table> = crc::Crc::<u32, Table>::new(&crc::CRC_32_AUTOSAR);

/// AUTOSAR CRC-8 (polynomial 0x2F): Hamming distance 4 up to 14 bytes, for 8-byte frames.
pub static CRC_8: crc::Crc<u8, Table> = crc::Crc::<u8, Table>::new(&crc::CRC_8_AUTOSAR);

/// Table-driven, one step per byte.
#[cfg(not(target_os = "none"))]
pub type Table = crc::Table<1>;
/// Without a table, one step per bit: saves 1 KiB of flash.
#[cfg(target_os = "none")]
pub type Table = crc::NoTable;
