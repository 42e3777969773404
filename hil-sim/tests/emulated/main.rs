//! Controllers as firmware on the emulated board.
//!
//! Without image or emulator these tests run nothing and a line says so; where `DIMSART_FIRMWARE` names a folder of
//! images, both have to be there. What goes wrong is tested with a stand-in for the emulator, everywhere.

mod common;
mod same_bits;
mod timer_tick;
mod trouble;
