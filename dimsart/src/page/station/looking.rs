//! Reads the scheme, its faults and the events.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use super::super::news::Board;
use super::{Greet, PAUSE};
use crate::connect::ConnectError;
use crate::page::page_device::PageDevice;

/// Maximum time between two reads, so that heartbeats do not fill the receive buffer.
const A_MOMENT: Duration = Duration::from_millis(15);
/// Polling interval: another client may have changed the scheme.
const LOOK: Duration = Duration::from_secs(2);

/// Runs the thread; `wakes` signals a change from this program.
pub(super) fn look(news: &Board, greet: &Greet, wakes: &Receiver<()>) {
    loop {
        // Errors of the line are reported by the thread of `asking`.
        if let Ok(mut device) = greet()
            && serve(news, &mut device, wakes).is_ok()
        {
            return;
        }
        thread::sleep(PAUSE);
    }
}

/// Reads until the line is closed or the page ends.
fn serve(news: &Board, device: &mut PageDevice, wakes: &Receiver<()>) -> Result<(), ConnectError> {
    news.tell("overview", &device.overview()?);
    news.tell("kinds", &device.kinds()?);
    news.tell("types", &device.data_types()?);
    loop {
        news.tell("faults", &device.faults()?);
        news.tell("events", &device.events()?);
        let looked = Instant::now();
        while looked.elapsed() < LOOK {
            match wakes.recv_timeout(A_MOMENT) {
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
                Err(RecvTimeoutError::Timeout) => device.listen(Duration::from_millis(1))?,
                Ok(()) => break,
            }
        }
        // One read covers all changes so far.
        while wakes.try_recv().is_ok() {}
        news.tell("overview", &device.overview()?);
    }
}
