//! Selection of the scheme at the start of a board.

use dimsart_core::Dimsart;
use dimsart_link::protocol::{Fallback, Origin, SchemeStatus, Trial};
use dimsart_link::saved_scheme;
use embedded_storage_async::nor_flash::NorFlash;
use heapless::vec::VecView;

use crate::scheme_store::SchemeStore;

/// Starts the scheme on trial, or else the saved one, or else the built-in one.
///
/// `bytes` is a buffer for stored schemes. Whatever the storage holds, the controller then runs one scheme or
/// none; the status contains the reason for a fallback.
pub async fn start<F: NorFlash>(
    store: Option<&mut SchemeStore<F>>,
    bytes: &mut VecView<u8>,
    built_in: &[u8],
    dimsart: &mut Dimsart,
) -> SchemeStatus {
    let fingerprint = saved_scheme::saved_fingerprint(built_in);
    let mut fallback = None;
    let (mut trial, mut is_saved) = (Trial::None, false);
    let mut origin = None;
    if let Some(store) = store {
        origin = start_kept(store, fingerprint, bytes, dimsart, &mut fallback).await;
        (trial, is_saved) = (store.trial(), store.is_saved());
    }
    let origin = origin.unwrap_or_else(|| match saved_scheme::load(built_in, fingerprint, dimsart) {
        Ok(()) => Origin::BuiltIn,
        Err(error) => {
            fallback.get_or_insert(Fallback::BuiltIn(error));
            Origin::Empty
        }
    });
    SchemeStatus { origin, fallback, trial, is_saved }
}

async fn start_kept<F: NorFlash>(
    store: &mut SchemeStore<F>,
    fingerprint: u32,
    bytes: &mut VecView<u8>,
    dimsart: &mut Dimsart,
    fallback: &mut Option<Fallback>,
) -> Option<Origin> {
    if store.open().is_err() {
        *fallback = Some(Fallback::Storage);
    } else if store.may_be_outdated() {
        *fallback = Some(Fallback::Damaged);
    }
    match store.trial() {
        Trial::None => {}
        Trial::Tried => *fallback = fallback.or(Some(Fallback::Unconfirmed)),
        // Before it runs, because it may crash the board.
        Trial::Pending => match store.begin_trial().await {
            Err(_) => *fallback = Some(Fallback::NotRecorded),
            Ok(()) => match store.load(true, fingerprint, bytes, dimsart) {
                Ok(()) => return Some(Origin::Trial),
                Err(error) => *fallback = Some(Fallback::Trial(error)),
            },
        },
    }
    if store.is_saved() {
        match store.load(false, fingerprint, bytes, dimsart) {
            Ok(()) => return Some(Origin::Saved),
            // Replaces any other reason: every start loads this scheme.
            Err(error) => *fallback = Some(Fallback::Saved(error)),
        }
    }
    None
}
