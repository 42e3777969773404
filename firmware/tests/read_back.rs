//! Schemes and keys in flash that reports success for failed writes and erasures: they must not be reported
//! as stored.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod common;

use std::ops::Range;

use common::{Flash, PAGE, PAGES};
use dimsart_link::protocol::Trial;
use embassy_futures::block_on;
use firmware::{KeyStore, SchemeStore, StorageError, StoredKeyState};

const SCHEMES: Range<u32> = 0..8192;
const KEYS: Range<u32> = 4096..8192;

/// A step and the expected content of the flash.
type Step = fn(Flash, u8) -> (Flash, Result<(), StorageError>);

fn open_schemes(flash: Flash) -> SchemeStore<Flash> {
    let mut store = SchemeStore::new(flash, SCHEMES).unwrap();
    // The first save erases a flash with other content.
    let _ = store.open();
    store
}

/// Saves and confirms a scheme of these bytes.
fn save(flash: Flash, number: u8) -> (Flash, Result<(), StorageError>) {
    let mut store = open_schemes(flash);
    let saved = block_on(store.save(&[number; 300])).and_then(|()| block_on(store.confirm()));
    (store.into_flash(), saved)
}

/// Sets a key of these bytes.
fn set(mut flash: Flash, number: u8) -> (Flash, Result<(), StorageError>) {
    let mut store = KeyStore::new::<Flash>(KEYS).unwrap();
    block_on(store.open(&mut flash));
    let is_set = block_on(store.set([number; 16], number.into(), &mut flash));
    (flash, is_set.map(|_| ()))
}

fn is_saved(flash: Flash, number: u8) -> bool {
    let store = open_schemes(flash);
    let is_confirmed = store.is_saved() && store.trial() == Trial::None;
    is_confirmed && store.into_flash().bytes.windows(300).any(|bytes| bytes == [number; 300])
}

fn is_set(mut flash: Flash, number: u8) -> bool {
    let mut store = KeyStore::new::<Flash>(KEYS).unwrap();
    matches!(block_on(store.open(&mut flash)), StoredKeyState::Key(kept) if kept.key == [number; 16])
}

/// The flash, with working writes.
fn repaired(flash: Flash) -> Flash {
    Flash { deaf: 0..0, ..flash }
}

/// Executes a step on `flash` with each single word or page failing, and with all following ones failing.
fn hold(flash: &Flash, step: Step, is_kept: fn(Flash, u8) -> bool) -> usize {
    const NUMBER: u8 = 0x5A;
    let (heard, done) = step(flash.clone(), NUMBER);
    assert!(done.is_ok() && is_kept(heard.clone(), NUMBER), "the step itself");
    let mut refused = 0;
    for first in flash.begun..heard.begun {
        for deaf in [first..first + 1, first..usize::MAX] {
            let (after, done) = step(Flash { deaf: deaf.clone(), ..flash.clone() }, NUMBER);
            refused += usize::from(done.is_err());
            assert!(done.is_err() || is_kept(repaired(after), NUMBER), "deaf in {deaf:?}: it is not kept");
        }
    }
    refused
}

#[test]
fn a_scheme_that_the_flash_has_not_taken_is_no_scheme_that_is_saved() {
    let mut flash = Flash::new();
    let mut refused = 0;
    // Enough to use all pages again, with moves and erasures.
    for number in 0..45 {
        refused += hold(&flash, save, is_saved);
        flash = save(flash, number).0;
    }
    assert!(flash.erasures.iter().all(|erasures| *erasures > 0), "{:?}", flash.erasures);
    assert!(refused > 1_000, "{refused}: too little was not taken");
}

#[test]
fn a_key_that_the_flash_has_not_taken_is_no_key_that_is_set() {
    let mut flash = Flash::new();
    let mut refused = 0;
    for number in 0..4 {
        refused += hold(&flash, set, is_set);
        flash = set(flash, number).0;
    }
    assert!(refused > 30, "{refused}: too little was not taken");
}

#[test]
fn a_flash_full_of_something_else_that_is_not_erased_keeps_nothing() {
    let full = Flash { bytes: vec![0x5A; PAGES * PAGE], ..Flash::new() };
    let (_, saved) = save(Flash { deaf: 0..usize::MAX, ..full.clone() }, 1);
    assert_eq!(saved, Err(StorageError));
    let (flash, saved) = save(full, 1);
    assert!(saved.is_ok() && is_saved(flash, 1));
}
