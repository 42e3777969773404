//! The command line: bytes in, requests to the tick, answers back, bytes out.
//!
//! One request is with the tick at a time. A flood of them waits in the line and then is lost, as the
//! protocol expects; the tick carries out one per period. Requests for the kept schemes go to their
//! [keeper](crate::keeper) instead: the tick never waits for flash.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use boards::Selected;
use dimsart_core::protocol::{
    DecodeError, MAX_FRAME_BYTES, Receiver, Refusal, Request, Response, decode_request, encode_response,
};
use embassy_futures::select::{Either, select};
use embedded_io_async::{Read as _, Write as _};

use crate::handover::{Giver, Taker};
use crate::keeper::Keeper;

type CommandPort = <Selected as boards::Board>::CommandPort;

/// The way to the tick and back.
pub(crate) struct Link {
    pub(crate) requests: Giver<Request>,
    pub(crate) answers: Taker<Answer>,
    /// Comes now and then, for the heart to beat where nobody says anything.
    pub(crate) pulse: Taker<()>,
}

impl Link {
    pub(crate) async fn ask(&mut self, request: Request) -> Answer {
        beat();
        self.requests.give(request);
        self.answers.next().await
    }
}

/// What the tick makes of a request.
pub(crate) type Answer = Response<'static>;

/// Counts up as long as the task is alive.
static HEARTBEAT: AtomicU32 = AtomicU32::new(0);

fn beat() {
    HEARTBEAT.store(heartbeat().wrapping_add(1), Relaxed);
}

/// The task's heartbeat: another number as long as it is alive.
pub(crate) fn heartbeat() -> u32 {
    HEARTBEAT.load(Relaxed)
}

#[embassy_executor::task]
pub(crate) async fn serve(mut port: CommandPort, mut tick: Link, mut keeper: Keeper) {
    let mut receiver = Receiver::new();
    let (mut bytes, mut frame) = ([0; 64], [0; MAX_FRAME_BYTES]);
    loop {
        beat();
        let read = select(port.read(&mut bytes), tick.pulse.next()).await;
        let Either::First(Ok(length)) = read else { continue };
        for byte in bytes.iter().take(length) {
            let Some(content) = receiver.take(*byte) else { continue };
            let (id, answer) = match decode_request(content) {
                Ok((id, Request::Schemes(action))) => (id, keeper.carry_out(action, &mut tick).await),
                Ok((id, request)) => (id, tick.ask(request).await),
                Err(DecodeError::NotUnderstood { id }) => (id, Response::Refused(Refusal::NotUnderstood)),
                Err(DecodeError::OtherClass) => continue,
            };
            if let Ok(frame) = encode_response(&answer, id, &mut frame) {
                // An error of the line is a lost answer: the host asks again.
                let _ = port.write_all(frame).await;
            }
        }
    }
}
