//! The page for a terminal, as over SSH: controllers seen, tuned and moved by keys.
//!
//! ```text
//! Station ──news──▶ Seen ──▶ Screen ──▶ draw ──▶ terminal
//! Station ◀──wishes──────── Screen ◀──keys────── terminal
//! ```
//! A station is what the page has, too. [`Screen`](screen::Screen) knows all that is drawn, and neither a terminal nor a
//! station, so that any state can be drawn in a test.

mod draw;
mod live;
mod running;
mod screen;
mod seen;
mod text;
mod told;

#[cfg(test)]
mod tests;

pub(crate) use running::run;
