//! A log of a controller's latest events, in memory that survives a reset.
//!
//! A board places an [`EventLog`] in memory that start-up does not write (`.uninit`) and
//! [restores](EventLog::restore) it, so that the events before a reset can be read afterwards. Each event has
//! its own CRC: an event that a reset cut off, or random memory after power-up, is skipped.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_core::checksum::CRC;
use dimsart_core::{KindId, ModuleRef, SafetyReason, TypeRef};

/// Maximum number of stored events.
pub const MAX_EVENTS: usize = 64;

macro_rules! kinds {
    ($($number:literal $kind:ident $name:literal $meaning:literal $remedy:literal;)*) => {
        /// Events other than a change of the safety [`SafetyReason`]. Their numbers follow the numbers of reasons
        /// and are never reused.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum EventKind {
            $(#[doc = $meaning] $kind = $number,)*
        }

        impl EventKind {
            /// All kinds, in ascending order of number.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// Returns the name, for reports.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Returns the meaning, in sentences.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$kind => $meaning,)*
                }
            }

            /// Returns the remedy, in sentences; empty if no action is needed.
            #[must_use]
            pub const fn remedy(self) -> &'static str {
                match self {
                    $(Self::$kind => $remedy,)*
                }
            }
        }
    };
}

kinds! {
    128 Started "started"
        "The board has started. Cause: power-on or brown-out, reset pin, its own program, or watchdog."
        "After a watchdog reset: ticks were late or communication stalled. `dimsart connect PORT show` \
         counts late ticks.";
    129 Reset "reset"
        "A client reset all modules and cleared the fault, if any."
        "";
    130 SchemeChange "scheme changed"
        "A transaction was committed."
        "";
    131 ModuleIsolated "module cut out"
        "A module failed that no device input depends on; it is named as for 40."
        "As for 40; the device is still commanded.";
    132 Panic "panic"
        "The program stopped on an internal error. The tick is that of the previous event."
        "Build with the feature `panic-text`, which logs the source line, and report it.";
    133 Exception "exception"
        "Stack overflow, invalid access or undefined instruction; the detail is the processor's CFSR. The \
         tick is that of the previous event."
        "As for 132. Bits 0 to 7: memory protection (stack overflow); 8 to 15: bus; 16 to 31: instruction.";
    134 BusOff "CAN bus left"
        "Too many errors: the node is bus-off. It rejoins its CAN bus after 100 ms."
        "If this repeats: check wiring, termination and bit rate.";
    135 BusRejoined "CAN bus joined"
        "The node rejoined its CAN bus."
        "";
    136 BusOffPermanent "CAN bus given up"
        "The node was bus-off four times within 10 s and stays off."
        "Check wiring, termination and bit rate; then `reset`, which rejoins the bus.";
}

/// The cause of a board's start: the detail of [`EventKind::Started`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum StartCause {
    /// Unknown.
    Unknown = 0,
    /// Power-up, or a brown-out.
    Power = 1,
    /// The reset pin.
    Pin = 2,
    /// Its own program: a panic, an exception, or flashing.
    Program = 3,
    /// The watchdog: ticks were late, or communication stalled.
    Watchdog = 4,
}

/// An event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Event {
    /// Number of the event, from 1; continues over resets.
    pub number: u32,
    /// Tick of the event since the board's start, modulo 2^32.
    pub tick: u32,
    /// Number of a [`SafetyReason`] or of an [`EventKind`].
    pub what: u8,
    /// The module concerned, if any.
    pub module: Option<ModuleRef>,
    /// The signal concerned, if any.
    pub signal: Option<TypeRef>,
    /// Index of the word in the signal; 255 for 255 and above.
    pub word: u16,
    /// A link, a cause, a register, or the word's bits, depending on `what`.
    pub detail: u32,
}

