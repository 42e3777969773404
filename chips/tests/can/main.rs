//! FDCAN and the bus, without a program: registers are written as a debugger does while the processor stands still.

mod desk;
mod errors;
mod filters;
mod frames;
mod rules;
