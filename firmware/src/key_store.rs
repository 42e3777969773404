//! The key in flash, stored separately from the schemes.
//!
//! ```text
//! page    record | commit | retired | mark | mark | ...     two pages, one with the current record
//! record  key 16 bytes | salt u64 | generation u32 | starts u32 | is set u32 | CRC-32 u32
//! ```
//! A new record is written to the other page and committed by a separate word; then the old record is retired
//! by another word and its page erased. A power loss leaves the old or the new record, and the next start
//! completes or erases a partial one. A committed, unretired record that cannot be read may be the newer one,
//! so the board is locked regardless of the other page.
//!
//! A write is complete when it is [read back](crate::read_back).
//!
//! Each start appends a mark to the record; nonces depend on the number of starts.

use core::ops::Range;

use dimsart_core::checksum::CRC;
use embedded_storage_async::nor_flash::NorFlash;

use crate::read_back::StorageError;
use crate::read_back::{ERASED, ReadBack};

const PAGES: u32 = 2;
/// Length of a commit, retirement or mark: written once, a multiple of the word size of every supported
/// flash.
const WORD_BYTES: usize = 8;
const BODY_BYTES: usize = 40;
const CRC_BYTES: usize = 4;
/// Offsets within a page.
const COMMIT: u32 = 40;
const RETIRED: u32 = 48;
const MARKS: u32 = 56;
const MARK_BYTES: u32 = 8;
const _: () = assert!(COMMIT as usize == BODY_BYTES && MARK_BYTES as usize == WORD_BYTES);
const _: () = assert!(RETIRED == COMMIT + MARK_BYTES && MARKS == RETIRED + MARK_BYTES);
const WRITTEN: [u8; WORD_BYTES] = [0; WORD_BYTES];
/// Half of the bits of a word: a few flipped bits never change a record's validity.
const HALF_BITS: u32 = 32;

/// Seeds per start: [`StoredKey::seed`] and the following numbers.
pub const SEEDS_PER_START: u64 = 8;

/// A key, for use since this start.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct StoredKey {
    /// The key.
    pub key: [u8; 16],
    /// The first of [`SEEDS_PER_START`] numbers that are unique to this start while the key is stored.
    pub seed: u64,
}

/// The debug output is redacted.
impl core::fmt::Debug for StoredKey {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("StoredKey(..)")
    }
}

/// The content of the key storage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoredKeyState {
    /// No key.
    None,
    /// A key.
    Key(StoredKey),
    /// Unreadable data: no client is accepted.
    Damaged,
}

/// A key in two pages of flash.
#[derive(Debug)]
pub struct KeyStore {
    start: u32,
    page_bytes: u32,
    /// The current page and its record, if any.
    current: Option<(u32, Record)>,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    key: Option<[u8; 16]>,
    salt: u64,
    /// Greater than that of the previous record.
    generation: u32,
    /// Number of starts before the first mark.
    starts: u32,
}

/// State of a page.
enum Found {
    /// No complete record, or a retired one.
    Nothing,
    Record(Record),
    /// A committed record that is corrupt and not retired.
    Damaged,
}

impl KeyStore {
    /// Creates a store in `range` of a flash; `None` unless it consists of two pages. Call
    /// [`open`](Self::open) first.
    #[must_use]
    pub fn new<F: NorFlash>(range: Range<u32>) -> Option<Self> {
        const { assert!(WORD_BYTES.is_multiple_of(F::WRITE_SIZE) && F::ERASE_SIZE > MARKS as usize + WORD_BYTES) };
        let page_bytes = u32::try_from(F::ERASE_SIZE).ok()?;
        let is_whole =
            range.start.is_multiple_of(page_bytes) && range.len() == F::ERASE_SIZE * PAGES as usize;
        is_whole.then_some(Self { start: range.start, page_bytes, current: None })
    }

    /// Reads the key and counts a start of the board.
    ///
    /// Returns [`StoredKeyState::Damaged`] also if the flash cannot be read or written.
    pub async fn open<F: NorFlash>(&mut self, flash: &mut F) -> StoredKeyState {
        self.try_open(flash).await.unwrap_or(StoredKeyState::Damaged)
    }

