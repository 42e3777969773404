//! Items in flash; each update is atomic with respect to power loss.
//!
//! ```text
//! page    sequence u32 | CRC-32 u32 | item | item | ...      the page with the highest sequence is the current one
//! item    key u8 | 0 u8 | length u16 | CRC-32 u32 | its bytes, padded to a whole word
//! ```
//! A new item is appended; the last valid item of each key counts. If it does not fit or the page is damaged,
//! the next page is erased and receives the items, then its sequence number. A power loss before that leaves
//! the current page unchanged. (`sequential-storage` erases the page filled last if the erasure of the
//! previous one was interrupted, and uses its damaged remainder.)
//!
//! [`Items::store`] erases at most one page. [`Items::open`], [`Items::fetch`] and [`Items::append`] erase
//! none, and a start of the board needs only these: erasing a page takes 22 ms, longer than the watchdog
//! timeout.
//!
//! A damaged item is skipped up to the next valid one. It may have been the newest of any key, so the items
//! before it are [in doubt](Items::may_be_outdated).
//!
//! A write is complete when it is [read back](crate::read_back).

use core::ops::Range;

use dimsart_core::checksum::CRC;
use embedded_storage_async::nor_flash::NorFlash;

use crate::read_back::{ERASED, ReadBack, StorageError};

/// Number of keys.
const KEYS: usize = 4;
/// A multiple of the word size of every supported flash.
const WORD_BYTES: usize = 8;
/// Length of the header of a page or item.
const HEADER_BYTES: u32 = 8;
const _: () = assert!(HEADER_BYTES as usize == WORD_BYTES);
/// An unwritten header.
const BLANK: ([u8; 4], u32) = ([ERASED; 4], u32::MAX);
/// Bytes read at a time.
const BLOCK_BYTES: usize = 32;

/// Items in a range of flash.
#[derive(Debug)]
pub(crate) struct Items<F> {
    flash: ReadBack<F>,
    range: Range<u32>,
    current: Option<Page>,
}

/// The current page.
#[derive(Debug, Clone, Copy)]
struct Page {
    start: u32,
    sequence: u32,
    /// Offset of the next item; the page's end if it is full.
    free: u32,
    /// The last valid item of every key.
    last: [Option<Item>; KEYS],
    /// Damaged words.
    damaged: u16,
}

/// Location of an item.
#[derive(Debug, Clone, Copy)]
struct Item {
    start: u32,
    length: u16,
    /// Damaged words before the item.
    damaged: u16,
}

impl Item {
    fn end(self) -> u32 {
        self.start + HEADER_BYTES + u32::from(self.length).next_multiple_of(HEADER_BYTES)
    }
}

impl Page {
    fn blank(start: u32, sequence: u32) -> Self {
        Self { start, sequence, free: start + HEADER_BYTES, last: [None; KEYS], damaged: 0 }
    }

    /// Registers an item at the start of the free words.
    fn add(&mut self, key: u8, length: u16) {
        let item = Item { start: self.free, length, damaged: self.damaged };
        self.free = item.end();
        if let Some(last) = self.last.get_mut(usize::from(key)) {
            *last = Some(item);
        }
    }
}

impl<F: NorFlash> Items<F> {
    const PAGE_BYTES: u32 = {
        assert!(WORD_BYTES.is_multiple_of(F::WRITE_SIZE) && F::ERASE_SIZE.is_multiple_of(WORD_BYTES));
        #[expect(clippy::cast_possible_truncation, reason = "no page has 4 GiB")]
        {
            F::ERASE_SIZE as u32
        }
    };

    /// Creates a store in `range` of a flash; `None` unless it consists of two or more whole pages. Call
    /// [`open`](Self::open) first.
    pub(crate) fn new(flash: F, range: Range<u32>) -> Option<Self> {
        let is_whole = [range.start, range.end].iter().all(|end| end.is_multiple_of(Self::PAGE_BYTES));
        let has_two = range.end >= range.start.saturating_add(2 * Self::PAGE_BYTES);
        (is_whole && has_two).then_some(Self { flash: ReadBack(flash), range, current: None })
    }

    pub(crate) fn flash(&mut self) -> &mut F {
        &mut self.flash.0
    }

    pub(crate) fn into_flash(self) -> F {
        self.flash.0
    }

