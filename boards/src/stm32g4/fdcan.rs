//! A link over CAN: CAN FD frames at 1 and 4 Mbit/s; with feature `one-can-rate` at 1 Mbit/s only; with
//! feature `classic-can` classic frames at 1 Mbit/s. All nodes of a bus must use the same.
//!
//! The identifier is the packet's channel, 11 bits. On channel 0 it is 29 bits of the chip's serial number,
//! so that every node has a different one. The controller's filter passes only the received channel, or on
//! channel 0 every 29-bit identifier.
//!
//! [`bus_off`](crate::bus_off) describes the recovery from bus-off, and [`pending_frames`](crate::pending_frames) when
//! unacknowledged frames are dropped for newer ones. The controller buffers 3 received frames: for longer
//! classic packets, the task must run at least every 3 frames (350 us).

#[cfg(feature = "classic-can")]
mod classic;
#[cfg(not(feature = "classic-can"))]
mod fd;

use core::num::{NonZeroU8, NonZeroU16};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use embassy_stm32::can::config::{DataBitTiming, GlobalFilter, NominalBitTiming, TxBufferMode};
use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::can::filter::{
    Action, ExtendedFilter, ExtendedFilterSlot, Filter, FilterType, StandardFilter, StandardFilterSlot,
};
use embassy_stm32::can::{CanConfigurator, CanRx, CanTx, Properties};
use embassy_stm32::interrupt::{self, InterruptExt as _};
use embassy_stm32::pac;
use embassy_time::{Duration, Instant, with_deadline, with_timeout};
use embedded_can::{ExtendedId, Id, StandardId};

#[cfg(feature = "classic-can")]
use self::classic as kind;
#[cfg(not(feature = "classic-can"))]
use self::fd as kind;
use crate::CLOCK_HZ;
use crate::board::{LinkIn, LinkOut, MAX_PAYLOAD_BYTES};
use crate::bus_off::{BusOff, RecoveryAction};
use crate::pending_frames::PendingFrames;
use crate::receive_channels::ReceiveChannels;
use crate::stm32g4::fdcan_registers::{compensate_delay, take_away};

/// Delay compensation allows 1 or 2.
const PRESCALER: u8 = 2;
/// Quanta before and after the sample point, without the synchronisation quantum: sample point at 80 %.
const BIT: [u8; 2] = [66, 17];
/// The same for the data phase of CAN FD.
const DATA_BIT: [u8; 2] = [16, 4];
const _: () = assert!(bits_per_s(BIT) == 1_000_000 && bits_per_s(DATA_BIT) == 4_000_000);
/// Maximum wait of a frame for room in the controller.
const PATIENCE: Duration = Duration::from_millis(1);
/// Polling period of the bus state and the received channel.
const LOOK_PERIOD: Duration = Duration::from_millis(LOOK_PERIOD_MS as u64);
const LOOK_PERIOD_MS: u32 = 10;

/// Number of rejoins.
static REJOINS: AtomicU32 = AtomicU32::new(0);

/// Returns the number of rejoins since the start.
pub(crate) fn rejoins() -> u32 {
    REJOINS.load(Relaxed)
}

/// Receives contents over CAN.
pub struct CanReceiver {
    link: usize,
    frames: CanRx<'static>,
    bus: Properties,
    bus_off: BusOff,
    next_look: Instant,
    now_ms: u32,
    /// `None` until the filters are set.
    channel: Option<u16>,
    receiver: kind::Receiver,
}

/// Sends contents over CAN.
pub struct CanSender {
    link: usize,
    frames: CanTx<'static>,
    serial_number: ExtendedId,
    unsent: PendingFrames,
}

