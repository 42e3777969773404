//! Encodes rows of signals, and keeps the last rows for clients that missed some.
//!
//! A message is a sequence of blocks, little endian: number of the layout `u32`, rows `u32`, values of a row `u32`;
//! then each row: its tick `u32` and its values `f64`, which represent every word of a Data Base exactly.

use std::collections::VecDeque;

use crate::page::news::Rows;

/// Rows kept per station: a minute at 1 kHz.
const MAX_ROWS: usize = 60_000;

/// Rows of one layout as bytes.
#[derive(Debug)]
struct Block {
    layout: u32,
    first_tick: u32,
    last_tick: u32,
    rows: usize,
    bytes: Vec<u8>,
}

/// The last rows of a station, oldest first.
#[derive(Debug, Default)]
pub(super) struct Kept {
    blocks: VecDeque<Block>,
    rows: usize,
}

/// A row: its layout and its tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) layout: u32,
    pub(super) tick: u32,
}

impl Block {
    fn has(&self, place: Place) -> bool {
        let behind = |tick: u32| tick.wrapping_sub(self.first_tick);
        place.layout == self.layout && behind(place.tick) <= behind(self.last_tick)
    }
}

impl Kept {
    /// Adds rows and returns them as a message. None if `rows` is empty or too long for a message.
    pub(super) fn add(&mut self, rows: &Rows) -> Option<Vec<u8>> {
        let (first, last) = (rows.rows.first()?, rows.rows.last()?);
        let bytes = block(rows)?;
        let (layout, count) = (rows.layout, rows.rows.len());
        let block =
            Block { layout, first_tick: first.tick, last_tick: last.tick, rows: count, bytes: bytes.clone() };
        self.rows += count;
        self.blocks.push_back(block);
        while self.rows > MAX_ROWS {
            let Some(oldest) = self.blocks.pop_front() else { break };
            self.rows -= oldest.rows;
        }
        Some(bytes)
    }

    /// Returns the rows after a row, perhaps with some before it; all kept rows if the row is not kept.
    pub(super) fn after(&self, place: Option<Place>) -> Vec<u8> {
        let from = place.and_then(|place| self.blocks.iter().rposition(|block| block.has(place)));
        self.blocks.iter().skip(from.unwrap_or_default()).flat_map(|block| &block.bytes).copied().collect()
    }
}

fn block(rows: &Rows) -> Option<Vec<u8>> {
    let width = rows.rows.first()?.values.len();
    let mut bytes = Vec::with_capacity(12 + rows.rows.len() * (4 + 8 * width));
    for number in [rows.layout, u32::try_from(rows.rows.len()).ok()?, u32::try_from(width).ok()?] {
        bytes.extend(number.to_le_bytes());
    }
    for row in &rows.rows {
        bytes.extend(row.tick.to_le_bytes());
        row.values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connect::SubscriptionRow;

    fn rows(layout: u32, ticks: impl IntoIterator<Item = u32>) -> Rows {
        let rows = ticks.into_iter().map(|tick| SubscriptionRow { tick, values: vec![0.5, -1.0] }).collect();
        Rows { station: 0, layout, signals: [].into(), first: 0, lost: 0, rows }
    }

    /// Layout and tick of every row of a message.
    fn places(mut bytes: &[u8]) -> Vec<(u32, u32)> {
        let mut places = Vec::new();
        while !bytes.is_empty() {
            let [layout, rows, width] =
                [0, 4, 8].map(|at| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
            bytes = &bytes[12..];
            for _ in 0..rows {
                places.push((layout, u32::from_le_bytes(bytes[..4].try_into().unwrap())));
                bytes = &bytes[4 + 8 * width as usize..];
            }
        }
        places
    }

    #[test]
    fn a_message_is_its_layout_its_counts_its_ticks_and_its_values() {
        let bytes = Kept::default().add(&rows(3, [7])).unwrap();
        let expected: Vec<u8> = [3_u32, 1, 2, 7]
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .chain([0.5_f64, -1.0].into_iter().flat_map(f64::to_le_bytes))
            .collect();
        assert_eq!(bytes, expected);
        assert_eq!(Kept::default().add(&rows(3, [])), None);
    }

    #[test]
    fn who_says_what_it_has_gets_what_came_after() {
        let mut kept = Kept::default();
        for (layout, first) in [(1, u32::MAX - 1), (1, 2), (2, 0), (2, 4)] {
            kept.add(&rows(layout, (0..4).map(|tick| first.wrapping_add(tick)))).unwrap();
        }
        let after = |layout, tick| places(&kept.after(Some(Place { layout, tick })));
        assert_eq!(after(1, 0)[0], (1, u32::MAX - 1), "the block that has it, over the wrap of ticks");
        assert_eq!(after(1, 3)[0], (1, 2));
        assert_eq!(after(2, 5), [(2, 4), (2, 5), (2, 6), (2, 7)]);
        assert_eq!(after(2, 99).len(), 16, "all that there is, for a row that is not kept");
        assert_eq!(places(&kept.after(None)).len(), 16);
    }

    #[test]
    fn no_more_is_kept_than_there_is_room_for() {
        let mut kept = Kept::default();
        for first in (0..2 * MAX_ROWS).step_by(1000) {
            let first = u32::try_from(first).unwrap();
            kept.add(&rows(1, first..first + 1000)).unwrap();
        }
        let places = places(&kept.after(None));
        assert_eq!(places.len(), MAX_ROWS);
        assert_eq!(places[0], (1, u32::try_from(MAX_ROWS).unwrap()));
    }
}
