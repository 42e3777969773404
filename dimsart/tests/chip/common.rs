//! A board for a test, and its command line.

use std::sync::{Arc, MutexGuard};
use std::time::Duration;

pub(crate) use chips::CommandLine;
use chips::{Bench, Board, OnBench, SharedBoard};
use cycles::image::Image;
use dimsart::connect::{Device, Timeouts};

/// Timeouts for a board that is slower than real time, also on a busy computer.
pub(crate) const PATIENCE: Timeouts = Timeouts { timeout: Duration::from_secs(20), tries: 3 };

/// Returns the board of a name on the bench, with its image; `None` without images.
pub(crate) fn bench(name: &str) -> Option<Bench> {
    let board = Board::find(name).unwrap();
    Some(Bench::new(board, image(name)?).unwrap())
}

/// Returns the board of a name on the bench, with another image.
pub(crate) fn bench_of(name: &str, image: Arc<Image>) -> Bench {
    Bench::new(Board::find(name).unwrap(), image).unwrap()
}

/// A board that a test and its command line share.
#[derive(Debug)]
pub(crate) struct Shared<W = Bench>(SharedBoard<W>);

impl Shared {
    /// Returns the board of a name on the bench, with its image; `None` without images.
    pub(crate) fn start(name: &str) -> Option<Self> {
        bench(name).map(Self::of)
    }
}

impl<W: OnBench> Shared<W> {
    pub(crate) fn of(world: W) -> Self {
        Self(SharedBoard::new(world))
    }

    pub(crate) fn bench(&self) -> MutexGuard<'_, W> {
        self.0.bench()
    }

    /// Advances the time.
    pub(crate) fn run_for(&self, duration_s: f64) {
        self.bench().run_for(duration_s).unwrap();
    }

    /// Identifies the device.
    pub(crate) fn identify(&self) -> Device<CommandLine<W>> {
        Device::identify(self.0.line(), PATIENCE, dimsart_modules::ALL).unwrap()
    }

    /// Checks the board against the chip's rules.
    #[track_caller]
    pub(crate) fn assert_sound(&self) {
        let mut world = self.bench();
        let bench = world.bench();
        assert_eq!(bench.violations(), [] as [&str; 0]);
        assert_eq!(bench.processor.faults(), []);
    }
}

/// Returns an image by its name.
pub(crate) fn image(name: &str) -> Option<Arc<Image>> {
    let bytes = std::fs::read(test_requirements::image(name)?).unwrap();
    Some(Arc::new(Image::read(&bytes).unwrap()))
}
