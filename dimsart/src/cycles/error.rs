//! Why a controller's cycles cannot be said: what is wrong, where, and what to do next.

use std::io;
use std::path::PathBuf;

use ::cycles::AccessError;
use ::cycles::bound::BoundError;
use ::cycles::image::ImageError;
use ::cycles::machine::MachineError;
use dimsart_core::CommandError;

use hil_sim::experiment::ExperimentError;

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
pub enum CyclesError {
    /// Nothing to read.
    #[error(
        "there is no firmware image {}; build it with `cargo board {board}`, or give the path of an ELF",
        path.display()
    )]
    NoImage {
        /// Where it was looked for.
        path: PathBuf,
        /// The board.
        board: String,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}; give the path of a firmware image", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// No ELF, or none that can be analysed.
    #[error("{} is no image that can be read: {source}", path.display())]
    NotAnImage {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ImageError,
    },
    /// The ELF of something else.
    #[error(
        "{} is no DIMSART firmware of this version (it has no `dimsart_image`); build one with `cargo board BOARD`",
        path.display()
    )]
    NotDimsart {
        /// The file.
        path: PathBuf,
    },
    /// An image of another board.
    #[error(
        "{} is `{found}`, no image of {wanted}; build that with `cargo board {wanted}` (boards/src has a file per \
         board)",
        path.display()
    )]
    OtherBoard {
        /// The file.
        path: PathBuf,
        /// What it calls itself.
        found: String,
        /// The board that was asked for.
        wanted: String,
    },
    /// An image other than the one that a controller runs.
    #[error(
        "the controller runs `{runs}`, and {} is `{found}`: give the ELF that was flashed, or flash this one",
        path.display()
    )]
    OtherThanRuns {
        /// The file.
        path: PathBuf,
        /// What it calls itself.
        found: String,
        /// What the controller calls itself.
        runs: String,
    },
    /// No image in a folder is the one that a controller runs.
    #[error("no image in {} is `{name}`, which the controller runs: give the ELF that was flashed", folder.display())]
    NoneOfThatName {
        /// The folder.
        folder: PathBuf,
        /// What the controller calls itself.
        name: String,
    },
    /// A controller's scheme that does not run here.
    #[error("the controller's scheme does not run on the simulated device: {0}")]
    SchemeHere(String),
    /// A function that is called is not there.
    #[error("{} has no {what}: it was built from other sources; build it again with `cargo board BOARD`", path.display())]
    NoEntry {
        /// The file.
        path: PathBuf,
        /// The function.
        what: String,
    },
    /// The experiment whose inputs are taken cannot be made.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The scheme does not fit into what a board keeps.
    #[error("the scheme takes more than the {most} bytes that a board keeps; make it shorter", most = dimsart_link::saved_scheme::MAX_SCHEME_BYTES)]
    SchemeTooLong,
    /// The image knows other modules.
    #[error(
        "the image has other modules, parameters or data types than this command: build both from the same sources \
         (`cargo board BOARD`)"
    )]
    OtherImage,
    /// The image refuses the scheme, which runs here.
    #[error(
        "the image refuses command {command} of the scheme, which runs on a host: the board's Data Base is too small \
         for it"
    )]
    Refused {
        /// Its number, from 1.
        command: u32,
    },
    /// More bytes than a function is given.
    #[error("{bytes} bytes are more than a packet or a scheme can have")]
    TooManyBytes {
        /// Their number.
        bytes: usize,
    },
    /// A function of the image did what is not modelled.
    #[error("{what} did not come to its end: {source}")]
    Machine {
        /// What was called.
        what: &'static str,
        /// Where and why.
        source: MachineError,
    },
    /// Memory that should be there.
    #[error("the emulated memory: {0}")]
    Access(AccessError),
    /// The image computes something else than the host.
    #[error(
        "in tick {tick} the image's {what} differs from the host's: {found}, not {expected}; build both from the same \
         sources, or report this as a bug"
    )]
    Differs {
        /// The tick, from 0.
        tick: u64,
        /// What differs.
        what: &'static str,
        /// What the host has.
        expected: String,
        /// What the image has.
        found: String,
    },
    /// There is no worst case, or none that is found.
    #[error("no bound: {source}")]
    Unbounded {
        /// Where and why.
        source: BoundError,
    },
    /// The device of a small scheme cannot be made.
    #[error(transparent)]
    Device(#[from] dimsart_core::DescriptorError),
    /// A small scheme around a module does not run.
    #[error("a scheme around the module does not run: {0}; see dimsart/src/cycles/scheme_bound.rs")]
    Scheme(CommandError),
    /// A row of such a scheme that is not understood.
    #[error("`{row}`, a row of a scheme around a module: {reason}; see dimsart/src/cycles/scheme_bound.rs")]
    Row {
        /// The row.
        row: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Not even a tick without modules has a cost that a stamp can hold.
    #[error("no cost of a tick was found, or one of more cycles than a stamp can hold: report this as a bug")]
    NoTick,
    /// Modules that are called cannot be told apart.
    #[error("in tick {tick} {found} calls of modules were seen in place of {expected}: report this as a bug")]
    Calls {
        /// The tick, from 0.
        tick: u64,
        /// Calls of the controller here.
        expected: usize,
        /// Calls that were seen.
        found: usize,
    },
}