    async fn try_open<F: NorFlash>(&mut self, flash: &mut F) -> Result<StoredKeyState, StorageError> {
        self.current = None;
        let mut is_damaged = false;
        for page in 0..PAGES {
            match self.find(page, flash).await? {
                Found::Nothing => {}
                Found::Damaged => is_damaged = true,
                Found::Record(record) => {
                    let is_newer = |(_, other): (u32, Record)| other.generation < record.generation;
                    if self.current.is_none_or(is_newer) {
                        self.current = Some((page, record));
                    }
                }
            }
        }
        // Even with a valid record: the corrupt one may be newer.
        if is_damaged {
            return Ok(StoredKeyState::Damaged);
        }
        // Completes a partial commit, so that later damage cannot change its meaning.
        if let Some((page, _)) = self.current {
            self.commit(page, flash).await?;
        }
        for page in 0..PAGES {
            if self.current.is_none_or(|(current, _)| current != page) {
                self.retire(page, flash).await?;
            }
        }
        let Some((page, record)) = self.current else { return Ok(StoredKeyState::None) };
        let Some(key) = record.key else { return Ok(StoredKeyState::None) };
        let starts = self.count_start(page, record, flash).await?;
        Ok(StoredKeyState::Key(StoredKey { key, seed: seed(record.salt, starts) }))
    }

    /// Stores a key, replacing the old one. `salt` is a random number, different for every key.
    ///
    /// # Errors
    /// [`StorageError`]; the old key is still stored. The next start may find the new one.
    pub async fn set<F: NorFlash>(
        &mut self,
        key: [u8; 16],
        salt: u64,
        flash: &mut F,
    ) -> Result<StoredKey, StorageError> {
        self.replace(Record { key: Some(key), salt, generation: 0, starts: 0 }, flash).await?;
        Ok(StoredKey { key, seed: seed(salt, 0) })
    }

    /// Deletes the key.
    ///
    /// # Errors
    /// As for [`set`](Self::set).
    pub async fn clear<F: NorFlash>(&mut self, flash: &mut F) -> Result<(), StorageError> {
        self.replace(Record { key: None, salt: 0, generation: 0, starts: 0 }, flash).await
    }

    /// Writes a record to the other page, then retires and erases the old one.
    async fn replace<F: NorFlash>(&mut self, record: Record, flash: &mut F) -> Result<(), StorageError> {
        let (page, generation) = self.current.map_or((0, 0), |(page, old)| (other(page), old.generation));
        let record = Record { generation: generation.wrapping_add(1), ..record };
        self.retire(page, flash).await?;
        write(flash, self.place(page), &record.to_bytes()).await?;
        self.commit(page, flash).await?;
        self.current = Some((page, record));
        // On failure, the next start erases it.
        let _ = self.retire(other(page), flash).await;
        Ok(())
    }

    /// Commits the record of a page, unless it is completely committed.
    async fn commit<F: NorFlash>(&self, page: u32, flash: &mut F) -> Result<(), StorageError> {
        let place = self.place(page) + COMMIT;
        let mut commit = WRITTEN;
        flash.read(place, &mut commit).await.map_err(|_| StorageError)?;
        if commit == WRITTEN { Ok(()) } else { write(flash, place, &WRITTEN).await }
    }

    /// Erases a page that is not current, unless it is erased.
    async fn retire<F: NorFlash>(&self, page: u32, flash: &mut F) -> Result<(), StorageError> {
        let (from, to) = (self.place(page), self.place(page + 1));
        let mut word = WRITTEN;
        for place in (from..to).step_by(WORD_BYTES) {
            flash.read(place, &mut word).await.map_err(|_| StorageError)?;
            if !is_erased(&word) {
                // An interrupted erasure must not look like a damaged record.
                write(flash, from + RETIRED, &WRITTEN).await?;
                return ReadBack(flash).erase(from, to).await;
            }
        }
        Ok(())
    }

