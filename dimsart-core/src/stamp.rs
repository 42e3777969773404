//! Stamp: data written into a linked image, the scheme and the cost of its modules.
//!
//! An image reserves a [`Stamp`] at the symbol `dimsart_stamp`. After the build it contains the board's own
//! scheme as master and no costs. `dimsart stamp` computes the costs from the image and writes them, and
//! optionally another scheme, into the file.
//!
//! Little endian, in this order:
//!
//! ```text
//! byte  bytes
//!    0      8  "DIMSTAMP"
//!    8      2  version of this layout, 2
//!   10      2  cost lines: the tick, each module kind, each instruction
//!   12      4  most cycles of a tick; 0: no limit
//!   16     16  side of the scheme, as text
//!   32     16  memory that the costs are for, as text, such as `0ws`; empty: the image is not stamped
//!   48     16  compiler of the image, as text
//!   64     16  name of the scheme, as text
//!   80      2  bytes of the scheme
//!   82      2  number of module kinds
//!   84    512  the scheme, as it is saved
//!  596  4 each  lines of costs: cycles u16, cycles for each degree of freedom u16; both 0: not known
//!       2 each  ids of the image's module kinds, in the order of their lines
//! ```
//! Text ends at the first zero byte.

use core::num::NonZeroU32;

use crate::module::{Cost, Costs, KindId};

/// First bytes of a stamp.
pub const MAGIC: [u8; 8] = *b"DIMSTAMP";
/// Version of the layout.
pub const VERSION: u16 = 2;
/// Suffix of the name of an unstamped image, in a board's description.
pub const UNSTAMPED_SUFFIX: &str = " unstamped";
/// Maximum bytes of a text.
pub const MAX_TEXT_BYTES: usize = 16;

/// Maximum bytes of the scheme.
pub const STAMP_SCHEME_BYTES: usize = 512;

/// Text that ends at the first zero byte.
pub type Text = [u8; MAX_TEXT_BYTES];

/// Data that are written into an image after linking, with room for `LINES` cost lines and `KINDS` module
/// kinds.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct Stamp<const LINES: usize, const KINDS: usize> {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// [`VERSION`].
    pub version: u16,
    /// `LINES`.
    pub lines: u16,
    /// Maximum cycles of a tick; 0: no limit.
    pub limit_cycles: u32,
    /// Side of the scheme.
    pub side: Text,
    /// Memory for which the costs are valid; empty if they are unknown.
    pub memory: Text,
    /// Compiler of the image.
    pub compiler: Text,
    /// Name of the scheme.
    pub scheme_name: Text,
    /// Used bytes of the scheme.
    pub scheme_bytes: u16,
    /// `KINDS`.
    pub kind_count: u16,
    /// A saved scheme.
    pub scheme: [u8; STAMP_SCHEME_BYTES],
    /// Cost of a tick, each module kind and each instruction.
    pub costs: [Cost; LINES],
    /// Module kinds of the image.
    pub kinds: [KindId; KINDS],
}

const _: () = {
    assert!(core::mem::offset_of!(Stamp<1, 0>, scheme) == 84, "offset in the layout");
    assert!(core::mem::offset_of!(Stamp<1, 0>, costs) == 596 && size_of::<Stamp<3, 2>>() == 612);
};

impl<const LINES: usize, const KINDS: usize> Stamp<LINES, KINDS> {
    /// Creates the stamp of a linked image: a scheme of one side, no costs. Data that do not fit are omitted.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "kinds are counted in a byte, schemes are short")]
    pub const fn unstamped(side: &str, scheme: &[u8], kinds: [KindId; KINDS]) -> Self {
        let (scheme, scheme_bytes) = filled(scheme);
        Self {
            magic: MAGIC,
            version: VERSION,
            lines: LINES as u16,
            limit_cycles: 0,
            side: text(side),
            memory: text(""),
            compiler: text(""),
            scheme_name: text(""),
            scheme_bytes: scheme_bytes as u16,
            kind_count: KINDS as u16,
            scheme,
            costs: [Cost::UNKNOWN; LINES],
            kinds,
        }
    }

    /// Returns the bytes of the scheme.
    #[must_use]
    pub fn scheme(&self) -> &[u8] {
        self.scheme.get(..usize::from(self.scheme_bytes)).unwrap_or_default()
    }

    /// Returns the side of the scheme.
    #[must_use]
    pub fn side(&self) -> &str {
        as_str(&self.side)
    }

    /// Returns the costs; none in an unstamped image.
    #[must_use]
    pub fn costs(&'static self) -> Option<Costs> {
        (self.memory.first() != Some(&0)).then_some(Costs::new(&self.costs, &self.kinds))
    }

    /// Returns the maximum cycles of a tick.
    #[must_use]
    pub fn limit_cycles(&self) -> Option<NonZeroU32> {
        NonZeroU32::new(self.limit_cycles)
    }
}

/// Converts to the text format of a stamp; empty if too long.
#[must_use]
pub const fn text(words: &str) -> Text {
    filled(words.as_bytes()).0
}

/// Returns a text up to its first zero byte.
#[must_use]
pub fn as_str(text: &Text) -> &str {
    let used = text.split(|byte| *byte == 0).next().unwrap_or_default();
    core::str::from_utf8(used).unwrap_or_default()
}

/// Pads bytes with zeros and returns their number; empty if they do not fit.
const fn filled<const BYTES: usize>(mut from: &[u8]) -> ([u8; BYTES], usize) {
    let mut bytes = [0; BYTES];
    let count = from.len();
    if count > BYTES {
        return (bytes, 0);
    }
    let mut rest: &mut [u8] = &mut bytes;
    while let ([first, others @ ..], [place, places @ ..]) = (from, rest) {
        *place = *first;
        (from, rest) = (others, places);
    }
    (bytes, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_linked_has_a_scheme_and_no_costs() {
        static STAMP: Stamp<3, 2> =
            Stamp::unstamped("master", &[1, 2, 3], [KindId::from_name("PD"), KindId::from_name("P")]);
        assert_eq!((STAMP.side(), STAMP.scheme(), STAMP.lines), ("master", [1, 2, 3].as_slice(), 3));
        assert_eq!((STAMP.costs(), STAMP.limit_cycles()), (None, None));
    }

    #[test]
    fn a_stamp_has_costs_for_a_memory_and_a_limit() {
        const LINES: [Cost; 2] = [Cost::new(500, 60), Cost::new(100, 10)];
        static STAMP: Stamp<2, 1> = Stamp {
            memory: text("flash"),
            limit_cycles: 84_000,
            costs: LINES,
            ..Stamp::unstamped("slave", &[], [KindId::from_name("PD")])
        };
        assert_eq!(STAMP.costs(), Some(Costs::new(&LINES, &STAMP.kinds)));
        assert_eq!(STAMP.limit_cycles().map(NonZeroU32::get), Some(84_000));
    }

    #[test]
    fn a_length_beyond_the_room_and_text_that_is_none_are_nothing() {
        let stamp = Stamp::<1, 0> {
            scheme_bytes: 513,
            side: [0xFF; MAX_TEXT_BYTES],
            ..Stamp::unstamped("", &[1], [])
        };
        assert_eq!((stamp.scheme(), stamp.side()), ([].as_slice(), ""));
        assert_eq!(Stamp::<1, 0>::unstamped("a side of too many letters", &[1; 600], []).scheme(), []);
        assert_eq!(as_str(&text("sixteen letters!")), "sixteen letters!");
    }
}
