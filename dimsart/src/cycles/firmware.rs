//! A firmware image for measurements and bounds: entry points and board.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::cycles::image::Image;
use boards::BOARDS;
use boards::catalogue::BoardInfo;
use dimsart_core::stamp::UNSTAMPED_SUFFIX;

use super::{CyclesError, Memory};
use hil_sim::emulated::{BOARD, IMAGE_FOLDER_VARIABLE, built};
use hil_sim::untrusted_text::escape_line;

/// Functions that call a module, in the image.
const COMPUTE: [&str; 2] =
    ["dimsart_core::module::kind::compute", "dimsart_core::module::kind::compute_late"];
/// Such a function in an image with the feature `measure`.
const TIMED: &str = "firmware::measure::timed";
/// Function that applies a command.
const COMMAND: &str = "dimsart_core::engine::Engine::command";
/// Larger than any board's memory.
const MAX_CONTROLLER_BYTES: u32 = 1 << 24;
/// Maximum length of an image's name.
const MAX_NAME_BYTES: u32 = 100;

/// A firmware image.
#[derive(Debug, Clone)]
pub struct Firmware {
    /// The file.
    pub path: PathBuf,
    /// Its content.
    pub image: Arc<Image>,
    /// Its name: version, board and features.
    pub name: String,
    /// Clock of the board's processor.
    pub clock_hz: u32,
    /// Ticks per second.
    pub tick_hz: u32,
    /// Memory of a controller.
    pub(super) controller_bytes: u32,
    /// Initial stack pointer.
    pub(super) stack_top: u32,
    pub(super) entry: EntryPoints,
    /// Functions called once per module and stage.
    pub(super) compute: BTreeSet<u32>,
    /// Function that applies a command.
    pub(super) command: u32,
}

/// Addresses of the functions in `firmware/src/entry_points.rs`.
#[derive(Debug, Clone, Copy)]
pub(super) struct EntryPoints {
    pub(super) connect: u32,
    pub(super) limit: u32,
    pub(super) load: u32,
    pub(super) read: u32,
    pub(super) deliver: u32,
    pub(super) tick: u32,
    pub(super) take: u32,
}

impl Firmware {
    /// Reads the image at `given`, else of `board` in the folder of the variable `DIMSART_FIRMWARE`, else the image built last.
    ///
    /// # Errors
    /// [`CyclesError`] if there is no image, or it is for another board.
    pub fn find(given: Option<&Path>, board: Option<&str>) -> Result<Self, CyclesError> {
        let path = match (given, env::var_os(IMAGE_FOLDER_VARIABLE)) {
            (Some(path), _) => path.to_owned(),
            (None, Some(folder)) => Path::new(&folder).join(board.unwrap_or(BOARD)),
            (None, None) => built(),
        };
        if !path.is_file() {
            return Err(CyclesError::NoImage { path, board: board.unwrap_or("BOARD").to_owned() });
        }
        let bytes =
            fs::read(&path).map_err(|source| CyclesError::Unreadable { path: path.clone(), source })?;
        let image = match Image::read(&bytes) {
            Ok(image) => image,
            Err(source) => return Err(CyclesError::NotAnImage { path, source }),
        };
        let firmware = Self::new(path, image)?;
        match board {
            Some(board) if !firmware.features().any(|feature| feature == board) => {
                let Self { path, name, .. } = firmware;
                Err(CyclesError::OtherBoard { path, found: name, wanted: board.to_owned() })
            }
            _ => Ok(firmware),
        }
    }

    /// Finds the image with this name, stamped or not: at `given`, else in the folder of the variable `DIMSART_FIRMWARE`,
    /// else the image built last.
    ///
    /// # Errors
    /// [`CyclesError`] if there is no such image.
    pub fn find_by_name(given: Option<&Path>, name: &str) -> Result<Self, CyclesError> {
        let name = name.trim_end_matches(UNSTAMPED_SUFFIX);
        let folder = env::var_os(IMAGE_FOLDER_VARIABLE).filter(|_| given.is_none());
        let Some(folder) = folder.map(PathBuf::from) else {
            let firmware = Self::find(given, None)?;
            return match firmware.name == name {
                true => Ok(firmware),
                false => {
                    let Self { path, name: found, .. } = firmware;
                    Err(CyclesError::ImageMismatch { path, found, runs: name.to_owned() })
                }
            };
        };
        let files = fs::read_dir(&folder)
            .map_err(|source| CyclesError::Unreadable { path: folder.clone(), source })?;
        let mut paths: Vec<PathBuf> = files.flatten().map(|file| file.path()).collect();
        paths.sort();
        let is_named = |path: &PathBuf| {
            let bytes = fs::read(path).unwrap_or_default();
            !name.is_empty() && bytes.windows(name.len()).any(|part| part == name.as_bytes())
        };
        let candidates = paths.into_iter().filter(is_named);
        let mut found = candidates.filter_map(|path| Self::find(Some(&path), None).ok());
        found
            .find(|firmware| firmware.name == name)
            .ok_or_else(|| CyclesError::ImageNotFound { folder, name: name.to_owned() })
    }

