//! What is put into this image after it was linked: its scheme, and what its modules cost.
#![expect(
    unsafe_code,
    reason = "a host tool finds the stamp by its name, and changes it behind the compiler's back"
)]

use dimsart_core::Dimsart;
use dimsart_core::online::OPCODES;
use dimsart_core::stamp::{Stamp, text};

use crate::modules::{COUNT, IDS, RUNS_PROGRAMS};

/// The tick, kinds of modules, instructions of laws.
const LINES: usize = 1 + COUNT + if RUNS_PROGRAMS { OPCODES } else { 0 };
type BoardStamp = Stamp<LINES, COUNT>;

/// As the build has made it of the scheme's text.
const SCHEME: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/built-in-scheme"));
/// Tells this image from every other one: version and board.
pub(crate) const IMAGE: &str = env!("DIMSART_IMAGE");

#[used]
#[unsafe(export_name = "dimsart_stamp")]
static STAMP: BoardStamp = Stamp {
    compiler: text(env!("DIMSART_COMPILER")),
    scheme_name: text(env!("DIMSART_SCHEME")),
    ..Stamp::unstamped(env!("DIMSART_SIDE"), SCHEME, IDS)
};

static PLACE: &BoardStamp = &STAMP;

/// The stamp as it is in this image now.
pub(crate) fn stamp() -> &'static BoardStamp {
    // SAFETY: it always holds a reference. Read like this the compiler cannot know whose, and takes nothing of what the
    // stamp was at first for granted.
    unsafe { (&raw const PLACE).read_volatile() }
}

/// The image's name, and that it is not stamped where it is not.
pub(crate) fn described() -> &'static str {
    if stamp().costs().is_some() { IMAGE } else { concat!(env!("DIMSART_IMAGE"), " unstamped") }
}

/// Has a controller admit modules by the stamp; without one, all of them.
#[unsafe(export_name = "dimsart_limit")]
#[inline(never)]
pub(crate) extern "C" fn limit(dimsart: &mut Dimsart) {
    let stamp = stamp();
    let engine = dimsart.engine_mut();
    engine.limit_cycles(stamp.limit_cycles());
    engine.set_costs(stamp.costs());
}

/// Logs what is known.
pub(crate) fn log() {
    let stamp = stamp();
    match stamp.costs() {
        Some(_) => {
            defmt::info!("a tick may take {} cycles, memory {=[u8]:a}", stamp.limit_cycles, stamp.memory)
        }
        None => defmt::warn!(
            "not stamped: what modules cost is not known and no tick is too long; `dimsart stamp`"
        ),
    }
}