/// Joins the bus as link `link`.
pub(crate) fn start(mut can: CanConfigurator<'static>, link: usize) -> (CanReceiver, CanSender) {
    for line in [interrupt::FDCAN1_IT0, interrupt::FDCAN1_IT1] {
        line.set_priority(super::LINE_PRIORITY);
    }
    let prescaler = NonZeroU16::from(quanta(PRESCALER));
    let [seg1, seg2] = BIT.map(quanta);
    let bit = NominalBitTiming { prescaler, seg1, seg2, sync_jump_width: seg2 };
    let [seg1, seg2] = DATA_BIT.map(quanta);
    let transceiver_delay_compensation = kind::IS_FAST;
    let data_bit =
        DataBitTiming { transceiver_delay_compensation, prescaler, seg1, seg2, sync_jump_width: seg2 };
    let config = can
        .config()
        .set_nominal_bit_timing(bit)
        .set_data_bit_timing(data_bit)
        .set_frame_transmit(kind::ALLOWED)
        // Keeps a packet's frames in order.
        .set_tx_buffer_mode(TxBufferMode::Fifo)
        .set_global_filter(GlobalFilter::reject_all())
        .set_automatic_bus_off_recovery(false);
    can.set_config(config);
    let (to, from, bus) = can.into_normal_mode().split();
    if kind::IS_FAST {
        let [before, _] = DATA_BIT;
        compensate_delay((1 + before) * PRESCALER);
    }
    let from = CanReceiver {
        link,
        frames: from,
        bus,
        bus_off: BusOff::new(),
        next_look: Instant::MIN,
        now_ms: 0,
        channel: None,
        receiver: kind::Receiver::new(),
    };
    (from, CanSender { link, frames: to, serial_number: serial_number(), unsent: PendingFrames::new() })
}

const fn bits_per_s([before, behind]: [u8; 2]) -> u32 {
    CLOCK_HZ / PRESCALER as u32 / (1 + before as u32 + behind as u32)
}

fn quanta(count: u8) -> NonZeroU8 {
    NonZeroU8::new(count).unwrap_or(NonZeroU8::MIN)
}

/// Combines all words: chips of a lot or a wafer position share some of them.
fn serial_number() -> ExtendedId {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    let serial = words.iter().fold(0, |mixed: u32, word| mixed.rotate_left(7) ^ u32::from_le_bytes(*word));
    ExtendedId::new(serial & ExtendedId::MAX.as_raw()).unwrap_or(ExtendedId::ZERO)
}

/// Returns the standard identifier of a channel, if it has one.
fn identifier(channel: u16) -> Option<StandardId> {
    StandardId::new(channel).filter(|_| channel != 0)
}

impl LinkIn for CanReceiver {
    async fn receive(
        &mut self,
        listening: &ReceiveChannels,
        content: &mut [u8; MAX_PAYLOAD_BYTES],
    ) -> (usize, usize) {
        loop {
            // Cancel-safe: all state is in `self`.
            let received = with_deadline(self.next_look, self.frames.read_fd()).await;
            if Instant::now() >= self.next_look {
                self.next_look = Instant::now() + LOOK_PERIOD;
                self.now_ms = self.now_ms.wrapping_add(LOOK_PERIOD_MS);
                self.listen(listening.get(self.link));
                self.look();
            }
            if let (Ok(Ok(envelope)), Some(channel)) = (received, self.channel)
                && let Some(found) = self.receiver.push(envelope.frame.data(), channel)
                && let Some(room) = content.get_mut(..found.len())
            {
                room.copy_from_slice(found);
                return (self.link, found.len());
            }
        }
    }
}

impl CanReceiver {
    /// Sets the filter for a channel.
    fn listen(&mut self, channel: u16) {
        if self.channel == Some(channel) {
            return;
        }
        self.channel = Some(channel);
        let (standard, extended) = match identifier(channel) {
            Some(identifier) => {
                let filter = FilterType::DedicatedSingle(identifier);
                (Filter { filter, action: Action::StoreInFifo0 }, ExtendedFilter::disable())
            }
            None => (StandardFilter::disable(), ExtendedFilter::accept_all_into_fifo0()),
        };
        self.bus.set_standard_filter(StandardFilterSlot::_0, standard);
        self.bus.set_extended_filter(ExtendedFilterSlot::_0, extended);
    }

    fn look(&mut self) {
        let is_off = matches!(self.bus.bus_error_mode(), BusErrorMode::BusOff);
        if self.bus_off.poll_board(self.now_ms, is_off) == RecoveryAction::Rejoin {
            // The controller then waits for 128 idle sequences.
            pac::FDCAN1.cccr().modify(|control| control.set_init(false));
            REJOINS.store(self.bus_off.rejoins(), Relaxed);
        }
    }
}

impl LinkOut for CanSender {
    async fn send(&mut self, link: usize, channel: u16, content: &[u8]) {
        if link != self.link {
            return;
        }
        let identifier = identifier(channel).map_or(Id::Extended(self.serial_number), Id::Standard);
        if self.unsent.should_cancel(pac::FDCAN1.txbrp().read().0.count_ones()) {
            take_away();
        }
        for frame in kind::frames(content, channel, identifier) {
            if with_timeout(PATIENCE, self.frames.write_fd(&frame)).await.is_err() {
                // The remaining and pending frames are useless.
                take_away();
                return;
            }
            self.unsent.add();
        }
    }
}
