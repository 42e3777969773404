//! Carriers: convert contents to the frames of a medium and back.
//!
//! | Carrier | Frame | Longest content | Overhead for a content of 47 bytes (Table 1) |
//! |---|---|---|---|
//! | [`stream`] (UART, serial port) | zero, COBS, zero | 256 bytes | 3 bytes |
//! | [`can_fd`] | length, content, zeros up to a valid CAN FD length | 63 bytes | 1 byte |
//! | [`can`] (8 bytes a frame) | checksum, index and counter, part of the header, one word | 16 words | 9 frames, 60 bytes in all |
//!
//! UDP carries a content unchanged. A carrier does not interpret the content: the CRC of the
//! [`envelope`](dimsart_core::envelope) protects it from end to end. On classic CAN the envelope does not
//! fit: it is removed, each frame has its own CRC, and the receiver restores the envelope.
//!
//! Carriers do not block, allocate or read a clock. A receiver buffers one content.

pub mod can;
pub mod can_fd;
pub mod stream;
