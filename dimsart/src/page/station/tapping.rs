//! The signals of every tick, as many of them as the line carries.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use super::super::news::Board;
use super::{OpenLine, PAUSE, PageDevice, greet};
use crate::connect::{ConnectError, Tap};
use dimsart_core::protocol::MAX_TELEMETRY_WORDS;

/// How often the rows of ticks go out: a screen's picture.
const PICTURE: Duration = Duration::from_millis(20);
/// From one look whether somebody is there to the next.
const LOOK: Duration = Duration::from_millis(100);
/// What rows may take of a line: the rest is for questions, answers and heartbeats.
const SHARE: f64 = 0.2;
/// Of a sample on the line, beside its words: envelope, numbers, framing.
const SAMPLE_BYTES: f64 = 16.0;
const BITS_PER_BYTE: f64 = 10.0;

/// The thread. While nobody looks, the device is asked for nothing: another client may want what it can send.
pub(super) fn tap(news: &Board, open: &OpenLine, baud: Option<u32>) {
    let mut number = 0;
    loop {
        if news.is_heard()
            && let Ok(mut device) = greet(open)
        {
            // A line that has ended is opened again.
            let _ = listen(news, &mut device, baud, &mut number);
        }
        thread::sleep(if news.is_heard() { PAUSE } else { LOOK });
    }
}

/// Until nobody looks any more.
fn listen(
    news: &Board,
    device: &mut PageDevice,
    baud: Option<u32>,
    number: &mut u32,
) -> Result<(), ConnectError> {
    let every_ticks = every_ticks(baud, device.identity().sample_period_s.into());
    let (mut tap, mut told) = (Tap::new(every_ticks), Arc::from([]));
    while news.is_heard() {
        let rows = device.tap(&mut tap, PICTURE)?;
        if *told != *tap.signals() {
            *number += 1;
            told = tap.signals().into();
            news.layout(*number, every_ticks, &told);
        }
        news.rows(*number, &told, rows);
    }
    device.end_tap(&mut tap)
}

/// Ticks from one row to the next, for one full stream over a line of so many bits per second.
fn every_ticks(baud: Option<u32>, sample_period_s: f64) -> u32 {
    let Some(baud) = baud else { return 1 };
    let words = u32::try_from(MAX_TELEMETRY_WORDS).unwrap_or(u32::MAX);
    let row_s = BITS_PER_BYTE * (4.0 * f64::from(words) + SAMPLE_BYTES) / (SHARE * f64::from(baud));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates")]
    let ticks = (row_s / sample_period_s).ceil().max(1.0) as u32;
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_take_a_fifth_of_a_line_and_every_tick_where_there_is_none() {
        let cases =
            [(None, 1e-3, 1), (Some(921_600), 1e-3, 4), (Some(115_200), 1e-3, 28), (Some(115_200), 1e-2, 3)];
        for (baud, period_s, expected) in cases {
            assert_eq!(every_ticks(baud, period_s), expected, "{baud:?} {period_s}");
        }
    }
}
