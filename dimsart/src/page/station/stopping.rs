//! STOP, which waits for no other question.

use std::sync::mpsc::Receiver;

use serde_json::Value;
use tokio::sync::oneshot;

use super::{Answer, OpenLine, greet};

/// The thread. Its line is open before it is needed.
pub(super) fn stop(open: &OpenLine, stops: &Receiver<oneshot::Sender<Answer>>) {
    let mut device = greet(open).ok();
    for answer in stops {
        let mut done = Err("no line to the device".to_owned());
        // A line that has ended shows it only when it is used.
        for _ in 0..2 {
            if device.is_none() {
                match greet(open) {
                    Ok(greeted) => device = Some(greeted),
                    Err(error) => done = Err(error.to_string()),
                }
            }
            let Some(here) = &mut device else { break };
            match here.stop() {
                Ok(outcome) => {
                    done = Ok(Value::String(outcome.to_string()));
                    break;
                }
                Err(error) => {
                    done = Err(error.to_string());
                    device = None;
                }
            }
        }
        let _ = answer.send(done);
    }
}
