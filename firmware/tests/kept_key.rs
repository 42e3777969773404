//! A key in flash with a power loss at every byte, in damaged flash and in worn flash.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "in helpers of tests as in tests"
)]

mod common;

use std::collections::BTreeSet;
use std::ops::Range;

use common::{Flash, PAGE, PAGES, WORD};
use embassy_futures::block_on;
use firmware::{KeyStore, SEEDS_PER_START, SchemeStore, StoredKey, StoredKeyState};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Schemes before the key.
const KEYS: Range<u32> = 4096..8192;
const PLACE: usize = 4096;
const BODY_BYTES: usize = 40;
const RETIRED: usize = 48;
/// Record, commit and retirement.
const HEAD_BYTES: usize = 56;

/// Watchdog timeout before the first tick: 512 ms of an oscillator that may be 5 % fast.
const PATIENCE_US: u64 = 480_000;
/// Maximum number of pages that a start erases.
const MAX_ERASURES: u32 = 2;

/// Steps of a user.
#[derive(Debug, Clone, Copy)]
enum Step {
    Set(u8),
    Clear,
    Restart,
}

fn key(number: u8) -> [u8; 16] {
    [number; 16]
}

/// A board with this flash.
struct Board {
    flash: Flash,
    store: KeyStore,
    kept: StoredKeyState,
}

impl Board {
    fn off(flash: Flash) -> Self {
        Self { flash, store: KeyStore::new::<Flash>(KEYS).unwrap(), kept: StoredKeyState::None }
    }

    fn start(flash: Flash) -> Self {
        let erasures = |flash: &Flash| flash.erasures.iter().sum::<u32>();
        let before = erasures(&flash);
        let mut board = Self::off(Flash { patience_us: PATIENCE_US, ..flash });
        board.kept = block_on(board.store.open(&mut board.flash));
        assert!(erasures(&board.flash) <= before + MAX_ERASURES, "{:?}", board.flash.erasures);
        board.flash.patience_us = u64::MAX;
        board
    }

    fn with_key(number: u8) -> Self {
        let mut board = Self::start(Flash::new());
        assert_eq!(board.kept, StoredKeyState::None);
        board.carry_out(Step::Set(number)).unwrap();
        board
    }

    /// The number of the key, if any.
    fn number(&self) -> Option<u8> {
        match self.kept {
            StoredKeyState::Key(StoredKey { key, .. }) => Some(key[0]),
            StoredKeyState::None => None,
            StoredKeyState::Damaged => panic!("damaged"),
        }
    }

    fn carry_out(&mut self, step: Step) -> Option<()> {
        let Self { flash, store, kept } = self;
        *kept = match step {
            Step::Set(number) => {
                StoredKeyState::Key(block_on(store.set(key(number), number.into(), flash)).ok()?)
            }
            Step::Clear => block_on(store.clear(flash)).map(|()| StoredKeyState::None).ok()?,
            Step::Restart => {
                *self = Self::start(self.flash.clone());
                // Without power the state is unknown.
                return (self.flash.power != Some(0)).then_some(());
            }
        };
        Some(())
    }
}

fn script() -> Vec<Step> {
    use Step::{Clear, Restart, Set};
    let mut steps =
        vec![Restart, Set(1), Restart, Restart, Set(2), Restart, Clear, Restart, Set(3), Set(4), Clear];
    steps.extend([Clear, Set(5)]);
    // More than a page can count.
    steps.extend([Restart; PAGE / WORD + 10]);
    steps.extend([Set(6), Restart]);
    steps
}

/// The flash after a power loss at every point of a step.
fn cuts(flash: &Flash, step: Step) -> Vec<Flash> {
    let cut = |power| {
        let board = if matches!(step, Step::Restart) { Board::off } else { Board::start };
        let mut cut = board(flash.clone());
        cut.flash.power = Some(power);
        let is_done = cut.carry_out(step).is_some();
        let is_cut = cut.flash.power == Some(0);
        assert!(is_done || is_cut, "{step:?}");
        is_cut.then_some(Flash { power: None, ..cut.flash })
    };
    (0..).map_while(cut).collect()
}

