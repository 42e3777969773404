//! FDCAN 1 as the bus of moteus drives at 1 and 5 Mbit/s: polled by the tick, without interrupts.
//!
//! The controller buffers three frames each way, and its filter passes only replies, one per drive and tick.
//! Frames not sent by the next tick are outdated and cancelled.

use core::num::{NonZeroU8, NonZeroU16};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use embassy_stm32::can::CanConfigurator;
use embassy_stm32::can::Properties;
use embassy_stm32::can::config::{
    DataBitTiming, FrameTransmissionConfig, GlobalFilter, NominalBitTiming, TxBufferMode,
};
use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::can::filter::{Action, ExtendedFilterSlot, Filter, FilterType, StandardFilterSlot};
use embassy_stm32::interrupt::{self, InterruptExt as _};
use embassy_stm32::pac::{FDCAN1, FDCANRAM1, RCC};
use embedded_can::{ExtendedId, StandardId};

use crate::bit_timing::{self, BitTiming};
use crate::bus_off::{BusOff, RecoveryAction};
use crate::can_words::{self, MAX_BYTES, WORDS};
use crate::stm32g4::fdcan_registers::{compensate_delay, take_away};
use crate::{CLOCK_HZ, TICK_HZ};

/// Sample point in thousandths of a bit.
const SAMPLE_PERMILLE: u32 = 666;
const BIT: BitTiming = timing(1_000_000, bit_timing::NOMINAL);
const DATA_BIT: BitTiming = timing(5_000_000, bit_timing::DATA);
/// Frames buffered by the controller, each way.
const ROOM: usize = 3;
/// Polling period of the bus state, ticks.
const LOOK_TICKS: u32 = LOOK_MS * TICK_HZ / 1000;
const LOOK_MS: u32 = 10;

/// Number of rejoins.
static REJOINS: AtomicU32 = AtomicU32::new(0);

/// Returns the number of rejoins since the start.
pub(crate) fn rejoins() -> u32 {
    REJOINS.load(Relaxed)
}

#[expect(clippy::panic, reason = "evaluated at compile time")]
const fn timing(bits_per_s: u32, limits: bit_timing::BitTimingLimits) -> BitTiming {
    match BitTiming::find(CLOCK_HZ, bits_per_s, SAMPLE_PERMILLE, limits) {
        Some(timing) => timing,
        None => panic!("bit rate not possible at this clock"),
    }
}

/// The bus.
pub(crate) struct MoteusBus {
    state: Properties,
    bus_off: BusOff,
    ticks: u32,
    now_ms: u32,
}

impl MoteusBus {
    /// Joins the bus and accepts frames with these identifiers, at most three.
    pub(crate) fn start(mut can: CanConfigurator<'static>, replies: impl Iterator<Item = u32>) -> Self {
        let BitTiming { prescaler, segment_1, segment_2 } = BIT;
        let bit = NominalBitTiming {
            prescaler: NonZeroU16::from(quanta(prescaler)),
            seg1: quanta(segment_1),
            seg2: quanta(segment_2),
            // The maximum, as the drives require.
            sync_jump_width: quanta(segment_2),
        };
        let BitTiming { prescaler, segment_1, segment_2 } = DATA_BIT;
        let data_bit = DataBitTiming {
            transceiver_delay_compensation: true,
            prescaler: NonZeroU16::from(quanta(prescaler)),
            seg1: quanta(segment_1),
            seg2: quanta(segment_2),
            sync_jump_width: quanta(segment_2),
        };
        let config = can
            .config()
            .set_nominal_bit_timing(bit)
            .set_data_bit_timing(data_bit)
            .set_frame_transmit(FrameTransmissionConfig::AllowFdCanAndBRS)
            .set_tx_buffer_mode(TxBufferMode::Fifo)
            .set_global_filter(GlobalFilter::reject_all())
            .set_automatic_bus_off_recovery(false);
        can.set_config(config);
        let (send, receive, state) = can.into_normal_mode().split();
        // Dropping them would stop the controller's clock.
        core::mem::forget((send, receive));
        for line in [interrupt::FDCAN1_IT0, interrupt::FDCAN1_IT1] {
            line.disable();
            line.set_priority(super::LINE_PRIORITY);
        }
        compensate_delay((1 + segment_1) * prescaler);
        let standard = [StandardFilterSlot::_0, StandardFilterSlot::_1, StandardFilterSlot::_2];
        let extended = [ExtendedFilterSlot::_0, ExtendedFilterSlot::_1, ExtendedFilterSlot::_2];
        let action = Action::StoreInFifo0;
        for ((reply, standard), extended) in replies.zip(standard).zip(extended) {
            // A drive may use either format for a short identifier.
            if let Some(id) = u16::try_from(reply).ok().and_then(StandardId::new) {
                state.set_standard_filter(
                    standard,
                    Filter { filter: FilterType::DedicatedSingle(id), action },
                );
            }
            if let Some(id) = ExtendedId::new(reply) {
                state.set_extended_filter(
                    extended,
                    Filter { filter: FilterType::DedicatedSingle(id), action },
                );
            }
        }
        Self { state, bus_off: BusOff::new(), ticks: 0, now_ms: 0 }
    }

