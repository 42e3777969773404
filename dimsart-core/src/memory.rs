//! Memory of a controller, provided by the application, which thereby sets the capacities.

use heapless::Vec;

use crate::data_base::{Block, CheckedWords, DataBase, Entry, Storage};
use crate::module::Binding;
use crate::online::{ProgramSlot, Programs};
use crate::packet::LinkPort;
use crate::scheme::{ActiveModule, Call, Instance, Port, Scheme, Schemes, Wiring};

/// Memory for one controller; [`memory!`](crate::memory!) makes its type from
/// [`Capacities`](crate::limits::Capacities).
///
/// A new one is all zero bits, so that a static needs no room in the image.
#[derive(Debug)]
pub struct ControllerMemory<
    const MODULES: usize,
    const CALLS: usize,
    const WIRES: usize,
    const BINDINGS: usize,
    const SLOTS: usize,
    const LINKS: usize,
    const PLACES: usize,
    const WORDS: usize,
> {
    schemes: [SchemeMemory<MODULES, CALLS, WIRES, BINDINGS, SLOTS>; 2],
    entries: [Option<Entry>; SLOTS],
    blocks: [Block; SLOTS],
    links: [LinkPort; LINKS],
    places: [ProgramSlot; PLACES],
    words: [u32; WORDS],
}

/// Memory of the running or of the pending scheme.
#[derive(Debug)]
struct SchemeMemory<
    const MODULES: usize,
    const CALLS: usize,
    const WIRES: usize,
    const BINDINGS: usize,
    const SLOTS: usize,
> {
    instances: Vec<Instance, MODULES>,
    bindings: Vec<Binding, BINDINGS>,
    modules: Vec<ActiveModule, MODULES>,
    ports: Vec<Port, WIRES>,
    handles: Vec<u8, WIRES>,
    calls: Vec<Call, CALLS>,
    checked_words: Vec<CheckedWords, SLOTS>,
}

/// Type of the memory for a controller of these [`Capacities`](crate::limits::Capacities), a constant.
///
/// ```
/// use dimsart_core::limits::Capacities;
/// use dimsart_core::memory;
///
/// const SMALL: Capacities = Capacities { modules: 8, wires: 60, words: 256, ..Capacities::DEFAULT };
/// type SmallMemory = memory!(SMALL);
/// static MEMORY: std::sync::Mutex<SmallMemory> = std::sync::Mutex::new(SmallMemory::new());
/// ```
#[macro_export]
macro_rules! memory {
    ($sizes:expr) => {
        $crate::ControllerMemory<
            { $sizes.checked().modules },
            { 2 * $sizes.modules },
            { $sizes.wires },
            { $sizes.bindings },
            { $sizes.slots },
            { $sizes.links },
            { $sizes.program_slots() },
            { $sizes.words },
        >
    };
}

impl<
    const MODULES: usize,
    const CALLS: usize,
    const WIRES: usize,
    const BINDINGS: usize,
    const SLOTS: usize,
    const LINKS: usize,
    const PLACES: usize,
    const WORDS: usize,
> ControllerMemory<MODULES, CALLS, WIRES, BINDINGS, SLOTS, LINKS, PLACES, WORDS>
{
    /// Creates unused memory.
    #[must_use]
    #[expect(clippy::new_without_default, reason = "for statics: too large for the stack")]
    pub const fn new() -> Self {
        Self {
            schemes: [const { SchemeMemory::NEW }; 2],
            entries: [None; SLOTS],
            blocks: [Block { offset: 0, words: 0 }; SLOTS],
            links: [const { LinkPort::new() }; LINKS],
            places: [ProgramSlot::EMPTY; PLACES],
            words: [0; WORDS],
        }
    }
}

impl<const MODULES: usize, const CALLS: usize, const WIRES: usize, const BINDINGS: usize, const SLOTS: usize>
    SchemeMemory<MODULES, CALLS, WIRES, BINDINGS, SLOTS>
{
    const NEW: Self = Self {
        instances: Vec::new(),
        bindings: Vec::new(),
        modules: Vec::new(),
        ports: Vec::new(),
        handles: Vec::new(),
        calls: Vec::new(),
        checked_words: Vec::new(),
    };

    #[inline(never)]
    fn lists(&'static mut self) -> Scheme {
        let Self { instances, bindings, modules, ports, handles, calls, checked_words } = self;
        Scheme::new(instances, bindings, Wiring::new(modules, ports, handles, calls, checked_words))
    }
}

/// A [`ControllerMemory`] of any size, as a controller uses it.
#[derive(Debug)]
pub struct ProvidedMemory {
    pub(crate) schemes: Schemes,
    pub(crate) data_base: DataBase,
}

#[cfg(feature = "summaries")]
impl ProvidedMemory {
    /// Allocates memory of the [default sizes](crate::limits::Capacities::DEFAULT) on the heap and never frees it,
    /// for tests.
    #[must_use]
    pub fn leak_default() -> Self {
        use crate::limits::Capacities;
        Self::from(alloc::boxed::Box::leak(alloc::boxed::Box::new(<memory!(Capacities::DEFAULT)>::new())))
    }
}

impl<
    const MODULES: usize,
    const CALLS: usize,
    const WIRES: usize,
    const BINDINGS: usize,
    const SLOTS: usize,
    const LINKS: usize,
    const PLACES: usize,
    const WORDS: usize,
> From<&'static mut ControllerMemory<MODULES, CALLS, WIRES, BINDINGS, SLOTS, LINKS, PLACES, WORDS>>
    for ProvidedMemory
{
    #[inline]
    fn from(
        memory: &'static mut ControllerMemory<MODULES, CALLS, WIRES, BINDINGS, SLOTS, LINKS, PLACES, WORDS>,
    ) -> Self {
        let ControllerMemory { schemes: [first, second], entries, blocks, links, places, words } = memory;
        let storage = Storage::new(blocks, words);
        Self {
            schemes: Schemes::new([first.lists(), second.lists()]),
            data_base: DataBase::new(entries, links, Programs::new(places), storage),
        }
    }
}
