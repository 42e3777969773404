//! Sends STOP without waiting for other requests.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::sync::oneshot;

use super::{Answer, Greet, PAUSE};
use crate::page::page_device::PageDevice;

/// Maximum time between two reads, so that heartbeats do not fill the receive buffer.
const A_MOMENT: Duration = Duration::from_millis(5);

/// Runs the thread, with a line that is already open when a STOP arrives.
pub(super) fn stop(greet: &Greet, stops: &Receiver<oneshot::Sender<Answer>>) {
    let (mut device, mut tried) = (greet().ok(), Instant::now());
    loop {
        match stops.recv_timeout(A_MOMENT) {
            Ok(answer) => {
                // One STOP answers all pending ones.
                let answers: Vec<_> = std::iter::once(answer).chain(stops.try_iter()).collect();
                let done = stop_now(greet, &mut device);
                // The browser may have disconnected.
                answers.into_iter().for_each(|answer| drop(answer.send(done.clone())));
            }
            Err(RecvTimeoutError::Timeout) => {
                if device.as_mut().is_some_and(|device| device.listen(Duration::from_millis(1)).is_err()) {
                    device = None;
                }
                if device.is_none() && tried.elapsed() > PAUSE {
                    device = greet().ok();
                    tried = Instant::now();
                }
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}

/// Sends STOP. A closed line is detected only on use: it is then opened again.
fn stop_now(greet: &Greet, device: &mut Option<PageDevice>) -> Answer {
    let mut done = Err("no connection to the device".to_owned());
    for _ in 0..2 {
        if device.is_none() {
            match greet() {
                Ok(greeted) => *device = Some(greeted),
                Err(error) => done = Err(error.to_string()),
            }
        }
        let Some(here) = device.as_mut() else { break };
        match here.stop() {
            Ok(outcome) => return Ok(Value::String(outcome.to_string())),
            Err(error) => {
                done = Err(error.to_string());
                *device = None;
            }
        }
    }
    done
}
