//! Messages in CDR, little endian, behind the mark that says so: how ROS 2 and MCAP have them.

use byteorder::LittleEndian;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What a message in little endian begins with.
pub(crate) const MARK: [u8; 4] = [0, 1, 0, 0];

/// A message; none of what CDR does not have, such as a map.
pub(crate) fn encode(message: &impl Serialize) -> Option<Vec<u8>> {
    let body = cdr_encoding::to_vec::<_, LittleEndian>(message).ok()?;
    Some([MARK.as_slice(), &body].concat())
}

/// Reads one; none for what is another one.
pub(crate) fn decode<T: DeserializeOwned>(message: &[u8]) -> Option<T> {
    let body = message.strip_prefix(&MARK)?;
    Some(cdr_encoding::from_bytes::<T, LittleEndian>(body).ok()?.0)
}