    /// Reads the received frames (identifier and data). Call once per tick.
    pub(crate) fn receive(&mut self, mut show: impl FnMut(u32, &[u8])) {
        self.look();
        for _ in 0..ROOM {
            let fill = FDCAN1.rxfs(0).read();
            if fill.ffl() == 0 {
                return;
            }
            let place = fill.fgi();
            let [first, second] = [0, 1].map(|word| FDCANRAM1.rxfifo0(at(place, word)).read());
            let mut bytes = [0; MAX_BYTES];
            let found = can_words::decode_header([first, second]);
            let length = found.map_or(0, |(_, length)| length);
            let (words, _) = bytes.as_chunks_mut();
            for (word, bytes) in words.iter_mut().enumerate().take(length.div_ceil(4)) {
                *bytes = FDCANRAM1.rxfifo0(at(place, 2 + word)).read().to_le_bytes();
            }
            FDCAN1.rxfa(0).write(|taken| taken.set_fai(place));
            if let (Some((identifier, _)), Some(data)) = (found, bytes.get(..length)) {
                show(identifier, data);
            }
        }
    }

    /// Sends the frames of a tick, at most three. Drops frames without room.
    #[expect(clippy::unused_self, reason = "sending requires ownership of the bus")]
    pub(crate) fn send<'f>(&mut self, frames: impl Iterator<Item = (u32, &'f [u8])>) {
        take_away();
        frames.for_each(|(identifier, data)| put(identifier, data));
    }

    fn look(&mut self) {
        self.ticks = self.ticks.wrapping_add(1);
        if !self.ticks.is_multiple_of(LOOK_TICKS) {
            return;
        }
        self.now_ms = self.now_ms.wrapping_add(LOOK_MS);
        let is_off = matches!(self.state.bus_error_mode(), BusErrorMode::BusOff);
        if self.bus_off.poll_board(self.now_ms, is_off) == RecoveryAction::Rejoin {
            // The controller then waits for 128 idle sequences.
            FDCAN1.cccr().modify(|control| control.set_init(false));
            REJOINS.store(self.bus_off.rejoins(), Relaxed);
        }
    }
}

/// Sends frames after a failure, at any time; has no effect before the bus was started.
pub(crate) fn send_at_last<'f>(frames: impl Iterator<Item = (u32, &'f [u8])>) {
    if RCC.apb1enr1().read().fdcanen() {
        take_away();
        frames.for_each(|(identifier, data)| put(identifier, data));
    }
}

fn put(identifier: u32, data: &[u8]) {
    let queue = FDCAN1.txfqs().read();
    let Some(head) = can_words::encode_header(identifier, data.len()) else { return };
    if queue.tfqf() {
        return;
    }
    let place = queue.tfqpi();
    let words = data.chunks(4).map(|bytes| {
        let mut word = [0; 4];
        word.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        u32::from_le_bytes(word)
    });
    for (word, value) in head.into_iter().chain(words).enumerate() {
        FDCANRAM1.txbuf(at(place, word)).write_value(value);
    }
    FDCAN1.txbar().write(|add| add.set_ar(usize::from(place).min(ROOM - 1), true));
}

/// Returns the offset of an element's word in the message RAM.
fn at(place: u8, word: usize) -> usize {
    (usize::from(place) * WORDS + word).min(ROOM * WORDS - 1)
}

fn quanta(count: u8) -> NonZeroU8 {
    NonZeroU8::new(count).unwrap_or(NonZeroU8::MIN)
}