    /// Finds the valid items.
    ///
    /// # Errors
    /// [`StorageError`], also if the flash holds other data; there are no items then.
    pub(crate) fn open(&mut self) -> Result<(), StorageError> {
        self.current = None;
        for start in self.range.clone().step_by(F::ERASE_SIZE) {
            let (header, sum) = self.header(start)?;
            let sequence = u32::from_le_bytes(header);
            let is_newer = self.current.is_none_or(|page| sequence > page.sequence);
            // The checksum of a blank header is all ones.
            if is_newer && (header, sum) != BLANK && sum == CRC.checksum(&header) {
                self.current = Some(Page::blank(start, sequence));
            }
        }
        let Some(mut page) = self.current else { return self.expect_blank() };
        self.scan(&mut page)?;
        // A damaged or incomplete next page may have been newer.
        let next = self.next(page.start);
        let (header, sum) = self.header(next)?;
        let is_blank = (header, sum) == BLANK;
        let is_whole =
            if is_blank { self.header(next + HEADER_BYTES)? == BLANK } else { sum == CRC.checksum(&header) };
        page.damaged += u16::from(!is_whole);
        self.current = Some(page);
        Ok(())
    }

    /// Finds the valid items of a page.
    fn scan(&mut self, page: &mut Page) -> Result<(), StorageError> {
        let end = self.end(page.start);
        let mut place = page.free;
        while place < end {
            let (header, sum) = self.header(place)?;
            if (header, sum) == BLANK {
                place += HEADER_BYTES;
                continue;
            }
            page.free = place;
            let [key, zero, low, high] = header;
            let item = Item { start: place, length: u16::from_le_bytes([low, high]), damaged: 0 };
            let is_header = usize::from(key) < KEYS && zero == 0 && item.end() <= end;
            if is_header && self.sum_of(header, item)? == sum {
                page.add(key, item.length);
            } else {
                page.damaged += 1;
                page.free += HEADER_BYTES;
            }
            place = page.free;
        }
        Ok(())
    }

    fn sum_of(&mut self, header: [u8; 4], item: Item) -> Result<u32, StorageError> {
        let mut digest = CRC.digest();
        digest.update(&header);
        let mut block = [0; BLOCK_BYTES];
        let bytes = item.start + HEADER_BYTES..;
        for (from, done) in bytes.zip(0..item.length).step_by(BLOCK_BYTES) {
            let left = usize::from(item.length - done);
            let block = block.get_mut(..left.min(BLOCK_BYTES)).unwrap_or_default();
            self.flash.read(from, block)?;
            digest.update(block);
        }
        Ok(digest.finalize())
    }

    fn last(&self, key: u8) -> Option<Item> {
        self.current?.last.get(usize::from(key)).copied().flatten()
    }

    /// Returns whether an item of this key that is newer than the last valid one may be damaged.
    pub(crate) fn may_be_outdated(&self, key: u8) -> bool {
        let damaged_before = self.last(key).map_or(0, |item| item.damaged);
        self.current.is_some_and(|page| page.damaged != damaged_before)
    }

    /// Returns whether there is a damaged word between the last valid items of two keys, or one is missing.
    pub(crate) fn are_separated(&self, key: u8, other: u8) -> bool {
        let [item, other] = [key, other].map(|key| self.last(key).map(|item| item.damaged));
        item != other
    }

    /// Ignores an item from now on.
    pub(crate) fn forget(&mut self, key: u8) {
        if let Some(last) = self.current.as_mut().and_then(|page| page.last.get_mut(usize::from(key))) {
            *last = None;
        }
    }

