//! What a controller would send, found by letting it send.

use dimsart_core::{Dimsart, Packet, Word};

/// Most ticks between two packets, see `CTX_EVERY`.
const MAX_EVERY_TICKS: usize = 100;

/// The first packet that a controller sends over a link while its device is at rest; none when it sends nothing.
pub fn first_packet(dimsart: &mut Dimsart, link: usize) -> Option<Packet> {
    let measured = vec![Word(0); dimsart.frame().output_words()];
    let mut commanded = vec![Word(0); dimsart.frame().input_words()];
    (0..MAX_EVERY_TICKS).find_map(|_| {
        dimsart.tick(&measured, &mut commanded);
        dimsart.outgoing(link)
    })
}