    fn new(path: PathBuf, image: Image) -> Result<Self, CyclesError> {
        let Some((name, clock_hz, tick_hz, controller_bytes)) = facts(&image) else {
            return Err(CyclesError::NotDimsart { path });
        };
        let lacks = |what: &str| CyclesError::NoEntry { path: path.clone(), what: what.to_owned() };
        let entry = |name: &str| {
            let found = image.function(name).map(|function| function.address);
            found.ok_or_else(|| lacks(name))
        };
        let entry = EntryPoints {
            connect: entry("dimsart_connect")?,
            limit: entry("dimsart_limit")?,
            load: entry("dimsart_load")?,
            read: entry("dimsart_read")?,
            deliver: entry("dimsart_deliver")?,
            tick: entry("dimsart_tick")?,
            take: entry("dimsart_take")?,
        };
        let named = |is_one: fn(&str) -> bool| {
            let functions = image.functions.values();
            functions
                .filter(move |function| function.names.iter().any(|name| is_one(name)))
                .map(|function| function.address)
        };
        let timed: BTreeSet<u32> = named(|name| name.starts_with(TIMED)).collect();
        // Only in images with the feature `measure`.
        let compute: BTreeSet<u32> = match timed.is_empty() {
            false => timed,
            true => named(is_compute).collect(),
        };
        if compute.is_empty() {
            return Err(lacks("the compute function of modules"));
        }
        let command = named(|name| name == COMMAND).next();
        let command = command.ok_or_else(|| lacks("Engine::command"))?;
        let stack_top = *image.symbols.get("_stack_start").ok_or_else(|| lacks("_stack_start"))? & !7;
        Ok(Self {
            controller_bytes,
            stack_top,
            entry,
            compute,
            command,
            name,
            clock_hz,
            tick_hz,
            path,
            image: Arc::new(image),
        })
    }

    /// Returns the period of a tick, cycles.
    #[must_use]
    pub fn budget_cycles(&self) -> u64 {
        u64::from(self.clock_hz / self.tick_hz.max(1))
    }

    /// Returns its board, if known.
    pub(crate) fn board(&self) -> Option<&'static BoardInfo> {
        BOARDS.iter().find(|board| self.features().any(|feature| feature == board.name))
    }

    /// Returns the memory from which its board runs it; zero wait states for an unknown board.
    #[must_use]
    pub fn memory(&self) -> Memory {
        self.board().map_or(Memory::ZeroWait, |board| Memory::of_board(board.name))
    }

    /// Features of the image, including the board.
    fn features(&self) -> impl Iterator<Item = &str> {
        self.name.rsplit(' ').next().unwrap_or_default().split('+')
    }
}

/// Whether a function calls a module; newer compilers append the module's name.
fn is_compute(name: &str) -> bool {
    let name = name.split_once("::<").map_or(name, |(function, _)| function);
    COMPUTE.iter().any(|compute| name.ends_with(compute))
}

/// Reads name, clock, ticks per second and bytes of a controller from the image.
fn facts(image: &Image) -> Option<(String, u32, u32, u32)> {
    let address = *image.symbols.get("dimsart_image")?;
    let word = |index: u32| -> Option<u32> {
        let bytes = image.bytes(address.checked_add(4 * index)?, 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    };
    let [clock_hz, tick_hz, text, length] = [word(0)?, word(1)?, word(2)?, word(3)?];
    let controller_bytes = word(4).filter(|bytes| *bytes <= MAX_CONTROLLER_BYTES)?;
    let length = usize::try_from(Some(length).filter(|bytes| *bytes <= MAX_NAME_BYTES)?).ok()?;
    let name = escape_line(std::str::from_utf8(image.bytes(text, length)?).ok()?);
    Some((name, clock_hz, tick_hz, controller_bytes)).filter(|_| tick_hz > 0)
}