    /// Reads an item into `buffer`; `None` if it does not exist.
    ///
    /// # Errors
    /// [`StorageError`], also if it is longer than the buffer.
    pub(crate) fn fetch<'a>(
        &mut self,
        key: u8,
        buffer: &'a mut [u8],
    ) -> Result<Option<&'a [u8]>, StorageError> {
        let Some(item) = self.last(key) else { return Ok(None) };
        let bytes = buffer.get_mut(..usize::from(item.length)).ok_or(StorageError)?;
        self.flash.read(item.start + HEADER_BYTES, bytes)?;
        Ok(Some(bytes))
    }

    /// Replaces items, in one page with at least `spare` bytes left if possible. Erases at most one page.
    ///
    /// # Errors
    /// [`StorageError`]; each of the items is the old or the new one, the others are unchanged.
    pub(crate) async fn store(&mut self, items: &[(u8, &[u8])], spare: usize) -> Result<(), StorageError> {
        let size = |(_, bytes): &(u8, &[u8])| WORD_BYTES + bytes.len().next_multiple_of(WORD_BYTES);
        let wanted = items.iter().map(size).sum::<usize>() + spare;
        let has_room =
            |page: Page| page.damaged == 0 && wanted <= (self.end(page.start) - page.free) as usize;
        if self.current.is_some_and(has_room) && self.append(items).await.is_ok() {
            return Ok(());
        }
        self.move_on(items).await
    }

    /// Replaces items without erasing.
    ///
    /// # Errors
    /// [`StorageError`], also if the page is full: each item is the old or the new one, and further appends fail.
    pub(crate) async fn append(&mut self, items: &[(u8, &[u8])]) -> Result<(), StorageError> {
        let mut page = self.current.ok_or(StorageError)?;
        self.current = Some(Page { free: self.end(page.start), ..page });
        self.write(&mut page, items).await?;
        self.current = Some(page);
        Ok(())
    }

    /// Continues in the next page.
    async fn move_on(&mut self, items: &[(u8, &[u8])]) -> Result<(), StorageError> {
        let (start, sequence) = match self.current {
            Some(page) => (self.next(page.start), page.sequence.wrapping_add(1)),
            None => (self.range.start, 1),
        };
        self.flash.erase(start, self.end(start)).await?;
        let mut page = Page::blank(start, sequence);
        for key in (0..).take(KEYS).filter(|key| items.iter().all(|(new, _)| new != key)) {
            if let Some(item) = self.last(key) {
                self.copy(item, page.free).await?;
                page.add(key, item.length);
            }
        }
        self.write(&mut page, items).await?;
        let header = sequence.to_le_bytes();
        self.write_header(start, header, CRC.checksum(&header)).await?;
        self.current = Some(page);
        Ok(())
    }

    async fn copy(&mut self, item: Item, to: u32) -> Result<(), StorageError> {
        for (from, to) in (item.start..item.end()).zip(to..).step_by(WORD_BYTES) {
            let mut word = [0; WORD_BYTES];
            self.flash.read(from, &mut word)?;
            self.flash.write(to, &word).await?;
        }
        Ok(())
    }

    /// Writes all headers first: if a header is blank, so is everything after it.
    async fn write(&mut self, page: &mut Page, items: &[(u8, &[u8])]) -> Result<(), StorageError> {
        for (key, bytes) in items {
            let start = page.free;
            let length = u16::try_from(bytes.len()).map_err(|_| StorageError)?;
            page.add(*key, length);
            if page.free > self.end(page.start) {
                return Err(StorageError);
            }
            let [low, high] = length.to_le_bytes();
            let header = [*key, 0, low, high];
            let mut digest = CRC.digest();
            digest.update(&header);
            digest.update(bytes);
            self.write_header(start, header, digest.finalize()).await?;
            let places = (start + HEADER_BYTES..).step_by(WORD_BYTES);
            for (place, bytes) in places.zip(bytes.chunks(WORD_BYTES)) {
                let mut word = [ERASED; WORD_BYTES];
                word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                self.flash.write(place, &word).await?;
            }
        }
        Ok(())
    }

    /// Reads the header of a page or item: value and CRC.
    fn header(&mut self, place: u32) -> Result<([u8; 4], u32), StorageError> {
        let mut header = [[0; 4]; 2];
        self.flash.read(place, header.as_flattened_mut())?;
        let [says, sum] = header;
        Ok((says, u32::from_le_bytes(sum)))
    }

    async fn write_header(&mut self, place: u32, says: [u8; 4], sum: u32) -> Result<(), StorageError> {
        let header = [says, sum.to_le_bytes()];
        self.flash.write(place, header.as_flattened()).await
    }

    /// Fails if the words are not blank.
    fn expect_blank(&mut self) -> Result<(), StorageError> {
        for place in self.range.clone().step_by(WORD_BYTES) {
            if self.header(place)? != BLANK {
                return Err(StorageError);
            }
        }
        Ok(())
    }

    /// End of a page.
    fn end(&self, start: u32) -> u32 {
        start + Self::PAGE_BYTES
    }

    /// Start of the next page.
    fn next(&self, start: u32) -> u32 {
        if self.end(start) < self.range.end { self.end(start) } else { self.range.start }
    }
}
