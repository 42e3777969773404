//! Schemes that every board's image refuses by its stamp.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::process::Command;

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use cycles::timing::{Column, Profile, Timing};
use dimsart::budget::Budget;
use dimsart::cycles::{Controller, CyclesError, Firmware, Memory};
use dimsart::stamp::StampedImage;
use dimsart_core::{Costs, Dimsart, KindId, ModuleKind, ProvidedMemory};
use dimsart_link::saved_scheme;
use dimsart_modules::{ALL, group_of};
use hil_sim::schemes::device;
use hil_sim::schemes::{self, SchemeText};

const DOF: usize = 3;

/// The boards' stamped images.
fn images() -> Vec<(&'static BoardInfo, PathBuf)> {
    let image = |board: &'static BoardInfo| Some((board, test_requirements::stamped_image(board.name)?));
    BOARDS.iter().filter_map(image).collect()
}

/// The shipped master, on a controller that admits modules as the image does.
fn shipped(image: &StampedImage) -> Dimsart {
    let mut dimsart =
        Dimsart::new(ProvidedMemory::leak_default(), device("master", DOF, 1e-3).unwrap(), ALL).unwrap();
    dimsart.engine_mut().set_costs(image.costs().map(|costs| Costs::new(costs.leak(), image.kinds().leak())));
    dimsart.engine_mut().set_cycle_limit(NonZeroU32::new(image.limit_cycles()));
    let scheme = SchemeText::read("builtin:bilateral").unwrap();
    assert!(schemes::load(&scheme, "master", &[], &mut dimsart).is_valid());
    dimsart
}

/// Sends a scheme to the image's functions, with the limit of its stamp.
fn load(image: &Path, scheme: &[u8]) -> Result<(), CyclesError> {
    let firmware = Firmware::find(Some(image), None).unwrap();
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    let mut controller = Controller::new(&firmware, timing, DOF).unwrap();
    controller.enable_tick_limit().unwrap();
    controller.load(scheme).map(|_| ())
}

#[test]
fn every_board_s_stamp_knows_every_kind_and_takes_the_shipped_scheme_by_the_board_s_share() {
    for (info, path) in images() {
        let board = info.name;
        let (image, budget) = (StampedImage::read(&path).unwrap(), Budget::of(board).unwrap());
        assert_eq!(image.memory().as_deref(), Some(Memory::of_board(board).name()), "{board}");
        assert_eq!(image.limit_cycles(), budget.period_cycles() / 100 * budget.tick_percent, "{board}");
        assert!(!image.compiler().is_empty(), "{board}");
        let costs = image.costs().unwrap();
        assert!(costs.first().is_some_and(|cost| cost.cycles(1) > 0), "{board}: {costs:?}");
        let of_groups = |kind: &&&ModuleKind| group_of(kind.id).is_some_and(|group| info.has_group(group));
        let expected: Vec<KindId> = ALL.list().iter().filter(of_groups).map(|kind| kind.id).collect();
        assert_eq!(image.kinds(), expected, "{board}");
        assert!(costs[1..=expected.len()].iter().all(|cost| cost.cycles(1) > 0), "{board}: {costs:?}");
        let scheme = saved_scheme::save(shipped(&image).engine_mut()).unwrap();
        load(&path, &scheme).unwrap();
    }
}

#[test]
fn every_board_refuses_a_scheme_that_takes_a_cycle_more_than_its_stamp_lets_it() {
    let folder = tempfile::tempdir().unwrap();
    for (BoardInfo { name: board, .. }, path) in images() {
        let mut image = StampedImage::read(&path).unwrap();
        let mut dimsart = shipped(&image);
        let scheme = saved_scheme::save(dimsart.engine_mut()).unwrap();
        let cycles = dimsart.engine().tick_cycles().unwrap();
        let (costs, memory) = (image.costs().unwrap(), image.memory().unwrap());
        let other = folder.path().join(board);
        for (limit, is_taken) in [(cycles, true), (cycles - 1, false)] {
            image.set_costs(&costs, &memory, limit).unwrap();
            image.write(&other).unwrap();
            let loaded = load(&other, &scheme);
            assert_eq!(loaded.is_ok(), is_taken, "{board}: {loaded:?}");
            assert!(is_taken || matches!(loaded, Err(CyclesError::Refused { .. })), "{board}: {loaded:?}");
        }
    }
}

#[test]
fn an_image_that_is_not_stamped_refuses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (BoardInfo { name: board, .. }, path) in images() {
        let mut image = StampedImage::read(&path).unwrap();
        let scheme = saved_scheme::save(shipped(&image).engine_mut()).unwrap();
        let costs = image.costs().unwrap();
        image.set_costs(&costs, "", 1).unwrap();
        assert_eq!((image.memory(), image.costs()), (None, None));
        let other = folder.path().join(board);
        image.write(&other).unwrap();
        load(&other, &scheme).unwrap();
    }
}

#[test]
fn a_missing_image_is_told_and_no_json_is_printed() {
    let missing =
        Command::new(env!("CARGO_BIN_EXE_dimsart")).args(["stamp", "no.elf", "--json"]).output().unwrap();
    assert!(missing.status.code() == Some(1) && missing.stdout.is_empty(), "{missing:?}");
    assert!(String::from_utf8(missing.stderr).unwrap().contains("no.elf"));
}
