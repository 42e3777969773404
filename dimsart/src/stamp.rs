//! Reads and writes the stamp of a firmware image; [`dimsart_core::stamp`] defines its layout.

use std::fs;
use std::io;
use std::mem::offset_of;
use std::ops::Range;
use std::path::{Path, PathBuf};

use dimsart_core::stamp::{MAGIC, MAX_TEXT_BYTES, STAMP_SCHEME_BYTES, Stamp, Text, VERSION, as_str, text};
use dimsart_core::{Cost, KindId};
use hil_sim::untrusted_text::escape_line;
use object::{Object, ObjectSegment, ObjectSymbol};

/// Symbol of the stamp.
const SYMBOL: &str = "dimsart_stamp";
/// Bytes of a line of costs.
const LINE_BYTES: usize = size_of::<Cost>();

type Layout = Stamp<0, 0>;

/// An image with its stamp.
#[derive(Debug, Clone)]
pub struct StampedImage {
    bytes: Vec<u8>,
    /// Range of the stamp in the file.
    at: Range<usize>,
}

/// Errors of stamps.
#[derive(Debug, thiserror::Error)]
pub enum StampError {
    /// The file cannot be read or written.
    #[error("cannot read or write image {}: {source}; build an image with `cargo board BOARD`", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// System error.
        source: io::Error,
    },
    /// The stamp is missing or has another layout.
    #[error("{} contains no stamp of this version: rebuild the image from the sources of this command", path.display())]
    NoStamp {
        /// The file.
        path: PathBuf,
    },
    /// The stamp is too small.
    #[error(
        "the image has room for {room} {what}, {wanted} needed: rebuild the image from the sources of this command"
    )]
    BufferTooSmall {
        /// Kind of data.
        what: &'static str,
        /// Capacity.
        room: usize,
        /// Required size.
        wanted: usize,
    },
    /// The image has other modules than this command.
    #[error("image and command differ in modules or data types: rebuild both from the same sources")]
    IncompatibleImage,
}

impl StampedImage {
    /// Reads an image.
    ///
    /// # Errors
    /// [`StampError`] if the file cannot be read or has no stamp.
    pub fn read(path: &Path) -> Result<Self, StampError> {
        let bytes = fs::read(path).map_err(|source| StampError::File { path: path.to_owned(), source })?;
        let no_stamp = || StampError::NoStamp { path: path.to_owned() };
        let at = place(&bytes).ok_or_else(no_stamp)?;
        let image = Self { bytes, at };
        let is_known = image.field(offset_of!(Layout, magic)) == Some(MAGIC)
            && image.field(offset_of!(Layout, version)) == Some(VERSION.to_le_bytes());
        if is_known { Ok(image) } else { Err(no_stamp()) }
    }

    /// Writes the image to a file.
    ///
    /// # Errors
    /// [`StampError::File`].
    pub fn write(&self, path: &Path) -> Result<(), StampError> {
        fs::write(path, &self.bytes).map_err(|source| StampError::File { path: path.to_owned(), source })
    }

    /// Returns the image without its stamp: the input of the costs.
    pub fn without_stamp(&self) -> [&[u8]; 2] {
        [0..self.at.start, self.at.end..self.bytes.len()]
            .map(|range| self.bytes.get(range).unwrap_or_default())
    }

    /// Returns the side of its scheme.
    #[must_use]
    pub fn side(&self) -> String {
        self.text(offset_of!(Layout, side))
    }

    /// Returns the memory of its costs; none if unstamped.
    #[must_use]
    pub fn memory(&self) -> Option<String> {
        Some(self.text(offset_of!(Layout, memory))).filter(|memory| !memory.is_empty())
    }

    /// Returns the name of its scheme.
    #[must_use]
    pub fn scheme_name(&self) -> String {
        self.text(offset_of!(Layout, scheme_name))
    }

    /// Returns the version of its compiler.
    #[must_use]
    pub fn compiler(&self) -> String {
        self.text(offset_of!(Layout, compiler))
    }

    /// Returns the limit of a tick, cycles; 0: no limit.
    #[must_use]
    pub fn limit_cycles(&self) -> u32 {
        self.number(offset_of!(Layout, limit_cycles))
    }

    /// Returns its encoded scheme.
    #[must_use]
    pub fn scheme(&self) -> &[u8] {
        let length = usize::from(self.half(offset_of!(Layout, scheme_bytes)));
        let start = offset_of!(Layout, scheme);
        let end = start + length.min(STAMP_SCHEME_BYTES);
        self.stamp().get(start..end).unwrap_or_default()
    }

    /// Returns the costs of a tick and of each module kind; none if unstamped.
    #[must_use]
    pub fn costs(&self) -> Option<Vec<Cost>> {
        self.memory()?;
        let costs = self.stamp().get(offset_of!(Layout, costs)..self.start_of_kinds())?;
        let (lines, _) = costs.as_chunks::<LINE_BYTES>();
        let cost = |[a, b, c, d]: &[u8; LINE_BYTES]| {
            Cost::new(u16::from_le_bytes([*a, *b]), u16::from_le_bytes([*c, *d]))
        };
        Some(lines.iter().map(cost).collect())
    }

    /// Returns the module kinds of the image.
    #[must_use]
    pub fn kinds(&self) -> Vec<KindId> {
        let (ids, _) = self.stamp().get(self.start_of_kinds()..).unwrap_or_default().as_chunks();
        let count = usize::from(self.half(offset_of!(Layout, kind_count)));
        ids.iter().take(count).map(|bits| KindId::from_bits(u16::from_le_bytes(*bits))).collect()
    }

