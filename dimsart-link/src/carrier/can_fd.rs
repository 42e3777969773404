//! A content in one CAN FD frame: `length u8 | content | zeros up to a valid CAN FD length`.

use heapless::Vec;

/// Maximum data of a CAN FD frame, bytes.
pub const MAX_DATA_BYTES: usize = 64;
/// Maximum content of a frame, bytes.
pub const MAX_CONTENT_BYTES: usize = MAX_DATA_BYTES - 1;
/// Valid lengths of a CAN FD frame above 8 bytes.
const LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, MAX_DATA_BYTES];

/// Packs a content into a frame's data. `None` if it exceeds [`MAX_CONTENT_BYTES`].
#[must_use]
pub fn pack(content: &[u8]) -> Option<Vec<u8, MAX_DATA_BYTES>> {
    let mut data = Vec::new();
    data.push(u8::try_from(content.len()).ok()?).ok()?;
    data.extend_from_slice(content).ok()?;
    let used = data.len();
    let length = if used <= 8 { used } else { LENGTHS.into_iter().find(|length| *length >= used)? };
    data.resize(length, 0).ok()?;
    Some(data)
}

/// Returns the content of a frame's data. `None` if the data is truncated.
#[must_use]
pub fn unpack(data: &[u8]) -> Option<&[u8]> {
    let (length, rest) = data.split_first()?;
    rest.get(..usize::from(*length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_content_that_fits_comes_out_as_it_went_in() {
        let bytes: std::vec::Vec<u8> = (1..=64).rev().collect();
        for length in 0..=MAX_CONTENT_BYTES {
            let data = pack(&bytes[..length]).unwrap();
            assert_eq!(unpack(&data), Some(&bytes[..length]));
            assert!(
                data.len() <= 8 || LENGTHS.contains(&data.len()),
                "{} bytes is not a CAN FD length",
                data.len()
            );
        }
        assert_eq!(pack(&bytes), None);
    }

    #[test]
    fn a_frame_that_ends_too_early_is_none() {
        assert_eq!(unpack(&[]), None);
        assert_eq!(unpack(&[3, 1, 2]), None);
    }
}