#[test]
fn damage_of_either_record_after_a_cut_at_any_write_takes_nothing_back_or_locks() {
    use Step::{Clear, Set};
    const BITS: [u8; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
    const BITS_AND_BYTE: [u8; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 255];
    let (mut board, mut locked) = (Board::start(Flash::new()), 0);
    for step in [Set(1), Set(2), Clear, Clear, Set(3)] {
        let finished = match step {
            Set(number) => Some(number),
            _ => None,
        };
        for flash in cuts(&board.flash, step) {
            let started = Board::start(flash.clone());
            let number = started.number();
            // Before the next start, a bit can complete an interrupted commit; after it, even a damaged byte
            // has no effect.
            for (flash, allowed, damages) in
                [(flash, [number, finished], &BITS[..]), (started.flash, [number; 2], &BITS_AND_BYTE)]
            {
                for place in [PLACE, PLACE + PAGE].into_iter().flat_map(|page| page..page + HEAD_BYTES) {
                    for damage in damages {
                        let mut flash = flash.clone();
                        flash.bytes[place] ^= damage;
                        let damaged = Board::start(flash);
                        if damaged.kept == StoredKeyState::Damaged {
                            locked += 1;
                            assert_eq!(
                                Board::start(damaged.flash).kept,
                                StoredKeyState::Damaged,
                                "it stays so"
                            );
                        } else {
                            let number = damaged.number();
                            assert!(allowed.contains(&number), "{step:?}, {place} {damage:x}: {number:?}");
                        }
                    }
                }
            }
        }
        board.carry_out(step).unwrap();
    }
    assert!(locked > 1000, "{locked}");
}

#[test]
fn after_a_cut_at_any_write_and_another_one_in_the_next_start_the_old_or_the_new_key_is_kept() {
    let (mut board, mut count) = (Board::start(Flash::new()), 0);
    for step in script() {
        let before = board.number();
        let after = match step {
            Step::Set(number) => Some(number),
            Step::Clear => None,
            Step::Restart => before,
        };
        for cut in cuts(&board.flash, step) {
            for again in cuts(&cut, Step::Restart).into_iter().chain([cut]) {
                count += 1;
                let mut found = Board::start(again);
                assert!([before, after].contains(&found.number()), "{step:?}: {:?}", found.kept);
                // The store works as before.
                found.carry_out(Step::Set(77)).unwrap();
                assert_eq!(Board::start(found.flash).number(), Some(77), "{step:?}");
            }
        }
        board.carry_out(step).unwrap();
        assert_eq!(board.number(), after, "{step:?}");
    }
    assert!(count > 10_000, "{count} cuts: too little was written");
}

/// An erasure sets the bits of a page to one at different times.
#[test]
fn an_old_page_whose_retirement_and_erasure_were_cut_locks_nothing() {
    let board = Board::with_key(1);
    for (step, expected) in [(Step::Set(2), Some(2)), (Step::Clear, None)] {
        let retirement_is_cut = |flash: &Flash| {
            let is_begun = flash.is_written[(PLACE + RETIRED) / WORD];
            is_begun && flash.bytes[PLACE + RETIRED + WORD - 1] == 0xFF && flash.erasures == [0; PAGES]
        };
        let mut count = 0;
        for flash in cuts(&board.flash, step).into_iter().filter(retirement_is_cut) {
            // Before the erasure, the retirement is completed.
            let before = cuts(&flash, Step::Restart).into_iter().rfind(|flash| flash.erasures == [0; PAGES]);
            let before = before.unwrap_or(flash);
            for (eighths, seed) in (1..8).flat_map(|eighths| (0..100).map(move |seed| (eighths, seed))) {
                let mut flash = before.clone();
                flash.erase_eighths(PLACE / PAGE, eighths, seed);
                assert_eq!(Board::start(flash).number(), expected, "{step:?}, {eighths} eighths, {seed}");
                count += 1;
            }
        }
        assert!(count >= 7 * 700, "{count}");
    }
}

#[test]
fn what_is_kept_is_to_the_bit_what_was_asked_for() {
    let mut board = Board::start(Flash::new());
    let mut random = Pcg64Mcg::seed_from_u64(1);
    for _ in 0..1_000 {
        let (mut key, salt) = ([0; 16], random.next_u64());
        random.fill_bytes(&mut key);
        let set = block_on(board.store.set(key, salt, &mut board.flash));
        assert_eq!(set, Ok(StoredKey { key, seed: salt }));
        board = Board::start(board.flash);
        let seed = salt.wrapping_add(SEEDS_PER_START);
        assert!(
            board.kept == StoredKeyState::Key(StoredKey { key, seed }),
            "another key, or another number of starts"
        );
    }
}

#[test]
fn nothing_of_an_old_key_is_left() {
    for last in [Step::Set(2), Step::Clear] {
        let mut board = Board::with_key(0xA5);
        board.carry_out(last).unwrap();
        assert!(!board.flash.bytes.windows(4).any(|bytes| bytes == [0xA5; 4]), "{last:?}");
    }
}

#[test]
fn a_damaged_record_locks_whatever_it_said() {
    let mut cleared = Board::with_key(1);
    cleared.carry_out(Step::Clear).unwrap();
    for board in [Board::with_key(1), cleared] {
        let place =
            [PLACE, PLACE + PAGE].into_iter().find(|place| board.flash.is_written[place / WORD]).unwrap();
        for bit in 0..8 * BODY_BYTES {
            let mut flash = board.flash.clone();
            flash.bytes[place + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Board::start(flash).kept, StoredKeyState::Damaged, "bit {bit}");
        }
        let mut flash = board.flash.clone();
        flash.bytes[place..place + BODY_BYTES].fill(0xFF);
        assert_eq!(Board::start(flash).kept, StoredKeyState::Damaged, "its commit is still there");
        // The bytes after it are not part of a key.
        for bit in 8 * BODY_BYTES..8 * (HEAD_BYTES + 2 * WORD) {
            let mut flash = board.flash.clone();
            flash.bytes[place + bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Board::start(flash).number(), board.number(), "bit {bit}");
        }
    }
}

#[test]
fn no_start_has_the_seed_of_another_one() {
    let mut board = Board::with_key(1);
    let mut seeds = BTreeSet::new();
    for start in 0..5_000 {
        let StoredKeyState::Key(StoredKey { seed, .. }) = board.kept else { panic!("{:?}", board.kept) };
        assert!(seeds.range(seed..seed + SEEDS_PER_START).next().is_none(), "start {start}");
        seeds.insert(seed);
        // Some starts are interrupted while writing the mark.
        let power = (start % 7 == 0).then_some(start % 9);
        let cut = Board::start(Flash { power, ..board.flash });
        board = Board::start(Flash { power: None, ..cut.flash });
    }
    // Two starts per iteration. A page of an STM32G4 endures 10 000 erasures: 3 million starts.
    let most = *board.flash.erasures.iter().max().unwrap();
    assert!(most <= 33, "{:?}", board.flash.erasures);
}

#[test]
fn a_start_that_cannot_be_counted_is_locked() {
    let board = Board::with_key(1);
    for power in 0..WORD {
        let flash = Flash { power: Some(power), ..board.flash.clone() };
        assert_eq!(Board::start(flash).kept, StoredKeyState::Damaged, "{power} bytes of its mark");
    }
}

#[test]
fn schemes_that_are_garbage_and_erased_take_no_key_with_them() {
    let Board { mut flash, .. } = Board::with_key(3);
    flash.bytes[..PLACE].fill(0x5A);
    flash.is_written[..PLACE / WORD].fill(true);
    let mut schemes = SchemeStore::new(flash, 0..KEYS.start).unwrap();
    assert!(schemes.open().is_err());
    block_on(schemes.save(&[1, 2, 3])).unwrap();
    let flash = schemes.into_flash();
    assert!(flash.erasures[0] > 0, "{:?}", flash.erasures);
    assert_eq!(Board::start(flash).number(), Some(3));
}

#[test]
fn only_two_whole_pages_are_taken() {
    for range in [0..4095, 0..2048, 0..8192, 8..4104] {
        assert!(KeyStore::new::<Flash>(range.clone()).is_none(), "{range:?}");
    }
}
