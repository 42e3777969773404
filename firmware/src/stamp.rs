//! Data stamped into the image after linking: its scheme and its modules' costs.
#![expect(unsafe_code, reason = "a host tool finds the stamp by name and changes it in the image")]

use dimsart_core::Dimsart;
use dimsart_core::online::OPCODE_COUNT;
use dimsart_core::stamp::{Stamp, text};

use crate::modules::{COUNT, IDS, RUNS_PROGRAMS};

/// Lines for the tick, module kinds and instructions of laws.
const LINES: usize = 1 + COUNT + if RUNS_PROGRAMS { OPCODE_COUNT } else { 0 };
type BoardStamp = Stamp<LINES, COUNT>;

/// The built-in scheme, encoded by the build.
const SCHEME: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/built-in-scheme"));
/// Identifies the image: version and board.
pub(crate) const IMAGE: &str = env!("DIMSART_IMAGE");

#[used]
#[unsafe(export_name = "dimsart_stamp")]
static STAMP: BoardStamp = Stamp {
    compiler: text(env!("DIMSART_COMPILER")),
    scheme_name: text(env!("DIMSART_SCHEME")),
    ..Stamp::unstamped(env!("DIMSART_SIDE"), SCHEME, IDS)
};

static PLACE: &BoardStamp = &STAMP;

/// Returns the current stamp.
pub(crate) fn stamp() -> &'static BoardStamp {
    // SAFETY: always a valid reference. A volatile read, so that the compiler does not assume the initial
    // value.
    unsafe { (&raw const PLACE).read_volatile() }
}

/// Returns the image's name, with a note if it is not stamped.
pub(crate) fn described() -> &'static str {
    if stamp().costs().is_some() { IMAGE } else { concat!(env!("DIMSART_IMAGE"), " unstamped") }
}

/// Limits modules by their stamped costs; without a stamp, admits all.
#[unsafe(export_name = "dimsart_limit")]
#[inline(never)]
pub(crate) extern "C" fn limit(dimsart: &mut Dimsart) {
    let stamp = stamp();
    let engine = dimsart.engine_mut();
    engine.set_cycle_limit(stamp.limit_cycles());
    engine.set_costs(stamp.costs());
}

/// Logs the stamp.
pub(crate) fn log() {
    let stamp = stamp();
    match stamp.costs() {
        Some(_) => {
            defmt::info!("tick limit {} cycles, memory {=[u8]:a}", stamp.limit_cycles, stamp.memory)
        }
        None => defmt::warn!(
            "image not stamped: module costs unknown, tick time not limited; run `dimsart stamp`"
        ),
    }
}