    /// Appends a mark to the record; returns the number of starts.
    async fn count_start<F: NorFlash>(
        &mut self,
        page: u32,
        record: Record,
        flash: &mut F,
    ) -> Result<u32, StorageError> {
        let first = self.place(page) + MARKS;
        let mut free = first;
        let mut word = WRITTEN;
        for place in (first..self.place(page + 1)).step_by(WORD_BYTES) {
            flash.read(place, &mut word).await.map_err(|_| StorageError)?;
            if !is_erased(&word) {
                free = place + MARK_BYTES;
            }
        }
        let starts = record.starts.wrapping_add((free - first) / MARK_BYTES + 1);
        if free < self.place(page + 1) {
            write(flash, free, &WRITTEN).await?;
        } else {
            self.replace(Record { starts, ..record }, flash).await?;
        }
        Ok(starts)
    }

    async fn find<F: NorFlash>(&self, page: u32, flash: &mut F) -> Result<Found, StorageError> {
        let (mut body, mut commit, mut retired) = ([0; BODY_BYTES], WRITTEN, WRITTEN);
        let place = self.place(page);
        flash.read(place, &mut body).await.map_err(|_| StorageError)?;
        flash.read(place + COMMIT, &mut commit).await.map_err(|_| StorageError)?;
        flash.read(place + RETIRED, &mut retired).await.map_err(|_| StorageError)?;
        // An interrupted erasure leaves a similar number of zeros in both words.
        if zeros(commit) <= zeros(retired) + HALF_BITS {
            return Ok(Found::Nothing);
        }
        Ok(Record::from_bytes(&body).map_or(Found::Damaged, Found::Record))
    }

    fn place(&self, page: u32) -> u32 {
        self.start + page * self.page_bytes
    }
}

fn other(page: u32) -> u32 {
    1 - page
}

fn seed(salt: u64, starts: u32) -> u64 {
    salt.wrapping_add(SEEDS_PER_START.wrapping_mul(starts.into()))
}

fn is_erased(bytes: &[u8]) -> bool {
    bytes.iter().all(|byte| *byte == ERASED)
}

fn zeros(word: [u8; WORD_BYTES]) -> u32 {
    u64::from_le_bytes(word).count_zeros()
}

async fn write<F: NorFlash>(flash: &mut F, place: u32, bytes: &[u8]) -> Result<(), StorageError> {
    ReadBack(flash).write(place, bytes).await
}

impl Record {
    fn to_bytes(self) -> [u8; BODY_BYTES] {
        let mut bytes = [0; BODY_BYTES];
        let parts: [&[u8]; 5] = [
            &self.key.unwrap_or_default(),
            &self.salt.to_le_bytes(),
            &self.generation.to_le_bytes(),
            &self.starts.to_le_bytes(),
            &u32::from(self.key.is_some()).to_le_bytes(),
        ];
        for (to, from) in bytes.iter_mut().zip(parts.into_iter().flatten()) {
            *to = *from;
        }
        let (covered, end) = bytes.split_at_mut(BODY_BYTES - CRC_BYTES);
        end.copy_from_slice(&checksum(covered).to_le_bytes());
        bytes
    }

    /// `None` if it is corrupt.
    fn from_bytes(bytes: &[u8; BODY_BYTES]) -> Option<Self> {
        let (covered, end) = bytes.split_last_chunk::<CRC_BYTES>()?;
        if checksum(covered) != u32::from_le_bytes(*end) {
            return None;
        }
        let (key, rest) = covered.split_first_chunk()?;
        let (salt, rest) = rest.split_first_chunk()?;
        let (generation, rest) = rest.split_first_chunk()?;
        let (starts, is_set) = rest.split_first_chunk()?;
        Some(Self {
            key: (is_set != [0; 4]).then_some(*key),
            salt: u64::from_le_bytes(*salt),
            generation: u32::from_le_bytes(*generation),
            starts: u32::from_le_bytes(*starts),
        })
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}
