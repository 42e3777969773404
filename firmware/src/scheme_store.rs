//! Schemes in flash, whole whenever the power goes.
//!
//! Items of a map that `sequential-storage` keeps: two places for schemes, and a record of which one
//! is confirmed; [`motor_store`](crate::motor_store) has one more. A new scheme goes to the place that is not confirmed. Every item is replaced whole or not
//! at all, and every step is one item, so a cut leaves the state before it or the one after it. A step is done when it
//! could be [read back](crate::read_back).

use core::ops::Range;

use dimsart_core::protocol::Trial;
use dimsart_core::saved_scheme::{self, LoadError, MAX_SCHEME_BYTES};
use dimsart_core::{Dimsart, ModuleList};
use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::Error;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::motor_store::MOTOR;
use crate::read_back::{ERASED, ReadBack};

/// Keys of the items. A scheme's is its place.
const RECORD: u8 = 0;
const PLACES: [u8; 2] = [1, 2];
/// What a store works in: a scheme, its key, and what rounding up to a word of the flash adds.
pub const BUFFER_BYTES: usize = MAX_SCHEME_BYTES + 32;

/// Read at once; whole pages are made of such blocks.
const BLOCK_BYTES: usize = 512;

/// The storage cannot be read, or holds something else than was written to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Broken;

impl<E> From<Error<E>> for Broken {
    fn from(_: Error<E>) -> Self {
        Self
    }
}

/// Schemes in a range of a flash.
pub struct SchemeStore<'b, F: NorFlash> {
    pub(crate) map: MapStorage<u8, ReadBack<F>, Cache<Uncached, Uncached, Uncached, u8>>,
    record: Record,
    /// Whether the flash holds what no store has written.
    is_garbage: bool,
    pub(crate) buffer: &'b mut [u8; BUFFER_BYTES],
}

/// Which scheme is which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Record {
    /// Place of the confirmed scheme.
    confirmed: Option<u8>,
    trial: Trial,
}

impl<'b, F: NorFlash> SchemeStore<'b, F> {
    /// A store in `range` of a flash, two pages at least, four for schemes of any size.
    ///
    /// None when the range is not made of whole pages. [`open`](Self::open) it before anything else.
    pub fn new(flash: F, range: Range<u32>, buffer: &'b mut [u8; BUFFER_BYTES]) -> Option<Self> {
        let map = MapStorage::new(ReadBack(flash), MapConfig::try_new(range).ok()?, Cache::new_uncached());
        Some(Self { map, record: Record::default(), is_garbage: false, buffer })
    }

    /// Reads which schemes there are. None at all in a flash that was never written.
    ///
    /// # Errors
    /// [`Broken`], also when the flash holds something else; it is as if no scheme was kept then.
    pub async fn open(&mut self) -> Result<(), Broken> {
        (self.record, self.is_garbage) = (Record::default(), false);
        if let Some(bytes) = self.map.fetch_item::<&[u8]>(self.buffer, &RECORD).await? {
            self.record = Record::from_bytes(bytes)?;
        } else if !self.is_blank().await?
            && self.map.fetch_item::<&[u8]>(self.buffer, &MOTOR).await?.is_none()
        {
            self.is_garbage = true;
            return Err(Broken);
        }
        Ok(())
    }

