//! A link over a UART with DMA in both directions, framed by the protocol's `carrier::stream`.

use core::ops::Range;

use dimsart_link::carrier::stream::{self, StreamReceiver};
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{RingBufferedUartRx, UartTx};

use crate::board::{LinkIn, LinkOut, MAX_PAYLOAD_BYTES};
use crate::receive_channels::ReceiveChannels;

/// Receives contents over a UART.
pub struct UartReceiver {
    link: usize,
    port: RingBufferedUartRx<'static>,
    receiver: StreamReceiver,
    bytes: [u8; 32],
    /// Unprocessed range of `bytes`.
    waiting: Range<usize>,
}

/// Sends contents over a UART.
pub struct UartSender {
    link: usize,
    port: UartTx<'static, Async>,
}

/// Creates link `link` over the two directions of a UART.
pub(crate) fn over(
    (receive, send): (RingBufferedUartRx<'static>, UartTx<'static, Async>),
    link: usize,
) -> (UartReceiver, UartSender) {
    let from =
        UartReceiver { link, port: receive, receiver: StreamReceiver::new(), bytes: [0; 32], waiting: 0..0 };
    (from, UartSender { link, port: send })
}

impl LinkIn for UartReceiver {
    async fn receive(
        &mut self,
        _: &ReceiveChannels,
        content: &mut [u8; MAX_PAYLOAD_BYTES],
    ) -> (usize, usize) {
        loop {
            for index in self.waiting.by_ref() {
                if let Some(byte) = self.bytes.get(index)
                    && let Some(found) = self.receiver.push(*byte)
                    && let Some(room) = content.get_mut(..found.len())
                {
                    room.copy_from_slice(found);
                    return (self.link, found.len());
                }
            }
            // A line error is a corrupt frame: the receiver resynchronises.
            self.waiting = 0..self.port.read(&mut self.bytes).await.unwrap_or(0);
        }
    }
}

impl LinkOut for UartSender {
    async fn send(&mut self, link: usize, _: u16, content: &[u8]) {
        let mut frame = [0; stream::MAX_FRAME_BYTES];
        if link == self.link
            && let Some(frame) = stream::encode(content, &mut frame)
        {
            let _ = self.port.write(frame).await;
        }
    }
}
