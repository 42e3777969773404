//! The CRC of all that travels or is kept.

/// AUTOSAR's CRC-32 (polynomial 0xF4ACFB13), Hamming distance 6 up to 256 bytes. One table for all.
pub(crate) static CRC: crc::Crc<u32, Table> = crc::Crc::<u32, Table>::new(&crc::CRC_32_AUTOSAR);

/// A step per byte, or with feature `small-crc` one per bit.
#[cfg(not(feature = "small-crc"))]
pub(crate) type Table = crc::Table<1>;
#[cfg(feature = "small-crc")]
pub(crate) type Table = crc::NoTable;
