//! Schemes and a motor configuration in flash with a damaged bit or word: a start that does not find the
//! newest items reports that, and finds the intact ones.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

#[path = "common/board.rs"]
mod board;
mod common;

use board::{BUILT_IN, Board, blank_flashes, scheme, store};
use common::{Flash, PAGE, WORD};
use dimsart_link::protocol::{Fallback, MotorFallback, MotorReport, Origin, Trial};
use dimsart_link::saved_scheme::save;
use embassy_futures::block_on;

const CONFIRMED: u16 = 10;
const NEWER: u16 = 20;
const NEXT: u16 = 30;

/// The result of a start: the scheme's bytes and the report.
type Started = (Vec<u8>, Origin, Trial, Option<Fallback>);

fn start(flash: Flash) -> (Board, Started) {
    let mut board = Board::start(flash);
    let bytes = save(board.dimsart.engine_mut()).unwrap().to_vec();
    let status = board.status;
    (board, (bytes, status.origin, status.trial, status.fallback))
}

/// Starts with this flash, saves a scheme and starts again.
fn try_next(flash: Flash, gain: u16) -> Board {
    let mut board = Board::start(flash);
    block_on(board.store.save(&scheme(gain))).unwrap();
    Board::start(board.store.into_flash())
}

fn confirmed(flash: Flash, gain: u16) -> Flash {
    let mut board = try_next(flash, gain);
    block_on(board.store.confirm()).unwrap();
    board.store.into_flash()
}

/// Flashes with a confirmed scheme and a newer one at each step, in the first page and in a later one.
fn flashes() -> Vec<(String, Flash)> {
    let mut flashes = Vec::new();
    for mut flash in blank_flashes() {
        while flash.erasures.iter().sum::<u32>() < 2 {
            let name = |step: &str| format!("{step}, erased {:?}", flash.erasures);
            let mut saved = Board::start(confirmed(flash.clone(), CONFIRMED));
            block_on(saved.store.save(&scheme(NEWER))).unwrap();
            let waits = saved.store.into_flash();
            let mut tried = Board::start(waits.clone());
            block_on(tried.store.confirm()).unwrap();
            let mut left = Board::start(waits.clone());
            block_on(left.store.roll_back()).unwrap();
            flashes.push((name("waits"), waits.clone()));
            flashes.push((name("tried"), Board::start(waits).store.into_flash()));
            flashes.push((name("confirmed"), tried.store.into_flash()));
            flashes.push((name("rolled back"), left.store.into_flash()));
            // Until another page is written.
            let erased = flash.erasures.clone();
            let mut gain = 40;
            while flash.erasures == erased {
                flash = confirmed(flash, gain);
                gain += 1;
            }
        }
    }
    flashes
}

/// Damages of a word: each single bit, and all bits.
fn damages(word: [u8; WORD]) -> impl Iterator<Item = [u8; WORD]> {
    let bits = (0..64).map(move |bit| (u64::from_le_bytes(word) ^ 1 << bit).to_le_bytes());
    let whole = [[0; WORD], [0xFF; WORD], word.map(|byte| !byte), *b"damaged!"];
    bits.chain(whole).filter(move |damaged| *damaged != word)
}

/// The flash with every damage of every written word and of one blank word.
fn each_damage(flash: &Flash) -> impl Iterator<Item = (String, Flash)> + '_ {
    let is_written = |place: &usize| flash.bytes[*place..][..WORD] != [0xFF; WORD] || *place == PAGE - WORD;
    let places = (0..flash.bytes.len()).step_by(WORD).filter(is_written);
    places.flat_map(move |place| {
        let word = *flash.bytes[place..].first_chunk().unwrap();
        damages(word).map(move |damaged| {
            let mut flash = flash.clone();
            flash.bytes[place..][..WORD].copy_from_slice(&damaged);
            flash.is_written[place / WORD] = damaged != [0xFF; WORD];
            (format!("{place:#x}: {word:02x?} becomes {damaged:02x?}"), flash)
        })
    })
}

#[test]
fn a_damaged_bit_or_word_of_what_is_kept_leaves_the_newest_scheme_or_is_told() {
    let (mut unharmed, mut told) = (0, 0);
    for (name, flash) in flashes() {
        let (_, right) = start(flash.clone());
        assert_eq!(
            right.3,
            (right.2 == Trial::Tried && right.1 != Origin::Trial).then_some(Fallback::Unconfirmed)
        );
        let known = [BUILT_IN, CONFIRMED, NEWER].map(scheme);
        for (number, (damage, flash)) in each_damage(&flash).enumerate() {
            let (board, found) = start(flash);
            let is_told = found.3.is_some() && found.3 != Some(Fallback::Unconfirmed);
            assert!(found == right || is_told, "{name}, {damage}: {found:?}");
            assert!(known.contains(&found.0), "{name}, {damage}: a scheme that was replaced");
            unharmed += usize::from(found == right);
            told += usize::from(is_told);
            if number % 50 == 0 {
                let mut next = try_next(board.store.into_flash(), NEXT);
                let found = (next.running(), next.status.origin, next.status.fallback);
                assert_eq!(found, (NEXT, Origin::Trial, None), "{name}, {damage}");
            }
        }
    }
    println!("{unharmed} of {} as without damage, {told} told", unharmed + told);
    assert!(unharmed > 1000 && told > 1000, "{unharmed} {told}");
}

#[test]
fn items_behind_a_damaged_one_count() {
    let replaced = confirmed(Flash::new(), 50);
    let flash = confirmed(confirmed(replaced.clone(), CONFIRMED), NEWER);
    let (_, right) = start(flash.clone());
    assert_eq!((right.1, right.3), (Origin::Saved, None));
    let end = replaced.bytes.iter().rposition(|byte| *byte != 0xFF).unwrap() / WORD;
    for word in 1..=end {
        let place = word * WORD;
        for damaged in damages(*flash.bytes[place..].first_chunk().unwrap()) {
            let mut flash = flash.clone();
            flash.bytes[place..][..WORD].copy_from_slice(&damaged);
            assert_eq!(start(flash).1, right, "at {place:#x}: the items that replaced these are whole");
        }
    }
}

fn motor(flash: Flash) -> MotorReport {
    let mut store = store(flash);
    store.motor()
}

#[test]
fn a_damaged_bit_or_word_of_a_motor_s_configuration_is_told_and_takes_no_scheme_with_it() {
    let keep = |flash: Flash, first: u32| {
        let mut store = store(flash);
        let _ = store.open();
        block_on(store.store_motor(1, &[first; 5])).unwrap();
        store.into_flash()
    };
    for blank in blank_flashes() {
        let flash = keep(confirmed(keep(blank, 1), CONFIRMED), 2);
        let (_, started) = start(flash.clone());
        for (damage, flash) in each_damage(&flash) {
            let report = motor(flash.clone());
            let is_newest = report.is_stored && report.words[..] == [2; 5];
            let is_told = matches!(report.fallback, Some(MotorFallback::Damaged | MotorFallback::Storage));
            assert!(is_newest && report.fallback.is_none() || is_told, "{damage}: {report:?}");
            let (_, found) = start(flash);
            assert!(found == started || found.3.is_some(), "{damage}: {found:?}");
        }
    }
}
