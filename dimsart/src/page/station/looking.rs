//! The whole scheme, what is wrong with it, and what happened.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use super::super::news::Board;
use super::{Greet, PAUSE};
use crate::connect::ConnectError;
use crate::page::page_device::PageDevice;

/// Longest time that the line is not read: what its device says to everybody must not fill it up.
const A_MOMENT: Duration = Duration::from_millis(15);
/// From one look to the next: another client may have changed something.
const LOOK: Duration = Duration::from_secs(2);

/// The thread; it is woken when something was changed from here.
pub(super) fn look(news: &Board, greet: &Greet, wakes: &Receiver<()>) {
    loop {
        // What is wrong with the line is told by the thread that asks.
        if let Ok(mut device) = greet()
            && serve(news, &mut device, wakes).is_ok()
        {
            return;
        }
        thread::sleep(PAUSE);
    }
}

/// Until the line ends, or the page does.
fn serve(news: &Board, device: &mut PageDevice, wakes: &Receiver<()>) -> Result<(), ConnectError> {
    news.tell("overview", &device.overview()?);
    news.tell("kinds", &device.kinds()?);
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
        // What has come meanwhile is seen by the same look.
        while wakes.try_recv().is_ok() {}
        news.tell("overview", &device.overview()?);
    }
}
