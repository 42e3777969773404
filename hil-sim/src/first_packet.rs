//! Determines the first packet of a controller by simulation.

use dimsart_core::{Dimsart, Packet, Word};

/// Maximum ticks between two packets, see `CTX_EVERY`.
const MAX_EVERY_TICKS: usize = 100;

/// Returns the first packet of a controller on a link with its device at rest; `None` if it sends no packet.
pub fn first_packet(dimsart: &mut Dimsart, link: usize) -> Option<Packet> {
    let measured = vec![Word(0); dimsart.frame().output_words()];
    let mut commanded = vec![Word(0); dimsart.frame().input_words()];
    (0..MAX_EVERY_TICKS).find_map(|_| {
        dimsart.tick(&measured, &mut commanded);
        dimsart.take_outgoing(link)
    })
}
