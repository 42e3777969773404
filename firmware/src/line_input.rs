//! Arbitration of the command line between received bytes and the tick's reports.
//!
//! Under overload they alternate: a report waits for one request at most, and a request for one report.

use core::ops::Range;

use embassy_futures::poll_once;
use embassy_futures::select::{Either, select};
use embedded_io_async::Read;

/// The next event.
#[derive(Debug, PartialEq, Eq)]
pub enum InputEvent {
    /// A received byte.
    Byte(u8),
    /// A report of the tick.
    Report,
}

/// Buffered bytes, and whose turn it is.
#[derive(Debug)]
pub struct LineInput {
    bytes: [u8; 32],
    unread: Range<usize>,
    reports_next: bool,
}

impl Default for LineInput {
    fn default() -> Self {
        Self::new()
    }
}

impl LineInput {
    /// Creates an empty input.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; 32], unread: 0..0, reports_next: true }
    }

    /// Waits for the next event; ignores line errors. `report` waits until there is a report.
    pub async fn next(&mut self, line: &mut impl Read, mut report: impl AsyncFnMut()) -> InputEvent {
        loop {
            if core::mem::take(&mut self.reports_next) && poll_once(report()).is_ready() {
                return InputEvent::Report;
            }
            if let Some(byte) = self.unread.next().and_then(|index| self.bytes.get(index)) {
                self.reports_next = self.unread.is_empty();
                return InputEvent::Byte(*byte);
            }
            match select(line.read(&mut self.bytes), report()).await {
                Either::First(read) => self.unread = 0..read.unwrap_or_default(),
                Either::Second(()) => return InputEvent::Report,
            }
        }
    }

    /// Records that a request was answered.
    pub fn record_answer(&mut self) {
        self.reports_next = true;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::convert::Infallible;
    use core::future::pending;

    use embassy_futures::block_on;
    use embedded_io_async::ErrorType;
    use std::string::String;

    use super::*;

    /// Bytes of requests, each ending in 9; then silence.
    struct Line(&'static [u8]);

    impl ErrorType for Line {
        type Error = Infallible;
    }

    impl Read for Line {
        async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
            if self.0.is_empty() {
                return pending().await;
            }
            // A few bytes at a time.
            let (read, rest) = self.0.split_at(self.0.len().min(5));
            buffer[..read.len()].copy_from_slice(read);
            self.0 = rest;
            Ok(read.len())
        }
    }

    /// Returns the events of `steps` steps, a letter each: a byte, the last byte of a request, a report.
    fn deal(bytes: &'static [u8], reports: usize, steps: usize) -> String {
        let (mut line_input, mut line, mut left) = (LineInput::new(), Line(bytes), reports);
        let mut deal = || match block_on(line_input.next(&mut line, async || {
            if left == 0 {
                pending().await
            }
        })) {
            InputEvent::Byte(9) => {
                line_input.record_answer();
                'A'
            }
            InputEvent::Byte(_) => 'b',
            InputEvent::Report => {
                left -= 1;
                'R'
            }
        };
        (0..steps).map(|_| deal()).collect()
    }

    #[test]
    fn whoever_is_alone_is_dealt_with_at_once() {
        assert_eq!(deal(&[1, 2, 9, 1, 2, 9], 0, 6), "bbAbbA");
        assert_eq!(deal(&[], 5, 5), "RRRRR");
    }

    #[test]
    fn reports_without_end_hold_up_a_request_by_one_each_time_that_bytes_come() {
        assert_eq!(deal(&[1, 2, 3, 4, 5, 6, 9, 1, 9], 1000, 18), "RbbbbbRbARbARRRRRR");
    }

    #[test]
    fn requests_or_noise_without_end_hold_up_a_report_by_one_of_them_each() {
        const NOISE: &[u8] = &[1; 1000];
        assert_eq!(deal(&[9; 100], 4, 10), "RARARARAAA");
        assert_eq!(deal(NOISE, 3, 20), "RbbbbbRbbbbbRbbbbbbb");
    }
}
