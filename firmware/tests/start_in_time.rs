//! Schemes in a page at any fill level: a start ends before the watchdog timeout, and a save erases at most
//! one page.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

#[path = "common/board.rs"]
mod board;
mod common;

use board::{Board, blank_flashes, scheme};
use common::{Flash, PAGE, WORD};
use dimsart_core::checksum::CRC;
use dimsart_link::protocol::{Fallback, Origin, Trial};
use embassy_futures::block_on;

/// Keys of items as in the firmware.
const RECORD: u8 = 0;
const PLACES: [u8; 2] = [1, 2];
const MOTOR: u8 = 3;
/// Length of a record.
const RECORD_BYTES: usize = 16;

/// Encodes an item, implemented independently from the description of the format.
fn item(key: u8, bytes: &[u8]) -> Vec<u8> {
    let [low, high] = u16::try_from(bytes.len()).unwrap().to_le_bytes();
    let mut item = vec![key, 0, low, high];
    let mut digest = CRC.digest();
    digest.update(&item);
    digest.update(bytes);
    item.extend(digest.finalize().to_le_bytes());
    item.extend(bytes);
    item.resize(item.len().next_multiple_of(WORD), 0xFF);
    item
}

/// A blank flash with these items in its first page.
fn with_items(mut flash: Flash, items: &[Vec<u8>]) -> Flash {
    let sequence = 1_u32.to_le_bytes();
    let mut page = [sequence, CRC.checksum(&sequence).to_le_bytes()].concat();
    page.extend(items.concat());
    flash.bytes[..page.len()].copy_from_slice(&page);
    flash.is_written[..page.len() / WORD].fill(true);
    flash
}

fn used(flash: &Flash) -> usize {
    flash.is_written[..PAGE / WORD].iter().rposition(|is_written| *is_written).map_or(0, |word| word + 1)
        * WORD
}

fn erasures(flash: &Flash) -> u32 {
    flash.erasures.iter().sum()
}

/// Saves, tries and confirms another scheme, with at most one erasure each.
fn save_and_confirm(mut board: Board, gain: u16) -> Flash {
    let before = erasures(board.store.flash());
    block_on(board.store.save(&scheme(gain))).unwrap();
    let saved = erasures(board.store.flash());
    assert!(saved <= before + 1, "{gain}");
    let mut board = Board::start(board.store.into_flash());
    assert_eq!((board.running(), board.status.origin, board.status.fallback), (gain, Origin::Trial, None));
    block_on(board.store.confirm()).unwrap();
    let flash = board.store.into_flash();
    assert_eq!(erasures(&flash), saved, "a confirmation has its room");
    flash
}

#[test]
fn at_every_fill_level_a_trial_runs_or_the_saved_scheme_does_with_the_reason() {
    let (mut tried, mut left) = (0, 0);
    for blank in blank_flashes() {
        let [confirmed, waiting] = [10, 20].map(scheme);
        let kept = [
            item(PLACES[0], &confirmed),
            item(RECORD, &[PLACES[0], 0]),
            item(PLACES[1], &waiting),
            item(RECORD, &[PLACES[0], 1]),
        ];
        let least = used(&with_items(blank.clone(), &kept));
        for fill in (least + WORD..=PAGE).step_by(WORD) {
            let words = vec![7; fill - least];
            let filler = words.chunks(128).map(|words| item(MOTOR, &words[WORD..]));
            let full = with_items(blank.clone(), &kept.iter().cloned().chain(filler).collect::<Vec<_>>());
            assert_eq!(used(&full), fill);
            // Power loss before, during or after the record of the trial, or in its first word.
            let record = item(RECORD, &[PLACES[0], 2]);
            for written in [0, 3, WORD] {
                let mut flash = full.clone();
                let torn = &record[..written.min(PAGE - fill)];
                flash.bytes[fill..][..torn.len()].copy_from_slice(torn);
                flash.is_written[fill / WORD..][..torn.len().div_ceil(WORD)].fill(true);
                let has_room = used(&flash) + RECORD_BYTES <= PAGE;
                let doubt = (!torn.is_empty()).then_some(Fallback::Damaged);
                let expected = if has_room {
                    tried += 1;
                    (20, Origin::Trial, doubt, Trial::Tried)
                } else {
                    left += 1;
                    (10, Origin::Saved, Some(Fallback::NotRecorded), Trial::Pending)
                };
                let mut board = Board::start(flash);
                let status = board.status;
                let found = (board.running(), status.origin, status.fallback, status.trial);
                assert_eq!(found, expected, "{fill} bytes and {written}");
                if fill % 128 < 16 || !has_room {
                    let mut board = Board::start(save_and_confirm(board, 30));
                    let found = (board.running(), board.status.origin, board.status.fallback);
                    assert_eq!(found, (30, Origin::Saved, None), "{fill} bytes and {written}");
                }
            }
        }
    }
    assert!(tried > 1000 && left >= 12, "{tried} {left}");
}

/// A sequence that once made a board reset forever: set a parameter, save, try, confirm or not.
#[test]
fn a_thousand_saves_erase_less_than_a_page_each_and_no_start_erases() {
    for blank in blank_flashes() {
        let mut flash = blank;
        for cycle in 0..1_000_u16 {
            let before = erasures(&flash);
            let mut board = Board::start(flash);
            if cycle % 13 == 4 {
                block_on(board.store.save(&scheme(cycle % 100))).unwrap();
                board = Board::start(board.store.into_flash());
                assert_eq!((board.running(), board.status.origin), (cycle % 100, Origin::Trial));
                flash = board.store.into_flash();
            } else {
                flash = save_and_confirm(board, cycle % 100);
            }
            assert!(erasures(&flash) <= before + 1, "save {cycle}");
        }
        println!("1000 saves: pages erased {:?}", flash.erasures);
        assert!(erasures(&flash) < 500, "{:?}", flash.erasures);
    }
}

#[test]
fn a_motor_s_configuration_that_is_kept_meanwhile_leaves_a_trial_its_room() {
    for blank in blank_flashes() {
        let mut board = Board::start(blank);
        for cycle in 0..200 {
            block_on(board.store.save(&scheme(cycle % 100))).unwrap();
            for first in 0..cycle % 5 {
                block_on(board.store.store_motor(1, &[u32::from(first); 25])).unwrap();
            }
            board = Board::start(board.store.into_flash());
            assert_eq!((board.status.origin, board.status.fallback), (Origin::Trial, None), "save {cycle}");
        }
    }
}
