//! A board for a test, and its command line.

use std::io::{self, ErrorKind, Read, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

use chips::{Bench, Board};
use cycles::image::Image;
use dimsart::connect::{Device, Patience};

/// What a read of the command line waits, `s` of the board's time.
const READ_S: f64 = 1e-3;

/// The board of a name on the bench, with its image; none where no images are.
pub(crate) fn bench(name: &str) -> Option<Bench> {
    let board = Board::named(name).unwrap();
    Some(Bench::new(board, image(name)?).unwrap())
}

/// A board on the bench, with what is around it.
pub(crate) trait OnBench {
    /// The board.
    fn bench(&mut self) -> &mut Bench;
    /// Lets so much time pass.
    fn run_for(&mut self, duration_s: f64);
}

impl OnBench for Bench {
    fn bench(&mut self) -> &mut Bench {
        self
    }

    fn run_for(&mut self, duration_s: f64) {
        Self::run_for(self, duration_s).unwrap();
    }
}

/// The board of a name on the bench, with another image.
pub(crate) fn bench_of(name: &str, image: Arc<Image>) -> Bench {
    Bench::new(Board::named(name).unwrap(), image).unwrap()
}

/// A board that a test and its command line share.
#[derive(Debug)]
pub(crate) struct Shared<W = Bench>(Arc<Mutex<W>>);

impl<W> Clone for Shared<W> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl Shared {
    /// The board of a name on the bench, with its image; none where no images are.
    pub(crate) fn start(name: &str) -> Option<Self> {
        bench(name).map(Self::of)
    }

    pub(crate) fn bench(&self) -> MutexGuard<'_, Bench> {
        self.lock()
    }
}

impl<W: OnBench> Shared<W> {
    pub(crate) fn of(world: W) -> Self {
        Self(Arc::new(Mutex::new(world)))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, W> {
        self.0.lock().unwrap()
    }

    /// Lets so much time pass.
    pub(crate) fn run_for(&self, duration_s: f64) {
        self.lock().run_for(duration_s);
    }

    /// Asks who is there.
    pub(crate) fn greet(&self) -> Device<CommandLine<W>> {
        let line = CommandLine { board: self.clone(), rest: Vec::new() };
        Device::greet(line, Patience::default()).unwrap()
    }

    /// Holds the board to the chip's rules.
    #[track_caller]
    pub(crate) fn assert_sound(&self) {
        let mut world = self.lock();
        let bench = world.bench();
        assert_eq!(bench.violations(), [] as [&str; 0]);
        assert_eq!(bench.processor.faults(), []);
    }
}

/// The host's end of a board's command line. Who reads lets the board's time pass.
#[derive(Debug)]
pub(crate) struct CommandLine<W = Bench> {
    board: Shared<W>,
    rest: Vec<u8>,
}

impl<W: OnBench> Read for CommandLine<W> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let mut world = self.board.lock();
            world.run_for(READ_S);
            self.rest = world.bench().received();
        }
        if self.rest.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.rest.as_slice().read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl<W: OnBench> Write for CommandLine<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.board.lock().bench().send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// An image by its name.
pub(crate) fn image(name: &str) -> Option<Arc<Image>> {
    let bytes = std::fs::read(image_file(name)?).unwrap();
    Some(Arc::new(Image::read(&bytes).unwrap()))
}

/// The file of an image; none, after a line that says so, where no images are.
pub(crate) fn image_file(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("DIMSART_FIRMWARE");
    let is_required = folder.is_some();
    let file = folder.map_or_else(|| PathBuf::from("../target/images"), PathBuf::from).join(name);
    if file.exists() {
        return Some(file);
    }
    assert!(!is_required, "{} is missing", file.display());
    eprintln!("skipped: no image {}; `cargo xtask test` builds it", file.display());
    None
}
