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

/// The board of a name on the bench, with another image.
pub(crate) fn bench_of(name: &str, image: Arc<Image>) -> Bench {
    Bench::new(Board::named(name).unwrap(), image).unwrap()
}

/// A board that a test and its command line share.
#[derive(Debug, Clone)]
pub(crate) struct Shared(Arc<Mutex<Bench>>);

impl Shared {
    /// The board of a name on the bench, with its image; none where no images are.
    pub(crate) fn start(name: &str) -> Option<Self> {
        Some(Self(Arc::new(Mutex::new(bench(name)?))))
    }

    pub(crate) fn bench(&self) -> MutexGuard<'_, Bench> {
        self.0.lock().unwrap()
    }

    /// Lets so much time pass.
    pub(crate) fn run_for(&self, duration_s: f64) {
        self.bench().run_for(duration_s).unwrap();
    }

    /// Asks who is there.
    pub(crate) fn greet(&self) -> Device<CommandLine> {
        let line = CommandLine { board: self.clone(), rest: Vec::new() };
        Device::greet(line, Patience::default()).unwrap()
    }

    /// Holds the board to the chip's rules.
    #[track_caller]
    pub(crate) fn assert_sound(&self) {
        let bench = self.bench();
        assert_eq!(bench.violations(), [] as [&str; 0]);
        assert_eq!(bench.processor.faults(), []);
    }
}

/// The host's end of a board's command line. Who reads lets the board's time pass.
#[derive(Debug)]
pub(crate) struct CommandLine {
    board: Shared,
    rest: Vec<u8>,
}

impl Read for CommandLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let mut bench = self.board.bench();
            bench.run_for(READ_S).unwrap();
            self.rest = bench.received();
        }
        if self.rest.is_empty() {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.rest.as_slice().read(buffer)?;
        self.rest.drain(..count);
        Ok(count)
    }
}

impl Write for CommandLine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.board.bench().send(bytes);
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
