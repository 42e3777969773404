//! Schemes in flash, whole whenever the power goes.
//!
//! [Items](crate::items): two places for schemes, and a record of which one is confirmed; beside them
//! [a motor's configuration](crate::motor_store). A new scheme goes to the
//! place that is not confirmed. A cut leaves the state before a step or the one after it.
//!
//! A save, a confirmation and a rollback erase one page at most. A save leaves room for the two records of a trial, so that a
//! start, which must not erase, has it for the first of them.

use core::ops::Range;

use dimsart_core::Dimsart;
use dimsart_link::protocol::Trial;
use dimsart_link::saved_scheme::{self, LoadError};
use embedded_storage_async::nor_flash::NorFlash;
use heapless::vec::VecView;

use crate::items::Items;
use crate::read_back::Broken;

/// Keys of the items. A scheme's is its place.
const RECORD: u8 = 0;
const PLACES: [u8; 2] = [1, 2];
const RECORD_BYTES: usize = 2;
/// Two records.
pub(crate) const SPARE_BYTES: usize = 32;

/// Schemes in a range of a flash.
#[derive(Debug)]
pub struct SchemeStore<F> {
    pub(crate) items: Items<F>,
    record: Record,
}

/// Which scheme is which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Record {
    /// Place of the confirmed scheme.
    confirmed: Option<u8>,
    trial: Trial,
}

impl<F: NorFlash> SchemeStore<F> {
    /// A store in `range` of a flash; none when that is not made of two whole pages or more. [`open`](Self::open) it before
    /// anything else.
    pub fn new(flash: F, range: Range<u32>) -> Option<Self> {
        Some(Self { items: Items::new(flash, range)?, record: Record::default() })
    }

    /// Reads which schemes there are. None at all in a flash that was never written.
    ///
    /// # Errors
    /// [`Broken`], also when the flash holds something else; it is as if no scheme was kept then.
    pub fn open(&mut self) -> Result<(), Broken> {
        self.record = Record::default();
        self.items.open()?;
        // It may be an older one than that of which the record says something.
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

    /// The flash, of which the store's range is the store's.
    pub fn flash(&mut self) -> &mut F {
        self.items.flash()
    }

    /// Gives the flash back.
    #[must_use]
    pub fn into_flash(self) -> F {
        self.items.into_flash()
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

    /// Whether a newer record than the one that was read may be damaged.
    #[must_use]
    pub fn is_in_doubt(&self) -> bool {
        self.items.is_in_doubt(RECORD)
    }

    /// Keeps a scheme for a trial at the next start, in place of the last one on trial.
    ///
    /// # Errors
    /// [`Broken`]; the scheme on trial is the old or the new one, the confirmed one is as before.
    pub async fn save(&mut self, scheme: &[u8]) -> Result<(), Broken> {
        let record = Record { trial: Trial::Waits, ..self.record };
        let items = [(record.other_place(), scheme), (RECORD, &record.to_bytes())];
        self.items.store(&items, SPARE_BYTES).await?;
        self.record = record;
        Ok(())
    }

    /// Notes that the scheme on trial is tried: to be called before it is run. Erases nothing.
    ///
    /// # Errors
    /// [`Broken`], also if the page has no room: the scheme must not run.
    pub async fn begin_trial(&mut self) -> Result<(), Broken> {
        let record = Record { trial: Trial::Tried, ..self.record };
        self.items.append(&[(RECORD, &record.to_bytes())]).await?;
        self.record = record;
        Ok(())
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

    /// Loads the scheme on trial, or else the confirmed one, by way of `bytes`; `fingerprint` is the image's.
    ///
    /// # Errors
    /// Why it does not load, [`LoadError::Damaged`] if it is not there; no module exists then.
    pub fn load(
        &mut self,
        is_trial: bool,
        fingerprint: u32,
        bytes: &mut VecView<u8>,
        dimsart: &mut Dimsart,
    ) -> Result<(), LoadError> {
        let place = if is_trial { Some(self.record.other_place()) } else { self.record.confirmed };
        let place = place.ok_or(LoadError::Damaged)?;
        // As long as any.
        let _ = bytes.resize_default(bytes.capacity());
        let found = self.items.fetch(place, bytes);
        saved_scheme::load(found.ok().flatten().unwrap_or_default(), fingerprint, dimsart)
    }

    async fn set(&mut self, record: Record) -> Result<(), Broken> {
        if record != self.record {
            self.items.store(&[(RECORD, &record.to_bytes())], 0).await?;
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

    fn to_bytes(self) -> [u8; RECORD_BYTES] {
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
