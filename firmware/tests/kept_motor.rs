//! A motor configuration in the flash of the schemes, with a power loss at every byte.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

mod common;

use dimsart_link::protocol::{MotorFallback, MotorReport, Trial};
use embassy_futures::block_on;
use firmware::{SchemeStore, StorageError};

use common::{Flash, PAGE, PAGES};

const ALL: core::ops::Range<u32> = 0..8192;
const _: () = assert!(PAGE * PAGES == 8192);

fn in_store<T>(flash: Flash, act: impl FnOnce(&mut SchemeStore<Flash>) -> T) -> (Flash, T) {
    let mut store = SchemeStore::new(flash, ALL).unwrap();
    let _ = store.open();
    let done = act(&mut store);
    (store.into_flash(), done)
}

fn words(first: u32) -> Vec<u32> {
    (first..).take(25).collect()
}

fn keep(flash: Flash, first: u32) -> (Flash, Result<(), StorageError>) {
    in_store(flash, |store| block_on(store.store_motor(1, &words(first))))
}

fn kept(flash: Flash) -> (Flash, MotorReport) {
    in_store(flash, |store| store.motor())
}

#[test]
fn what_is_kept_is_read_until_it_is_forgotten() {
    let (flash, nothing) = kept(Flash::new());
    assert_eq!(nothing, MotorReport::default());
    let (flash, done) = keep(flash, 7);
    assert_eq!(done, Ok(()));
    let (flash, report) = kept(flash);
    assert_eq!((report.layout, report.is_stored, report.fallback), (1, true, None));
    assert_eq!(report.words[..], words(7));
    let (flash, done) = in_store(flash, |store| block_on(store.store_motor(0, &[])));
    assert_eq!(done, Ok(()));
    assert_eq!(kept(flash).1, MotorReport::default());
}

#[test]
fn schemes_and_motor_leave_each_other_alone() {
    let (flash, done) = keep(Flash::new(), 7);
    assert_eq!(done, Ok(()));
    // A flash without schemes is valid.
    let mut flash = in_store(flash, |store| {
        assert_eq!(store.open(), Ok(()));
        block_on(store.save(&[5; 512])).unwrap();
    })
    .0;
    // Long enough to use every page again.
    for first in 0..150 {
        flash = in_store(flash, |store| {
            assert_eq!(block_on(store.store_motor(1, &words(first))), Ok(()));
            block_on(store.save(&[6; 512])).unwrap();
            assert_eq!(store.motor().words[..], words(first));
            assert_eq!(store.trial(), Trial::Pending);
        })
        .0;
    }
    assert!(flash.erasures.iter().all(|erasures| *erasures > 1), "{:?}", flash.erasures);
}

#[test]
fn after_a_cut_at_any_write_the_old_or_the_new_one_is_read() {
    let (mut flash, _) = keep(Flash::new(), 1000);
    let mut cuts = 0;
    for first in (2000..2030).map(|first| 10 * first) {
        let old = kept(flash.clone()).1.words;
        for power in (0..).step_by(3) {
            let mut cut = flash.clone();
            cut.power = Some(power);
            let (mut after, done) = keep(cut, first);
            after.power = None;
            let found = kept(after).1;
            assert!(found.is_stored && (found.words == old || found.words[..] == words(first)), "{found:?}");
            if done == Ok(()) {
                assert_eq!(found.words[..], words(first));
                break;
            }
            cuts += 1;
        }
        flash = keep(flash, first).0;
    }
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn a_flash_that_holds_something_else_is_told_and_can_be_kept_in() {
    let mut flash = Flash::new();
    flash.bytes.fill(0x5A);
    let (flash, found) = kept(flash);
    assert!(!found.is_stored && found.fallback == Some(MotorFallback::Storage), "{found:?}");
    let (flash, done) = keep(flash, 7);
    assert_eq!(done, Ok(()));
    assert_eq!(kept(flash).1.words[..], words(7));
}

#[test]
fn a_byte_that_has_changed_is_no_configuration_of_another_kind() {
    let (flash, _) = keep(Flash::new(), 7);
    let place = flash.bytes.windows(4).position(|bytes| bytes == 9_u32.to_le_bytes()).unwrap();
    let mut damaged = flash.clone();
    damaged.bytes[place] ^= 4;
    let found = kept(damaged).1;
    assert!(!found.is_stored, "{found:?}");
    assert_eq!(kept(flash).1.words[..], words(7));
}
