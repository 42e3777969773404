//! Link 0 over USART 3.

use embassy_stm32::peripherals::{DMA1_CH3, DMA1_CH4, PC10, PC11, USART3};
use embassy_stm32::{Peri, bind_interrupts, dma, usart};
use static_cell::ConstStaticCell;

use crate::stm32g4::{uart, uart_link};

pub(super) use uart_link::{UartReceiver as LinkIn, UartSender as LinkOut};

bind_interrupts!(struct Interrupts {
    USART3 => usart::InterruptHandler<USART3>;
    DMA1_CHANNEL3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_CHANNEL4 => dma::InterruptHandler<DMA1_CH4>;
});

pub(super) fn start(
    uart: Peri<'static, USART3>,
    receive: (Peri<'static, PC11>, Peri<'static, DMA1_CH3>),
    send: (Peri<'static, PC10>, Peri<'static, DMA1_CH4>),
) -> (LinkIn, LinkOut) {
    static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
    uart_link::over(uart::open(uart, receive, send, Interrupts, RING.take()), 0)
}