    fn start_of_kinds(&self) -> usize {
        offset_of!(Layout, costs) + LINE_BYTES * usize::from(self.half(offset_of!(Layout, lines)))
    }

    /// Sets the costs, their memory and the limit of a tick.
    ///
    /// # Errors
    /// [`StampError::BufferTooSmall`]; nothing changes.
    pub fn set_costs(&mut self, lines: &[Cost], memory: &str, limit_cycles: u32) -> Result<(), StampError> {
        let room = usize::from(self.half(offset_of!(Layout, lines)));
        if lines.len() != room {
            return Err(StampError::BufferTooSmall { what: "costs", room, wanted: lines.len() });
        }
        let bytes: Vec<u8> = lines
            .iter()
            .map(|cost| cost.coefficients())
            .flat_map(|(offset, per_dof)| [offset.to_le_bytes(), per_dof.to_le_bytes()].concat())
            .collect();
        self.put(offset_of!(Layout, memory), &fitting(memory)?);
        self.put(offset_of!(Layout, costs), &bytes);
        self.put(offset_of!(Layout, limit_cycles), &limit_cycles.to_le_bytes());
        Ok(())
    }

    /// Sets the saved scheme of one side; truncates its name.
    ///
    /// # Errors
    /// [`StampError::IncompatibleImage`] or [`StampError::BufferTooSmall`]; nothing changes.
    pub fn set_scheme(&mut self, name: &str, side: &str, scheme: &[u8]) -> Result<(), StampError> {
        let fingerprint = dimsart_link::saved_scheme::saved_fingerprint;
        if fingerprint(self.scheme()) != fingerprint(scheme) {
            return Err(StampError::IncompatibleImage);
        }
        let no_room = StampError::BufferTooSmall {
            what: "bytes of a scheme",
            room: STAMP_SCHEME_BYTES,
            wanted: scheme.len(),
        };
        let length = u16::try_from(scheme.len()).ok().filter(|_| scheme.len() <= STAMP_SCHEME_BYTES);
        let length = length.ok_or(no_room)?;
        self.put(offset_of!(Layout, side), &fitting(side)?);
        let name = name.char_indices().take_while(|(at, next)| at + next.len_utf8() <= MAX_TEXT_BYTES);
        self.put(offset_of!(Layout, scheme_name), &fitting(&name.map(|(_, next)| next).collect::<String>())?);
        self.put(offset_of!(Layout, scheme_bytes), &length.to_le_bytes());
        self.put(offset_of!(Layout, scheme), &[0; STAMP_SCHEME_BYTES]);
        self.put(offset_of!(Layout, scheme), scheme);
        Ok(())
    }

    fn stamp(&self) -> &[u8] {
        self.bytes.get(self.at.clone()).unwrap_or_default()
    }

    fn field<const BYTES: usize>(&self, at: usize) -> Option<[u8; BYTES]> {
        self.stamp().get(at..)?.first_chunk().copied()
    }

    fn number(&self, at: usize) -> u32 {
        self.field(at).map_or(0, u32::from_le_bytes)
    }

    fn half(&self, at: usize) -> u16 {
        self.field(at).map_or(0, u16::from_le_bytes)
    }

    fn text(&self, at: usize) -> String {
        self.field::<MAX_TEXT_BYTES>(at).map_or_else(String::new, |bytes| escape_line(as_str(&bytes)))
    }

    fn put(&mut self, at: usize, bytes: &[u8]) {
        let start = self.at.start + at;
        if let Some(place) = self.bytes.get_mut(start..start + bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }
}

fn fitting(words: &str) -> Result<Text, StampError> {
    let wanted = words.len();
    let no_room = StampError::BufferTooSmall { what: "bytes of a name", room: MAX_TEXT_BYTES, wanted };
    (wanted <= MAX_TEXT_BYTES).then_some(text(words)).ok_or(no_room)
}

/// Finds the stamp in the file, by its symbol and size.
fn place(bytes: &[u8]) -> Option<Range<usize>> {
    let elf = object::read::elf::ElfFile32::<object::Endianness>::parse(bytes).ok()?;
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(SYMBOL))?;
    let (address, length) = (symbol.address(), usize::try_from(symbol.size()).ok()?);
    let start = elf.segments().find_map(|segment| {
        let (from, in_file) = segment.file_range();
        let beyond = address.checked_sub(segment.address()).filter(|beyond| *beyond < in_file)?;
        usize::try_from(from + beyond).ok()
    })?;
    let count = |at: usize| Some(usize::from(u16::from_le_bytes(*bytes.get(start + at..)?.first_chunk()?)));
    let (lines, kinds) = (count(offset_of!(Layout, lines))?, count(offset_of!(Layout, kind_count))?);
    // The linker pads it to a whole word.
    let used = offset_of!(Layout, costs) + LINE_BYTES * lines + size_of::<KindId>() * kinds;
    let is_whole = length == used.next_multiple_of(4);
    (is_whole && start + length <= bytes.len()).then_some(start..start + length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_has_no_stamp() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        assert!(matches!(StampedImage::read(&path), Err(StampError::File { .. })));
        fs::write(&path, "DIMSTAMP, but no ELF").unwrap();
        let message = StampedImage::read(&path).unwrap_err().to_string();
        assert!(message.contains("contains no stamp of this version"), "{message}");
    }

    #[test]
    fn a_text_fits_up_to_its_last_byte() {
        assert_eq!(as_str(&fitting("sixteen letters!").unwrap()), "sixteen letters!");
        assert!(matches!(fitting("seventeen letters"), Err(StampError::BufferTooSmall { wanted: 17, .. })));
    }
}
