//! The command line over a UART with DMA in both directions.
//!
//! Received bytes are written to a ring buffer of [`RING_BYTES`] without the processor. They are lost if no
//! task reads them within 2.4 ms at 921 600 baud.

use dimsart_link::protocol::DEFAULT_BAUD;
use embassy_stm32::interrupt::typelevel::{Binding, Interrupt as _};
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{
    self, Error, InterruptHandler, RingBufferedUartRx, RxDma, RxPin, TxDma, TxPin, Uart, UartTx,
};
use embassy_stm32::{Peri, dma};
use embedded_io_async::{ErrorType, Read, Write};

use crate::board::CommandPort;

/// Maximum number of buffered bytes.
pub(crate) const RING_BYTES: usize = 224;

/// Opens both directions of a UART at [`DEFAULT_BAUD`].
pub(crate) fn open<T: usart::Instance, S: TxDma<T>, R: RxDma<T>>(
    uart: Peri<'static, T>,
    (receive, receive_dma): (Peri<'static, impl RxPin<T>>, Peri<'static, R>),
    (send, send_dma): (Peri<'static, impl TxPin<T>>, Peri<'static, S>),
    interrupts: impl Binding<T::Interrupt, InterruptHandler<T>>
    + Binding<S::Interrupt, dma::InterruptHandler<S>>
    + Binding<R::Interrupt, dma::InterruptHandler<R>>
    + 'static,
    ring: &'static mut [u8; RING_BYTES],
) -> (RingBufferedUartRx<'static>, UartTx<'static, Async>) {
    T::Interrupt::set_priority(super::LINE_PRIORITY);
    let mut settings = usart::Config::default();
    settings.baudrate = DEFAULT_BAUD;
    match Uart::new(uart, receive, send, send_dma, receive_dma, interrupts, settings) {
        Ok(uart) => {
            let (send, receive) = uart.split();
            (receive.into_ring_buffered(ring), send)
        }
        Err(_) => defmt::panic!("UART baud rate not possible"),
    }
}

/// The command line over a UART.
pub struct UartPort {
    pub(crate) receive: RingBufferedUartRx<'static>,
    pub(crate) send: UartTx<'static, Async>,
}

impl CommandPort for UartPort {}

impl ErrorType for UartPort {
    type Error = Error;
}

impl Read for UartPort {
    /// A corrupt or lost byte is one error; reading then continues.
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Error> {
        self.receive.read(bytes).await
    }
}

impl Write for UartPort {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        self.send.write(bytes).await?;
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Error> {
        Ok(())
    }
}
