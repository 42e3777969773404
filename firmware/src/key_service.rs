//! Key service: stores the board's key and checks requests against it, outside the tick.

use core::ops::Range;

use boards::{Board as _, Selected, Storage};
use dimsart_link::auth::Key;
use dimsart_link::protocol::{
    AccessControl, AccessOutcome, DecodeError, KeyAction, KeyBytes, KeyRefusal, LeaseAction, LeaseStatus,
    MAX_FRAME_BYTES, NO_CLIENT, Refusal, Request, Response, StoreError,
};
use embassy_futures::block_on;
use embassy_time::Instant;
use firmware::{KeyStore, SEEDS_PER_START, StorageError, StoredKey, StoredKeyState};
use static_cell::ConstStaticCell;

use crate::handover::{ItemQueue, QueueReceiver, QueueSender};
use crate::tick_handover::{Answer, TickHandover};

type Flash = <Selected as boards::Board>::Flash;

/// After the seeds of the links.
const SEED: u64 = Selected::SIZES.links as u64;
const _: () = assert!(SEED < SEEDS_PER_START);

/// Returns a millisecond clock that wraps.
pub(crate) fn now_ms() -> u32 {
    u32::try_from(Instant::now().as_millis() & u64::from(u32::MAX)).unwrap_or_default()
}

/// For the task that authenticates packets: the current key, and a queue of later keys.
pub(crate) type KeysToTake = (QueueReceiver<StoredKeyState>, StoredKeyState);

/// The key's range of flash.
pub(crate) type KeyRange = Range<u32>;

/// Returns the key's range of flash.
pub(crate) fn range(storage: &Storage<Flash>) -> KeyRange {
    storage.keys.clone()
}

/// Reads the key. Without a storage for keys the board is locked.
pub(crate) fn start(range: Option<KeyRange>, flash: Option<&mut Flash>) -> (KeyService, KeysToTake) {
    static KEYS: ConstStaticCell<ItemQueue<StoredKeyState, 2>> = ConstStaticCell::new(ItemQueue::new());
    let (links, keys_to_take) = KEYS.take().split();
    let mut store = range.and_then(KeyStore::new::<Flash>);
    let kept = match (&mut store, flash) {
        (Some(store), Some(flash)) => block_on(store.open(flash)),
        _ => StoredKeyState::Damaged,
    };
    match kept {
        StoredKeyState::None => defmt::warn!("no key stored: commands are accepted without authentication"),
        StoredKeyState::Key(_) => defmt::info!("key stored: commands need authentication"),
        StoredKeyState::Damaged => {
            defmt::error!("stored key corrupt, all commands refused: erase and flash the board")
        }
    }
    (KeyService { store, gate: gate(kept), refusal: Refusal::Unsupported, links }, (keys_to_take, kept))
}

/// The board's key and the check of requests.
pub(crate) struct KeyService {
    store: Option<KeyStore>,
    gate: AccessControl,
    refusal: Refusal,
    /// To the task that authenticates packets.
    links: QueueSender<StoredKeyState>,
}

impl KeyService {
    /// Decodes and checks the request in a frame. A [`Unsupported`](DecodeError::Unsupported) request is
    /// refused or unknown.
    pub(crate) fn take(&mut self, content: &[u8]) -> Result<(u16, Request), DecodeError> {
        self.refusal = Refusal::Unsupported;
        match self.gate.check(content) {
            AccessOutcome::Request(id, request) => Ok((id, request)),
            AccessOutcome::Refused(id, refusal) => {
                self.refusal = Refusal::Key(refusal);
                Err(DecodeError::Unsupported { id })
            }
            AccessOutcome::Unsupported(id) => Err(DecodeError::Unsupported { id }),
            AccessOutcome::Nothing => Err(DecodeError::UnexpectedClass),
        }
    }

    /// Returns why the last request was refused.
    pub(crate) fn refusal(&self) -> Refusal {
        self.refusal
    }

    /// Encodes the pending handshake; returns its length, if any.
    pub(crate) fn handshake(&mut self, frame: &mut [u8; MAX_FRAME_BYTES]) -> Option<usize> {
        // Rarely pending.
        if !self.gate.handshake_is_pending() {
            return None;
        }
        self.gate.handshake(frame).ok().flatten().map(<[u8]>::len)
    }

    /// Executes an accepted request.
    pub(crate) async fn carry_out(
        &mut self,
        action: KeyAction,
        flash: Option<&mut Flash>,
        tick: &mut TickHandover,
    ) -> Answer {
        match self.try_to(action, flash, tick).await {
            Ok(()) => Response::Key(self.gate.state()),
            Err(refusal) => Response::Refused(refusal),
        }
    }

    async fn try_to(
        &mut self,
        action: KeyAction,
        flash: Option<&mut Flash>,
        tick: &mut TickHandover,
    ) -> Result<(), Refusal> {
        if action == KeyAction::Read {
            return Ok(());
        }
        let (Some(store), Some(flash)) = (&mut self.store, flash) else {
            return Err(Refusal::Store(StoreError::NoStorage));
        };
        if !is_at_rest(tick).await {
            return Err(Refusal::Key(KeyRefusal::InUse));
        }
        let kept = match action {
            KeyAction::Set { key: KeyBytes(key), salt } => {
                store.set(key, salt, flash).await.map(StoredKeyState::Key)
            }
            KeyAction::Clear => store.clear(flash).await.map(|()| StoredKeyState::None),
            _ => return Err(Refusal::Unsupported),
        };
        let kept = kept.map_err(|StorageError| Refusal::Store(StoreError::Storage))?;
        self.gate = gate(kept);
        self.links.send(kept);
        // The links use the new key from the response on.
        self.links.wait_empty().await;
        Ok(())
    }
}

fn gate(kept: StoredKeyState) -> AccessControl {
    match kept {
        StoredKeyState::None => AccessControl::open(),
        StoredKeyState::Damaged => AccessControl::damaged(),
        StoredKeyState::Key(StoredKey { key, seed }) => {
            AccessControl::locked(&Key::new(&key), seed.wrapping_add(SEED))
        }
    }
}

/// Returns whether no scheme runs and no client holds the lease.
async fn is_at_rest(tick: &mut TickHandover) -> bool {
    let lease = tick.ask(Request::Lease(LeaseAction::Read)).await;
    let is_free = matches!(lease, Response::Lease(LeaseStatus { holder: NO_CLIENT, .. }));
    is_free && !crate::scheme_service::runs(tick).await
}
