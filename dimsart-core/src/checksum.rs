//! The CRC of all that travels or is kept.

/// AUTOSAR's CRC-32 (polynomial 0xF4ACFB13), Hamming distance 6 up to 256 bytes. One table for all.
pub(crate) static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_AUTOSAR);
