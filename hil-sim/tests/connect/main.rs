//! `dimsart connect` against a controller behind a socket or a serial port, over good and bad lines.

mod asking;
mod emulated;
mod lines;
mod ports;
