//! Items in flash, each replaced whole or not at all, whenever the power goes.
//!
//! ```text
//! page    sequence u32 | CRC-32 u32 | item | item | ...      of all pages, the one with the highest sequence counts
//! item    key u8 | 0 u8 | length u16 | CRC-32 u32 | its bytes, filled up to a whole word
//! ```
//! A new item goes behind the last one, and of each key the last item counts. Where there is no room for it, or what is
//! there is not whole, the next page is erased, gets what counts of the one before it and the new item, and then its
//! sequence. A cut before that leaves the page before it, which nothing has touched. (`sequential-storage` erases the page
//! that it has filled last when the erasure of the one before it was cut, and takes the damaged rest of that in its place.)
//!
//! What is written counts when it could be [read back](crate::read_back).

use core::ops::Range;

use dimsart_core::checksum::CRC;
use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash as _};

use crate::read_back::{ERASED, ReadBack};

/// Keys of items are below.
const KEYS: usize = 4;
/// A whole number of words of every flash here.
const WORD_BYTES: usize = 8;
/// Of a page's and an item's beginning.
const HEADER_BYTES: u32 = WORD_BYTES as u32;
/// A header that was never written.
const BLANK: ([u8; 4], u32) = ([ERASED; 4], u32::MAX);
/// Read at once.
const BLOCK_BYTES: usize = 32;

/// The storage cannot be read, or holds something else than was written to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Broken;

/// Items in a range of a flash.
#[derive(Debug)]
pub(crate) struct Items<F> {
    flash: ReadBack<F>,
    range: Range<u32>,
    current: Option<Page>,
}

/// The page that counts.
#[derive(Debug, Clone, Copy)]
struct Page {
    start: u32,
    sequence: u32,
    /// Where the next item goes; the page's end where none does.
    free: u32,
}

/// Where an item is.
#[derive(Debug, Clone, Copy)]
struct Item {
    start: u32,
    length: u16,
}