    async fn is_blank(&mut self) -> Result<bool, Broken> {
        for offset in self.map.flash_range().step_by(BLOCK_BYTES) {
            let Some(block) = self.buffer.get_mut(..BLOCK_BYTES) else { return Err(Broken) };
            self.map.flash().0.read(offset, block).await.map_err(|_| Broken)?;
            if block.iter().any(|byte| *byte != ERASED) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The flash, of which the store's range is the store's.
    pub fn flash(&mut self) -> &mut F {
        &mut self.map.flash().0
    }

    /// Gives the flash back.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.map.destroy().0.0
    }

    /// How the trial stands.
    #[must_use]
    pub fn trial(&self) -> Trial {
        self.record.trial
    }

    /// Whether a confirmed scheme is kept.
    #[must_use]
    pub fn is_saved(&self) -> bool {
        self.record.confirmed.is_some()
    }

    /// Keeps a scheme for a trial at the next start, in place of the last one on trial.
    ///
    /// # Errors
    /// [`Broken`]; the scheme on trial is the old or the new one, the confirmed one is as before.
    pub async fn save(&mut self, scheme: &[u8]) -> Result<(), Broken> {
        self.store_at(Record::other_place, scheme).await?;
        self.set(Record { trial: Trial::Waits, ..self.record }).await
    }

    /// Stores an item in the place that the record gives it; a flash that holds garbage is erased before.
    pub(crate) async fn store_at(&mut self, place: fn(Record) -> u8, item: &[u8]) -> Result<(), Broken> {
        let mut is_stored = self.store(place(self.record), item).await?;
        if !is_stored {
            // Nothing in it can be read, so nothing is lost with it.
            (self.record, self.is_garbage) = (Record::default(), true);
            self.map.erase_all().await?;
            self.is_garbage = false;
            is_stored = self.store(place(self.record), item).await?;
        }
        if is_stored { Ok(()) } else { Err(Broken) }
    }

    /// False when the flash must be erased first.
    async fn store(&mut self, place: u8, item: &[u8]) -> Result<bool, Broken> {
        if self.is_garbage {
            return Ok(false);
        }
        // Bound to a name, so that what is awaited next finds its memory free.
        let stored = self.map.store_item(self.buffer, &place, &item).await;
        if matches!(stored, Err(Error::Corrupted { .. })) { Ok(false) } else { Ok(stored.map(|()| true)?) }
    }

    /// Notes that the scheme on trial is tried: to be called before it is run.
    ///
    /// # Errors
    /// [`Broken`]; it must not be run then.
    pub async fn begin_trial(&mut self) -> Result<(), Broken> {
        self.set(Record { trial: Trial::Tried, ..self.record }).await
    }

    /// Confirms the scheme on trial.
    ///
    /// # Errors
    /// [`Broken`]; nothing has changed.
    pub async fn confirm(&mut self) -> Result<(), Broken> {
        self.set(Record { confirmed: Some(self.record.other_place()), trial: Trial::None }).await
    }

    /// Forgets the scheme on trial.
    ///
    /// # Errors
    /// [`Broken`]; nothing has changed.
    pub async fn roll_back(&mut self) -> Result<(), Broken> {
        self.set(Record { trial: Trial::None, ..self.record }).await
    }

    /// Loads the scheme on trial, or else the confirmed one; `fingerprint` is the image's.
    ///
    /// # Errors
    /// Why it does not load, [`LoadError::Damaged`] if it is not there; no module exists then.
    pub async fn load<M: ModuleList, const WORDS: usize>(
        &mut self,
        is_trial: bool,
        fingerprint: u32,
        dimsart: &mut Dimsart<M, WORDS>,
    ) -> Result<(), LoadError> {
        let place = if is_trial { Some(self.record.other_place()) } else { self.record.confirmed };
        let place = place.ok_or(LoadError::Damaged)?;
        let found = self.map.fetch_item::<&[u8]>(self.buffer, &place).await;
        saved_scheme::load(found.ok().flatten().unwrap_or_default(), fingerprint, dimsart)
    }

    async fn set(&mut self, record: Record) -> Result<(), Broken> {
        if record != self.record {
            self.map.store_item(self.buffer, &RECORD, &record.to_bytes().as_slice()).await?;
            self.record = record;
        }
        Ok(())
    }
}

impl Record {
    /// The place that a scheme on trial has, or will have.
    fn other_place(self) -> u8 {
        let [first, second] = PLACES;
        if self.confirmed == Some(first) { second } else { first }
    }

    fn to_bytes(self) -> [u8; 2] {
        let trial = match self.trial {
            Trial::None => 0,
            Trial::Waits => 1,
            Trial::Tried => 2,
        };
        [self.confirmed.unwrap_or(0), trial]
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Broken> {
        let &[confirmed, trial] = bytes else { return Err(Broken) };
        let trial = match trial {
            0 => Trial::None,
            1 => Trial::Waits,
            2 => Trial::Tried,
            _ => return Err(Broken),
        };
        Ok(Self { confirmed: PLACES.contains(&confirmed).then_some(confirmed), trial })
    }
}
