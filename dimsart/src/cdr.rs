//! Messages in CDR, little endian, with their encapsulation header, as in ROS 2 and MCAP.

use byteorder::LittleEndian;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Encapsulation header of little-endian CDR.
pub(crate) const MARK: [u8; 4] = [0, 1, 0, 0];

/// Encodes a message; none for types that CDR lacks, such as maps.
pub(crate) fn encode(message: &impl Serialize) -> Option<Vec<u8>> {
    let body = cdr_encoding::to_vec::<_, LittleEndian>(message).ok()?;
    Some([MARK.as_slice(), &body].concat())
}

/// Decodes a message; none if it has another type.
pub(crate) fn decode<T: DeserializeOwned>(message: &[u8]) -> Option<T> {
    let body = message.strip_prefix(&MARK)?;
    Some(cdr_encoding::from_bytes::<T, LittleEndian>(body).ok()?.0)
}