impl Event {
    /// Returns the name, for reports; `None` for an unknown number.
    #[must_use]
    pub fn name(&self) -> Option<&'static str> {
        let kind = EventKind::ALL.iter().find(|kind| **kind as u8 == self.what).map(|kind| kind.name());
        kind.or_else(|| SafetyReason::from_number(self.what).map(SafetyReason::name))
    }

    /// An event without details; the log sets number and tick.
    pub(crate) const fn of(what: u8) -> Self {
        Self { number: 0, tick: 0, what, module: None, signal: None, word: 0, detail: 0 }
    }

    fn to_words(self) -> [u32; WORDS - 1] {
        let module = self.module.unwrap_or(ModuleRef::NONE);
        let signal = self.signal.unwrap_or(TypeRef { id: 0, number: 0 });
        let word = u8::try_from(self.word).unwrap_or(u8::MAX);
        let what = u32::from_le_bytes([self.what, word, module.number, signal.number]);
        let places = u32::from(signal.id) << 16 | u32::from(module.kind.bits());
        [self.number, self.tick, what, places, self.detail]
    }

    fn from_words([number, tick, what, places, detail]: [u32; WORDS - 1]) -> Self {
        let [what, word, module, signal] = what.to_le_bytes();
        let [kind, kind_high, id, id_high] = places.to_le_bytes();
        let kind = KindId::from_bits(u16::from_le_bytes([kind, kind_high]));
        Self {
            number,
            tick,
            what,
            module: (module > 0).then_some(ModuleRef { kind, number: module }),
            signal: (signal > 0).then_some(TypeRef { id: u16::from_le_bytes([id, id_high]), number: signal }),
            word: word.into(),
            detail,
        }
    }
}

/// Words of a record: an event and its CRC.
const WORDS: usize = 6;

/// The last [`MAX_EVENTS`] events. One context writes; any context can read complete events.
#[derive(Debug)]
pub struct EventLog {
    records: [[AtomicU32; WORDS]; MAX_EVENTS],
    last: AtomicU32,
}

impl Default for EventLog {
    fn default() -> Self {
        Self::new()
    }
}

impl EventLog {
    /// Creates an empty log.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            records: [const { [const { AtomicU32::new(0) }; WORDS] }; MAX_EVENTS],
            last: AtomicU32::new(0),
        }
    }

    /// Finds valid events in memory of unknown content.
    pub fn restore(&self) {
        let mut last = 0;
        for (place, record) in self.records.iter().enumerate() {
            match read(record).filter(|event| place_of(event.number) == place) {
                Some(event) => last = last.max(event.number),
                None => record.iter().for_each(|word| word.store(0, Relaxed)),
            }
        }
        self.last.store(last, Relaxed);
    }

    /// Returns the number of the last event; 0 if there is none.
    #[must_use]
    pub fn last(&self) -> u32 {
        self.last.load(Relaxed)
    }

    /// Returns the stored event that is `back` events older than the last one.
    #[must_use]
    pub fn get(&self, back: u8) -> Option<Event> {
        let number = self.last().checked_sub(back.into()).filter(|number| *number > 0)?;
        read(self.records.get(place_of(number))?).filter(|event| event.number == number)
    }

    /// Adds an event, replacing the oldest one if the log is full.
    pub fn add(&self, tick: u32, event: Event) {
        let number = self.last().wrapping_add(1);
        let Some(record) = self.records.get(place_of(number)) else { return };
        let words = Event { number, tick, ..event }.to_words();
        for (target, word) in record.iter().zip(words.into_iter().chain([checksum(words)])) {
            target.store(word, Relaxed);
        }
        self.last.store(number, Relaxed);
    }

    /// Adds the start of the board.
    pub fn add_start(&self, cause: StartCause) {
        self.add(0, Event { detail: cause as u32, ..Event::of(EventKind::Started as u8) });
    }

    /// Adds a panic or an exception; the meaning of `detail` depends on the kind.
    pub fn add_failure(&self, kind: EventKind, detail: u32) {
        let tick = self.get(0).map_or(0, |event| event.tick);
        self.add(tick, Event { detail, ..Event::of(kind as u8) });
    }
}

fn place_of(number: u32) -> usize {
    usize::try_from(number).unwrap_or(0) % MAX_EVENTS
}

fn read(record: &[AtomicU32; WORDS]) -> Option<Event> {
    let words = [0, 1, 2, 3, 4].map(|place: usize| record.get(place).map_or(0, |word| word.load(Relaxed)));
    let found = record.last().map(|word| word.load(Relaxed));
    (found == Some(checksum(words))).then(|| Event::from_words(words))
}