impl Item {
    fn end(self) -> u32 {
        self.start + HEADER_BYTES + u32::from(self.length).next_multiple_of(HEADER_BYTES)
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

    /// Items in `range` of a flash; none when it is not made of two whole pages or more. [`open`](Self::open) them before
    /// anything else.
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

    /// Finds what is kept.
    ///
    /// # Errors
    /// [`Broken`], also when the flash holds something else; it is as if nothing was kept then.
    pub(crate) async fn open(&mut self) -> Result<(), Broken> {
        self.current = None;
        for start in self.range.clone().step_by(F::ERASE_SIZE) {
            let (header, sum) = self.header(start).await?;
            let sequence = u32::from_le_bytes(header);
            let is_newer = self.current.is_none_or(|page| sequence > page.sequence);
            // The sum of ones is all ones.
            if is_newer && (header, sum) != BLANK && sum == CRC.checksum(&header) {
                self.current = Some(Page { start, sequence, free: start });
            }
        }
        let Some(page) = self.current else { return self.expect_blank().await };
        let (_, free) = self.last_items(page.start).await?;
        // What is not whole was cut off.
        let is_blank = free < self.end(page.start) && self.header(free).await? == BLANK;
        self.current = Some(Page { free: if is_blank { free } else { self.end(page.start) }, ..page });
        Ok(())
    }

    /// The bytes of an item, in `buffer`; none where there is no such item.
    ///
    /// # Errors
    /// [`Broken`], also when it is longer than the buffer.
    pub(crate) async fn fetch<'a>(
        &mut self,
        key: u8,
        buffer: &'a mut [u8],
    ) -> Result<Option<&'a [u8]>, Broken> {
        let Some(page) = self.current else { return Ok(None) };
        let (last, _) = self.last_items(page.start).await?;
        let Some(item) = last.get(usize::from(key)).copied().flatten() else { return Ok(None) };
        let bytes = buffer.get_mut(..usize::from(item.length)).ok_or(Broken)?;
        self.read(item.start + HEADER_BYTES, bytes).await?;
        Ok(Some(bytes))
    }

    /// Keeps an item in place of the one of the same key.
    ///
    /// # Errors
    /// [`Broken`]: the item is the old or the new one, and the others are as before.
    pub(crate) async fn store(&mut self, key: u8, bytes: &[u8]) -> Result<(), Broken> {
        let length = u16::try_from(bytes.len()).map_err(|_| Broken)?;
        if let Some(page) = self.current {
            let item = Item { start: page.free, length };
            let is_written = item.end() <= self.end(page.start) && self.write(item, key, bytes).await.is_ok();
            let free = if is_written { item.end() } else { self.end(page.start) };
            self.current = Some(Page { free, ..page });
            if is_written {
                return Ok(());
            }
        }
        self.move_on(length, key, bytes).await
    }

    /// Goes on in the next page.
    async fn move_on(&mut self, length: u16, key: u8, bytes: &[u8]) -> Result<(), Broken> {
        let behind = self.current.map(|page| self.end(page.start)).filter(|end| *end < self.range.end);
        let start = behind.unwrap_or(self.range.start);
        self.flash.erase(start, self.end(start)).await.map_err(|_| Broken)?;
        let (mut free, mut sequence) = (start + HEADER_BYTES, 1);
        if let Some(page) = self.current {
            sequence = page.sequence.wrapping_add(1);
            let (last, _) = self.last_items(page.start).await?;
            let others = (0..).zip(last).filter(|(other, _)| *other != key);
            for item in others.filter_map(|(_, item)| item) {
                self.copy(item, free).await?;
                free += item.end() - item.start;
            }
        }
        let item = Item { start: free, length };
        if item.end() > self.end(start) {
            return Err(Broken);
        }
        self.write(item, key, bytes).await?;
        let header = sequence.to_le_bytes();
        self.write_header(start, header, CRC.checksum(&header)).await?;
        self.current = Some(Page { start, sequence, free: item.end() });
        Ok(())
    }

    /// The last item of every key, and the end of the last one that is whole.
    async fn last_items(&mut self, page: u32) -> Result<([Option<Item>; KEYS], u32), Broken> {
        let (mut last, mut start) = ([None; KEYS], page + HEADER_BYTES);
        while start < self.end(page) {
            let (header, sum) = self.header(start).await?;
            let [key, _, low, high] = header;
            let item = Item { start, length: u16::from_le_bytes([low, high]) };
            let Some(last) = last.get_mut(usize::from(key)).filter(|_| item.end() <= self.end(page)) else {
                break;
            };
            let mut digest = CRC.digest();
            digest.update(&header);
            let mut block = [0; BLOCK_BYTES];
            let bytes = item.start + HEADER_BYTES..;
            for (from, done) in bytes.zip(0..item.length).step_by(BLOCK_BYTES) {
                let left = usize::from(item.length - done);
                let block = block.get_mut(..left.min(BLOCK_BYTES)).unwrap_or_default();
                self.read(from, block).await?;
                digest.update(block);
            }
            if digest.finalize() != sum {
                break;
            }
            *last = Some(item);
            start = item.end();
        }
        Ok((last, start))
    }

    async fn copy(&mut self, item: Item, to: u32) -> Result<(), Broken> {
        for (from, to) in (item.start..item.end()).zip(to..).step_by(WORD_BYTES) {
            let mut word = [0; WORD_BYTES];
            self.read(from, &mut word).await?;
            self.flash.write(to, &word).await.map_err(|_| Broken)?;
        }
        Ok(())
    }

    /// Its header first: where that is blank, everything behind it is.
    async fn write(&mut self, item: Item, key: u8, bytes: &[u8]) -> Result<(), Broken> {
        let [low, high] = item.length.to_le_bytes();
        let header = [key, 0, low, high];
        let mut digest = CRC.digest();
        digest.update(&header);
        digest.update(bytes);
        self.write_header(item.start, header, digest.finalize()).await?;
        for (place, bytes) in (item.start + HEADER_BYTES..).step_by(WORD_BYTES).zip(bytes.chunks(WORD_BYTES))
        {
            let mut word = [ERASED; WORD_BYTES];
            word.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
            self.flash.write(place, &word).await.map_err(|_| Broken)?;
        }
        Ok(())
    }

    /// Of a page or an item: what it says, and a CRC.
    async fn header(&mut self, place: u32) -> Result<([u8; 4], u32), Broken> {
        let mut header = [[0; 4]; 2];
        self.read(place, header.as_flattened_mut()).await?;
        let [says, sum] = header;
        Ok((says, u32::from_le_bytes(sum)))
    }

    async fn write_header(&mut self, place: u32, says: [u8; 4], sum: u32) -> Result<(), Broken> {
        let header = [says, sum.to_le_bytes()];
        self.flash.write(place, header.as_flattened()).await.map_err(|_| Broken)
    }

    async fn read(&mut self, place: u32, bytes: &mut [u8]) -> Result<(), Broken> {
        self.flash.read(place, bytes).await.map_err(|_| Broken)
    }

    /// Fails where somebody else has written.
    async fn expect_blank(&mut self) -> Result<(), Broken> {
        for place in self.range.clone().step_by(WORD_BYTES) {
            if self.header(place).await? != BLANK {
                return Err(Broken);
            }
        }
        Ok(())
    }

    /// Of a page.
    fn end(&self, start: u32) -> u32 {
        start + Self::PAGE_BYTES
    }
}
