//! The page in a terminal, for example over SSH: observe, tune and move controllers with keys.
//!
//! ```text
//! Station ──news──▶ Seen ──▶ Screen ──▶ draw ──▶ terminal
//! Station ◀──wishes──────── Screen ◀──keys────── terminal
//! ```
//! The page uses the same stations. [`Screen`](screen::Screen) is independent of terminal and stations, so that tests can
//! draw any state.

mod draw;
mod live;
mod messages;
mod running;
mod screen;
mod seen;
mod text;

#[cfg(test)]
mod tests;

pub(crate) use running::run;
