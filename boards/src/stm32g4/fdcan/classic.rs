//! Classic CAN: up to 16 frames of 8 bytes per packet.

use dimsart_link::carrier::can;
use embassy_stm32::can::config::FrameTransmissionConfig;
use embassy_stm32::can::frame::{FdFrame, Header};
use embedded_can::Id;

pub(super) const ALLOWED: FrameTransmissionConfig = FrameTransmissionConfig::ClassicCanOnly;
/// Whether data uses the higher bit rate.
pub(super) const IS_FAST: bool = false;

pub(super) use can::Assembler as Receiver;

/// Returns a packet's frames; none if it does not fit.
pub(super) fn frames(content: &[u8], channel: u16, identifier: Id) -> impl Iterator<Item = FdFrame> {
    can::frames(content, channel).into_iter().flatten().filter_map(move |data| {
        let header = Header::new(identifier, u8::try_from(data.len()).ok()?, false);
        FdFrame::new(header, &data).ok()
    })
}