/// Not 0 if all words are 0, so that cleared memory holds no event.
fn checksum(words: [u32; WORDS - 1]) -> u32 {
    let mut digest = CRC.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    fn numbers(log: &EventLog) -> Vec<u32> {
        (0..=u8::MAX).filter_map(|back| log.get(back)).map(|event| event.number).collect()
    }

    fn filled(events: u32) -> EventLog {
        let log = EventLog::new();
        (1..=events).for_each(|tick| log.add(tick, Event { detail: !tick, ..Event::of(7) }));
        log
    }

    #[test]
    fn the_last_events_are_kept_the_last_one_first() {
        for events in [0_u32, 1, 63, 64, 65, 1_000] {
            let log = filled(events);
            let kept = (1..=events).rev().take(MAX_EVENTS);
            assert_eq!(numbers(&log), kept.collect::<Vec<_>>());
            assert!((0..64).filter_map(|back| log.get(back)).all(|event| event.tick == event.number));
        }
    }

    #[test]
    fn a_start_goes_on_counting_and_says_its_cause() {
        let log = filled(100);
        log.add_failure(EventKind::Exception, 0x0200);
        log.last.store(0xDEAD_BEEF, Relaxed);
        log.restore();
        log.add_start(StartCause::Watchdog);
        let [start, stop] = [0, 1].map(|back| log.get(back).unwrap());
        assert_eq!((start.number, start.tick, start.name(), start.detail), (102, 0, Some("started"), 4));
        assert_eq!((stop.number, stop.tick, stop.name(), stop.detail), (101, 100, Some("exception"), 0x0200));
    }

    #[test]
    fn numbers_of_events_are_no_numbers_of_reasons_and_never_change() {
        let kinds = EventKind::ALL.iter().map(|kind| (*kind as u8, kind.name()));
        assert_eq!(
            kinds.clone().collect::<Vec<_>>(),
            [
                (128, "started"),
                (129, "reset"),
                (130, "scheme changed"),
                (131, "module cut out"),
                (132, "panic"),
                (133, "exception"),
                (134, "CAN bus left"),
                (135, "CAN bus joined"),
                (136, "CAN bus given up"),
            ]
        );
        assert!(kinds.into_iter().all(|(number, _)| SafetyReason::from_number(number).is_none()));
    }

    proptest! {
        /// Memory after power-up holds no events.
        #[test]
        fn random_memory_is_an_empty_log(words in proptest::collection::vec(any::<u32>(), WORDS * MAX_EVENTS + 1)) {
            let log = EventLog::new();
            for (word, random) in log.records.iter().flatten().chain([&log.last]).zip(words) {
                word.store(random, Relaxed);
            }
            log.restore();
            prop_assert_eq!(log.last(), 0);
            prop_assert_eq!(numbers(&log), []);
        }

        /// A reset during a write loses that event and the replaced one.
        #[test]
        fn a_reset_in_the_middle_of_an_event_costs_no_other(events in 1..200_u32, written in 0..WORDS) {
            let (log, next) = (filled(events), filled(events + 1));
            let place = place_of(events + 1);
            for (word, later) in log.records[place].iter().zip(&next.records[place]).take(written) {
                word.store(later.load(Relaxed), Relaxed);
            }
            log.restore();
            let kept = (1..=events).rev().take(MAX_EVENTS - usize::from(written > 0));
            prop_assert_eq!(numbers(&log), kept.collect::<Vec<_>>());
        }

        #[test]
        fn what_is_added_is_read(
            tick: u32, what: u8, module: Option<(u16, u8)>, signal: Option<(u16, u8)>, word: u8, detail: u32
        ) {
            let module = module.map(|(kind, number)| ModuleRef { kind: KindId::from_bits(kind), number: number.max(1) });
            let signal = signal.map(|(id, number)| TypeRef { id, number: number.max(1) });
            let event = Event { number: 1, tick, what, module, signal, word: word.into(), detail };
            let log = EventLog::new();
            log.add(tick, event);
            prop_assert_eq!(log.get(0), Some(event));
        }
    }
}
