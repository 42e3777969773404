//! Carriers: contents into the frames of a medium and back. Bytes in, bytes out.
//!
//! | Carrier | Frame | Longest content | Added to a content of Table 1's 47 bytes |
//! |---|---|---|---|
//! | [`stream`] (UART, serial port) | zero, COBS, zero | 256 bytes | 3 bytes |
//! | [`can_fd`] | length, content, zeros up to a length that CAN FD has | 63 bytes | 1 byte |
//! | [`can`] (8 bytes a frame) | checksum, index and counter, a part of the header, a word | 16 words | 9 frames, 60 bytes in all |
//!
//! UDP carries a content as it is. A carrier neither knows nor checks what a content is: the
//! [`envelope`](dimsart_core::envelope)'s CRC covers the way from end to end. Only classic CAN, where the envelope does
//! not fit, takes it off and seals it anew, with a CRC of its own in between.
//!
//! Nothing here waits, allocates or reads a clock; a receiver holds one content.

pub mod can;
pub mod can_fd;
pub mod stream;
