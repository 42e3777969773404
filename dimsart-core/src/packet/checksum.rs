//! The CRCs of what travels or is kept.

/// AUTOSAR's CRC-32 (polynomial 0xF4ACFB13), Hamming distance 6 up to 256 bytes. Public, so that an image has its table once.
pub static CRC: crc::Crc<u32, Table> = crc::Crc::<u32, Table>::new(&crc::CRC_32_AUTOSAR);

/// AUTOSAR's CRC-8 (polynomial 0x2F), Hamming distance 4 up to 14 bytes: for frames of 8.
pub static CRC_8: crc::Crc<u8, Table> = crc::Crc::<u8, Table>::new(&crc::CRC_8_AUTOSAR);

/// One step per byte.
#[cfg(not(target_os = "none"))]
pub type Table = crc::Table<1>;
/// One step per bit: a table takes 1 KiB of flash.
#[cfg(target_os = "none")]
pub type Table = crc::NoTable;
