//! Tables of jumps.

use crate::image::Image;

/// Targets of a table branch (`TBB`, of halves `TBH`) at an address: its table stands behind it, up to the next
/// instruction or the first target.
pub(crate) fn targets(image: &Image, address: u32, is_half: bool) -> Vec<u32> {
    let start = address.wrapping_add(4);
    let bytes = if is_half { 2 } else { 1 };
    let mut end = image.code.range(start..).next().map_or(start, |(address, _)| *address);
    let mut targets = Vec::new();
    let mut place = start;
    while place + bytes <= end {
        let entry = match image.bytes(place, if is_half { 2 } else { 1 }) {
            Some([entry]) => u32::from(*entry),
            Some([low, high]) => u32::from(u16::from_le_bytes([*low, *high])),
            _ => break,
        };
        let target = start.wrapping_add(2 * entry);
        // What fills the table up to an even length is no entry.
        if image.code.contains_key(&target) {
            end = if target > start { end.min(target) } else { end };
            targets.push(target);
        }
        place += bytes;
    }
    targets
}
