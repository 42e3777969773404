//! Schemes in flash; each update is atomic with respect to power loss.
//!
//! [Items](crate::items): two slots for schemes, a record of the confirmed one, and [a motor
//! configuration](crate::motor_store). A new scheme goes to the unconfirmed slot. A power loss leaves the
//! state before or after a step.
//!
//! A save, a confirmation and a rollback erase at most one page. A save leaves room for the two records of a
//! trial, because a start must not erase.

use core::ops::Range;

use dimsart_core::Dimsart;
use dimsart_link::protocol::Trial;
use dimsart_link::saved_scheme::{self, LoadError};
use embedded_storage_async::nor_flash::NorFlash;
use heapless::vec::VecView;

use crate::items::Items;
use crate::read_back::StorageError;

/// Keys of the items. The key of a scheme is its slot.
const RECORD: u8 = 0;
const PLACES: [u8; 2] = [1, 2];
const RECORD_BYTES: usize = 2;
/// Length of two records.
pub(crate) const SPARE_BYTES: usize = 32;

/// Schemes in a range of flash.
#[derive(Debug)]
pub struct SchemeStore<F> {
    pub(crate) items: Items<F>,
    record: Record,
}

/// State of the two slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Record {
    /// Slot of the confirmed scheme.
    confirmed: Option<u8>,
    trial: Trial,
}

impl<F: NorFlash> SchemeStore<F> {
    /// Creates a store in `range` of a flash; `None` unless it consists of two or more whole pages. Call
    /// [`open`](Self::open) first.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        Some(Self { items: Items::new(flash, range)?, record: Record::default() })
    }

    /// Reads the state of the schemes; none in a new flash.
    ///
    /// # Errors
    /// [`StorageError`], also if the flash holds other data; no scheme is stored then.
    pub fn open(&mut self) -> Result<(), StorageError> {
        self.record = Record::default();
        self.items.open()?;
        // The record may refer to a newer scheme.
        for place in PLACES {
            if self.items.are_separated(place, RECORD) {
                self.items.forget(place);
            }
        }
        let mut record = [0; RECORD_BYTES];
        if let Some(bytes) = self.items.fetch(RECORD, &mut record)? {
            self.record = Record::from_bytes(bytes)?;
        }
        Ok(())
    }

    /// Returns the flash; its range of this store must not be changed.
    pub fn flash(&mut self) -> &mut F {
        self.items.flash()
    }

    /// Returns the flash.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.items.into_flash()
    }

    /// Returns the state of the trial.
    #[must_use]
    pub fn trial(&self) -> Trial {
        self.record.trial
    }

    /// Returns whether a confirmed scheme is stored.
    #[must_use]
    pub fn is_saved(&self) -> bool {
        self.record.confirmed.is_some()
    }

    /// Returns whether a newer record may be damaged.
    #[must_use]
    pub fn may_be_outdated(&self) -> bool {
        self.items.may_be_outdated(RECORD)
    }

    /// Saves a scheme for a trial at the next start, replacing the last one on trial.
    ///
    /// # Errors
    /// [`StorageError`]; the scheme on trial is the old or the new one, the confirmed one is unchanged.
    pub async fn save(&mut self, scheme: &[u8]) -> Result<(), StorageError> {
        let record = Record { trial: Trial::Pending, ..self.record };
        let items = [(record.other_place(), scheme), (RECORD, &record.to_bytes())];
        self.items.store(&items, SPARE_BYTES).await?;
        self.record = record;
        Ok(())
    }

    /// Records the start of a trial; call before running the scheme. Erases nothing.
    ///
    /// # Errors
    /// [`StorageError`], also if the page is full: the scheme must not run.
    pub async fn begin_trial(&mut self) -> Result<(), StorageError> {
        let record = Record { trial: Trial::Tried, ..self.record };
        self.items.append(&[(RECORD, &record.to_bytes())]).await?;
        self.record = record;
        Ok(())
    }

    /// Confirms the scheme on trial.
    ///
    /// # Errors
    /// [`StorageError`]; the state is unchanged.
    pub async fn confirm(&mut self) -> Result<(), StorageError> {
        self.set(Record { confirmed: Some(self.record.other_place()), trial: Trial::None }).await
    }

    /// Deletes the scheme on trial.
    ///
    /// # Errors
    /// [`StorageError`]; the state is unchanged.
    pub async fn roll_back(&mut self) -> Result<(), StorageError> {
        self.set(Record { trial: Trial::None, ..self.record }).await
    }

    /// Loads the scheme on trial, or else the confirmed one, using `bytes` as a buffer; `fingerprint` is the
    /// image's.
    ///
    /// # Errors
    /// The reason; [`LoadError::Damaged`] if it is missing. The scheme is then empty.
    pub fn load(
        &mut self,
        is_trial: bool,
        fingerprint: u32,
        bytes: &mut VecView<u8>,
        dimsart: &mut Dimsart,
    ) -> Result<(), LoadError> {
        let place = if is_trial { Some(self.record.other_place()) } else { self.record.confirmed };
        let place = place.ok_or(LoadError::Damaged)?;
        // Maximum length.
        let _ = bytes.resize_default(bytes.capacity());
        let found = self.items.fetch(place, bytes);
        saved_scheme::load(found.ok().flatten().unwrap_or_default(), fingerprint, dimsart)
    }

    async fn set(&mut self, record: Record) -> Result<(), StorageError> {
        if record != self.record {
            self.items.store(&[(RECORD, &record.to_bytes())], 0).await?;
            self.record = record;
        }
        Ok(())
    }
}

impl Record {
    /// Returns the slot of the scheme on trial.
    fn other_place(self) -> u8 {
        let [first, second] = PLACES;
        if self.confirmed == Some(first) { second } else { first }
    }

    fn to_bytes(self) -> [u8; RECORD_BYTES] {
        let trial = match self.trial {
            Trial::None => 0,
            Trial::Pending => 1,
            Trial::Tried => 2,
        };
        [self.confirmed.unwrap_or(0), trial]
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, StorageError> {
        let &[confirmed, trial] = bytes else { return Err(StorageError) };
        let trial = match trial {
            0 => Trial::None,
            1 => Trial::Pending,
            2 => Trial::Tried,
            _ => return Err(StorageError),
        };
        Ok(Self { confirmed: PLACES.contains(&confirmed).then_some(confirmed), trial })
    }
}
