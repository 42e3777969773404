//! A link's packets as CAN FD frames of 1 Mbit/s, one packet per frame.
//!
//! ```text
//! identifier  29 bits of the chip's serial number, so that no two nodes share one
//! data        length u8 | packet, at most 63 bytes | zeros up to a length that CAN FD has
//! ```
//! A longer packet is dropped. A node that had to leave the bus (bus-off) joins it again after
//! [`REJOIN_DELAY`], at most [`MAX_REJOINS`] times within [`REJOIN_WINDOW`]; then it stays off until a reset.

use dimsart_core::MAX_PACKET_BYTES;
use embassy_stm32::can::config::FrameTransmissionConfig;
use embassy_stm32::can::enums::BusErrorMode;
use embassy_stm32::can::frame::{FdFrame, Header};
use embassy_stm32::can::{CanConfigurator, CanRx, CanTx, Properties};
use embassy_stm32::interrupt::{self, InterruptExt as _};
use embassy_stm32::pac;
use embassy_time::{Duration, Instant, Timer, with_timeout};

use crate::board::{LinkIn, LinkOut};

const BITS_PER_S: u32 = 1_000_000;
/// The link that the CAN controller carries.
const LINK: usize = 0;
/// Time that a frame may wait for room in the controller.
const PATIENCE: Duration = Duration::from_millis(1);
/// Time without a frame before the state of the bus is looked at.
const STATE_PERIOD: Duration = Duration::from_millis(10);
const REJOIN_DELAY: Duration = Duration::from_millis(100);
const REJOIN_WINDOW: Duration = Duration::from_secs(10);
const MAX_REJOINS: u8 = 3;
/// Lengths of a CAN FD frame above 8 bytes.
const LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];
const MAX_BYTES: usize = 64;

/// Packets that come in over CAN.
pub struct FromCan {
    frames: CanRx<'static>,
    state: Properties,
    rejoins: Rejoins,
}

/// Packets that go out over CAN.
pub struct ToCan {
    frames: CanTx<'static>,
    identifier: embedded_can::Id,
}

/// Joins the bus.
pub(crate) fn start(mut can: CanConfigurator<'static>) -> (FromCan, ToCan) {
    interrupt::FDCAN1_IT0.set_priority(super::LINE_PRIORITY);
    can.set_bitrate(BITS_PER_S);
    let config = can
        .config()
        .set_frame_transmit(FrameTransmissionConfig::AllowFdCan)
        .set_automatic_bus_off_recovery(false);
    can.set_config(config);
    let (to, from, state) = can.into_normal_mode().split();
    (
        FromCan { frames: from, state, rejoins: Rejoins::default() },
        ToCan { frames: to, identifier: identifier() },
    )
}

/// Lots share words of the serial number, places on a wafer share others: all of them count.
fn identifier() -> embedded_can::Id {
    let serial = embassy_stm32::uid::uid();
    let (words, _) = serial.as_chunks();
    let serial = words.iter().fold(0, |mixed: u32, word| mixed.rotate_left(7) ^ u32::from_le_bytes(*word));
    let extended = embedded_can::ExtendedId::new(serial & embedded_can::ExtendedId::MAX.as_raw());
    extended.unwrap_or(embedded_can::ExtendedId::ZERO).into()
}

impl LinkIn for FromCan {
    async fn receive(&mut self, packet: &mut [u8; MAX_PACKET_BYTES]) -> (usize, usize) {
        loop {
            match with_timeout(STATE_PERIOD, self.frames.read_fd()).await {
                Ok(Ok(envelope)) => {
                    if let Some(length) = unpack(envelope.frame.data(), packet) {
                        return (LINK, length);
                    }
                }
                Ok(Err(_)) | Err(_) => {
                    if matches!(self.state.bus_error_mode(), BusErrorMode::BusOff) {
                        self.rejoins.rejoin().await;
                    }
                }
            }
        }
    }
}

/// The packet of a frame; gives its length.
fn unpack(data: &[u8], packet: &mut [u8]) -> Option<usize> {
    let (length, bytes) = data.split_first()?;
    let length = usize::from(*length);
    packet.get_mut(..length)?.copy_from_slice(bytes.get(..length)?);
    Some(length)
}

/// The frame of a packet, if it fits.
fn pack(identifier: embedded_can::Id, packet: &[u8]) -> Option<FdFrame> {
    let mut bytes = [0; MAX_BYTES];
    let (length, content) = bytes.split_first_mut()?;
    *length = u8::try_from(packet.len()).ok()?;
    content.get_mut(..packet.len())?.copy_from_slice(packet);
    let used = packet.len() + 1;
    let padded = if used <= 8 { used } else { LENGTHS.into_iter().find(|length| *length >= used)? };
    let header = Header::new_fd(identifier, u8::try_from(padded).ok()?, false, false);
    FdFrame::new(header, bytes.get(..padded)?).ok()
}

impl LinkOut for ToCan {
    async fn send(&mut self, link: usize, packet: &[u8]) {
        if let (LINK, Some(frame)) = (link, pack(self.identifier, packet)) {
            let _ = with_timeout(PATIENCE, self.frames.write_fd(&frame)).await;
        }
    }
}

/// How often the bus was joined again.
#[derive(Default)]
struct Rejoins {
    count: u8,
    first: Option<Instant>,
}

impl Rejoins {
    async fn rejoin(&mut self) {
        Timer::after(REJOIN_DELAY).await;
        let now = Instant::now();
        if self.count <= MAX_REJOINS && self.first.is_none_or(|first| now - first > REJOIN_WINDOW) {
            *self = Self { count: 0, first: Some(now) };
        }
        self.count = self.count.saturating_add(1);
        if self.count > MAX_REJOINS {
            if self.count == MAX_REJOINS + 1 {
                defmt::error!("off the CAN bus until a reset: check its wiring, termination and bit rate");
            }
            return;
        }
        // The controller itself then waits for 128 idle sequences.
        pac::FDCAN1.cccr().modify(|control| control.set_init(false));
    }
}
