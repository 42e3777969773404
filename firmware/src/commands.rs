//! The command line: bytes in, requests to the tick, answers back, bytes out; and what the tick says unasked.
//!
//! One request is with the tick at a time. A flood of them waits in the line and then is lost, as the
//! protocol expects; the tick carries out one per period. Requests for the kept schemes go to their
//! [keeper](crate::keeper) instead: the tick never waits for flash. Heartbeats and telemetry go out before the next
//! request is looked at.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use boards::Selected;
use dimsart_core::protocol::{
    Counters, DecodeError, Heartbeat, MAX_FRAME_BYTES, Receiver, Refusal, Request, Response, Sample,
    decode_request, encode_heartbeat, encode_response, encode_sample,
};
use embassy_futures::select::{Either, select};
use embedded_io_async::{Read as _, Write as _};

use crate::handover::{Giver, Taker};
use crate::keeper::Keeper;

type CommandPort = <Selected as boards::Board>::CommandPort;

/// What the tick makes of a request.
pub(crate) type Answer = Response<'static>;

/// What the tick says unasked.
pub(crate) enum Report {
    Heartbeat(Heartbeat),
    Sample(Sample),
}

/// The way to the tick and back.
pub(crate) struct Link {
    pub(crate) requests: Giver<(u16, Request)>,
    pub(crate) answers: Taker<Answer>,
    /// Of the request that is being carried out.
    pub(crate) id: u16,
}

impl Link {
    pub(crate) async fn ask(&mut self, request: Request) -> Answer {
        self.requests.give((self.id, request));
        self.answers.next().await
    }
}

/// Counts up as long as the task is alive.
static ALIVE: AtomicU32 = AtomicU32::new(0);

/// Another number as long as the task is alive.
pub(crate) fn alive() -> u32 {
    ALIVE.load(Relaxed)
}

#[embassy_executor::task]
pub(crate) async fn serve(
    mut port: CommandPort,
    mut tick: Link,
    mut reports: Taker<Report>,
    mut keeper: Keeper,
) {
    let (mut receiver, mut heartbeats) = (Receiver::new(), 0);
    let (mut bytes, mut unread, mut frame) = ([0; 64], 0..0, [0; MAX_FRAME_BYTES]);
    loop {
        ALIVE.store(alive().wrapping_add(1), Relaxed);
        let mut report = reports.take();
        if report.is_none() && unread.is_empty() {
            match select(port.read(&mut bytes), reports.next()).await {
                Either::First(length) => unread = 0..length.unwrap_or_default(),
                Either::Second(found) => report = Some(found),
            }
        }
        let encoded = match report {
            Some(Report::Sample(sample)) => encode_sample(&sample, &mut frame),
            Some(Report::Heartbeat(mut heartbeat)) => {
                let Counters { damaged, too_long, .. } = receiver.counters();
                heartbeat.damaged = damaged.saturating_add(too_long);
                heartbeats = u16::wrapping_add(heartbeats, 1);
                encode_heartbeat(&heartbeat, heartbeats, &mut frame)
            }
            None => {
                let Some(byte) = unread.next().and_then(|index| bytes.get(index)) else { continue };
                let Some(content) = receiver.take(*byte) else { continue };
                let answer = match decode_request(content) {
                    Ok((id, request)) => {
                        tick.id = id;
                        match (tick.ask(request).await, request) {
                            // The tick keeps none, but knows who may change them.
                            (Response::Refused(Refusal::Store(_)), Request::Schemes(action)) => {
                                keeper.carry_out(action, &mut tick).await
                            }
                            (answer, _) => answer,
                        }
                    }
                    Err(DecodeError::NotUnderstood { id }) => {
                        tick.id = id;
                        Response::Refused(Refusal::NotUnderstood)
                    }
                    Err(DecodeError::OtherClass) => continue,
                };
                encode_response(&answer, tick.id, &mut frame)
            }
        };
        if let Ok(frame) = encoded {
            // An error of the line is a lost frame: the host finds that out.
            let _ = port.write_all(frame).await;
        }
    }
}
