//! Errors of cycle measurements and bounds.

use std::io;
use std::path::PathBuf;

use ::cycles::AccessError;
use ::cycles::bound::BoundError;
use ::cycles::image::ImageError;
use ::cycles::machine::MachineError;
use dimsart_core::CommandError;

use hil_sim::experiment::ExperimentError;

/// Errors of cycle measurements and bounds.
#[derive(Debug, thiserror::Error)]
pub enum CyclesError {
    /// No image at this path.
    #[error(
        "no firmware image {}: build it with `cargo board {board}`{}, or give the path of an ELF",
        path.display(),
        known_boards(board)
    )]
    NoImage {
        /// Path of the missing image.
        path: PathBuf,
        /// The board.
        board: String,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {source}; give the path of a firmware image", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// System error.
        source: io::Error,
    },
    /// Not an ELF, or not analysable.
    #[error("cannot read image {}: {source}", path.display())]
    NotAnImage {
        /// The file.
        path: PathBuf,
        /// The error.
        source: ImageError,
    },
    /// An ELF of another program or version.
    #[error(
        "{} is not DIMSART firmware of this version (`dimsart_image` missing): build an image with `cargo board BOARD`",
        path.display()
    )]
    NotDimsart {
        /// The file.
        path: PathBuf,
    },
    /// An image of another board.
    #[error(
        "{} is `{found}`, not an image of {wanted}: build it with `cargo board {wanted}` (boards: boards/src)",
        path.display()
    )]
    OtherBoard {
        /// The file.
        path: PathBuf,
        /// Name of the image.
        found: String,
        /// Requested board.
        wanted: String,
    },
    /// Another image than the controller's.
    #[error(
        "the controller runs `{runs}`, but {} is `{found}`: give the ELF that was flashed, or flash this ELF",
        path.display()
    )]
    ImageMismatch {
        /// The file.
        path: PathBuf,
        /// Name of the image.
        found: String,
        /// Name of the controller's image.
        runs: String,
    },
    /// The controller's image is not in the folder.
    #[error("{} does not contain the controller's image `{name}`: give the ELF that was flashed", folder.display())]
    ImageNotFound {
        /// The folder.
        folder: PathBuf,
        /// Name of the controller's image.
        name: String,
    },
    /// The controller's scheme does not run on the host.
    #[error("the controller's scheme does not run on the simulated device: {0}")]
    HostScheme(String),
    /// A function is missing.
    #[error(
        "{} lacks {what}, because it was built from other sources: rebuild the image with `cargo board BOARD`",
        path.display()
    )]
    NoEntry {
        /// The file.
        path: PathBuf,
        /// The function.
        what: String,
    },
    /// The experiment is invalid.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The scheme is too long.
    #[error("the scheme exceeds the {most} bytes that a board stores: remove rows", most = dimsart_link::saved_scheme::MAX_SCHEME_BYTES)]
    SchemeTooLong,
    /// The image has other modules than this command.
    #[error(
        "image and command differ in modules, parameters or data types: rebuild both from the same sources \
         (`cargo board BOARD`)"
    )]
    IncompatibleImage,
    /// The image refuses a scheme that runs on the host.
    #[error(
        "the scheme runs on the host, but the board's Data Base is too small for it: command {command} was refused; \
         use fewer modules or axes"
    )]
    Refused {
        /// Its number, from 1.
        command: u32,
    },
    /// Too many bytes.
    #[error("a packet or scheme of {bytes} bytes is too long: remove signals or rows")]
    TooManyBytes {
        /// Their number.
        bytes: usize,
    },
    /// A function of the image failed in the emulator.
    #[error("{what} failed in the emulator: {source}")]
    Machine {
        /// The function.
        what: &'static str,
        /// Where and why.
        source: MachineError,
    },
    /// Emulated memory is missing.
    #[error("cannot access emulated memory: {0}")]
    Access(AccessError),
    /// Image and host differ.
    #[error(
        "in tick {tick} the image's {what} differs from the host's: {found}, not {expected}; rebuild both from the same \
         sources, or report a bug"
    )]
    Differs {
        /// The tick, from 0.
        tick: u64,
        /// The data that differ.
        what: &'static str,
        /// Data of the host.
        expected: String,
        /// Data of the image.
        found: String,
    },
    /// No bound was found.
    #[error("no bound: {source}")]
    Unbounded {
        /// Where and why.
        source: BoundError,
    },
    /// The device of a small scheme is invalid.
    #[error(transparent)]
    Device(#[from] dimsart_core::DescriptorError),
    /// A small scheme around a module does not run.
    #[error("the test scheme of a module does not run: {0}; correct dimsart/src/cycles/scheme_bound.rs")]
    Scheme(CommandError),
    /// A row of such a scheme is invalid.
    #[error(
        "invalid row `{row}` in the test scheme of a module: {reason}; correct dimsart/src/cycles/scheme_bound.rs"
    )]
    Row {
        /// The row.
        row: String,
        /// The reason.
        reason: String,
    },
    /// The cost of a tick without modules is unknown or exceeds a stamp's range.
    #[error("the cost of a tick is unknown or exceeds the range of a stamp: report a bug")]
    NoTick,
    /// Calls of modules cannot be matched.
    #[error("tick {tick}: {found} module calls observed, {expected} expected; report a bug")]
    Calls {
        /// The tick, from 0.
        tick: u64,
        /// Calls on the host.
        expected: usize,
        /// Calls in the image.
        found: usize,
    },
}

/// The names of all boards, in place of an unknown board.
fn known_boards(board: &str) -> String {
    if boards::BOARDS.iter().any(|known| known.name == board) {
        return String::new();
    }
    format!(" (boards: {})", crate::budget::names())
}
