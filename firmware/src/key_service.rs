//! Keeps the board's key, and asks for it: beside the tick, like the schemes.

use core::ops::Range;

use boards::{Board as _, Selected, Storage};
use dimsart_link::auth::Key;
use dimsart_link::protocol::{
    DecodeError, Gate, KeyAction, KeyBytes, KeyRefusal, LeaseAction, LeaseStatus, MAX_FRAME_BYTES, NO_CLIENT,
    Refusal, Request, Response, StoreError, Taken,
};
use embassy_futures::block_on;
use embassy_time::Instant;
use firmware::{Broken, Kept, KeptKey, KeyStore, SEEDS_PER_START};
use static_cell::ConstStaticCell;

use crate::handover::{Giver, Handover, Taker};
use crate::tick_handover::{Answer, TickHandover};

type Flash = <Selected as boards::Board>::Flash;

/// Behind those of the links.
const SEED: u64 = Selected::SIZES.links as u64;
const _: () = assert!(SEED < SEEDS_PER_START);

/// A clock that wraps.
pub(crate) fn now_ms() -> u32 {
    u32::try_from(Instant::now().as_millis() & u64::from(u32::MAX)).unwrap_or_default()
}

/// What whoever authenticates packets is told of: every key after the one that is there now.
pub(crate) type KeysToTake = (Taker<Kept>, Kept);

/// Where a key is kept.
pub(crate) type KeyRange = Range<u32>;

/// Where the key is kept.
pub(crate) fn range(storage: &Storage<Flash>) -> KeyRange {
    storage.keys.clone()
}

/// Reads the key. Without a place to keep one nothing is known of it, and the board is locked.
pub(crate) fn start(range: Option<KeyRange>, flash: Option<&mut Flash>) -> (KeyService, KeysToTake) {
    static KEYS: ConstStaticCell<Handover<Kept, 2>> = ConstStaticCell::new(Handover::new());
    let (links, keys_to_take) = KEYS.take().split();
    let mut store = range.and_then(KeyStore::new::<Flash>);
    let kept = match (&mut store, flash) {
        (Some(store), Some(flash)) => block_on(store.open(flash)),
        _ => Kept::Damaged,
    };
    match kept {
        Kept::None => defmt::warn!("it holds no key: it takes what anybody asks, and authenticates nothing"),
        Kept::Key(_) => defmt::info!("it holds a key"),
        Kept::Damaged => {
            defmt::error!("it cannot read its key and takes nothing from anybody: flash it anew")
        }
    }
    (KeyService { store, gate: gate(kept), refusal: Refusal::NotUnderstood, links }, (keys_to_take, kept))
}

/// The key that the board keeps, and what it asks of requests.
pub(crate) struct KeyService {
    store: Option<KeyStore>,
    gate: Gate,
    refusal: Refusal,
    /// To whoever authenticates packets.
    links: Giver<Kept>,
}

impl KeyService {
    /// The request in the content of a frame. What is [not understood](DecodeError::NotUnderstood) is refused, or is
    /// not to be carried out.
    pub(crate) fn take(&mut self, content: &[u8]) -> Result<(u16, Request), DecodeError> {
        self.refusal = Refusal::NotUnderstood;
        match self.gate.take(content) {
            Taken::Request(id, request) => Ok((id, request)),
            Taken::Refused(id, refusal) => {
                self.refusal = Refusal::Key(refusal);
                Err(DecodeError::NotUnderstood { id })
            }
            Taken::NotUnderstood(id) => Err(DecodeError::NotUnderstood { id }),
            Taken::Nothing => Err(DecodeError::OtherClass),
        }
    }

    /// Why the last request was refused.
    pub(crate) fn refusal(&self) -> Refusal {
        self.refusal
    }

    /// Length of the handshake that is to go out now, if there is one.
    pub(crate) fn handshake(&mut self, frame: &mut [u8; MAX_FRAME_BYTES]) -> Option<usize> {
        // There is none for most of the bytes that come.
        if !self.gate.owes_handshake() {
            return None;
        }
        self.gate.handshake(frame).ok().flatten().map(<[u8]>::len)
    }

    /// Carries out a request that the gate has let through.
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
        if action == KeyAction::Look {
            return Ok(());
        }
        let (Some(store), Some(flash)) = (&mut self.store, flash) else {
            return Err(Refusal::Store(StoreError::NoStorage));
        };
        if !is_at_rest(tick).await {
            return Err(Refusal::Key(KeyRefusal::InUse));
        }
        let kept = match action {
            KeyAction::Set { key: KeyBytes(key), salt } => store.set(key, salt, flash).await.map(Kept::Key),
            KeyAction::Clear => store.clear(flash).await.map(|()| Kept::None),
            _ => return Err(Refusal::NotUnderstood),
        };
        let kept = kept.map_err(|Broken| Refusal::Store(StoreError::Storage))?;
        self.gate = gate(kept);
        self.links.give(kept);
        // From the answer on they have it too, and there is room for the next one.
        self.links.taken().await;
        Ok(())
    }
}

fn gate(kept: Kept) -> Gate {
    match kept {
        Kept::None => Gate::open(),
        Kept::Damaged => Gate::damaged(),
        Kept::Key(KeptKey { key, seed }) => Gate::locked(&Key::new(&key), seed.wrapping_add(SEED)),
    }
}

/// Whether no scheme runs and no client holds the lease.
async fn is_at_rest(tick: &mut TickHandover) -> bool {
    let lease = tick.ask(Request::Lease(LeaseAction::Look)).await;
    let is_free = matches!(lease, Response::Lease(LeaseStatus { holder: NO_CLIENT, .. }));
    is_free && !crate::scheme_service::runs(tick).await
}
