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
    let (mut receiver, mut speaker) = (Receiver::new(), Speaker { heartbeats: 0 });
    let (mut bytes, mut unread, mut frame) = ([0; 64], 0..0, [0; MAX_FRAME_BYTES]);
    loop {
        ALIVE.store(alive().wrapping_add(1), Relaxed);
        let mut length = reports.take().map(|report| speaker.encode(report, &receiver, &mut frame));
        if length.is_none() && unread.is_empty() {
            match select(port.read(&mut bytes), reports.next()).await {
                Either::First(read) => unread = 0..read.unwrap_or_default(),
                Either::Second(report) => length = Some(speaker.encode(report, &receiver, &mut frame)),
            }
        }
        let length = if let Some(length) = length {
            length
        } else {
            let Some(byte) = unread.next().and_then(|index| bytes.get(index)) else { continue };
            let Some(content) = receiver.take(*byte) else { continue };
            let answer = match decode_request(content) {
                Ok((id, request)) => {
                    tick.id = id;
                    match request {
                        // The tick keeps none, but knows who may change them.
                        Request::Schemes(action) => match who_may_not(tick.ask(request).await) {
                            Some(refusal) => Response::Refused(refusal),
                            None => keeper.carry_out(action, &mut tick).await,
                        },
                        request => tick.ask(request).await,
                    }
                }
                Err(DecodeError::NotUnderstood { id }) => {
                    tick.id = id;
                    Response::Refused(Refusal::NotUnderstood)
                }
                Err(DecodeError::OtherClass) => continue,
            };
            encode_response(&answer, tick.id, &mut frame).map_or(0, <[u8]>::len)
        };
        // An error of the line is a lost frame: the host finds that out.
        let _ = port.write_all(frame.get(..length).unwrap_or_default()).await;
    }
}

/// Why the schemes are not this client's to change, if so.
fn who_may_not(answer: Answer) -> Option<Refusal> {
    match answer {
        Response::Refused(refusal @ Refusal::Lease { .. }) => Some(refusal),
        _ => None,
    }
}

/// Makes frames of what the tick says; apart from the task, so that it holds none of that while it waits.
struct Speaker {
    heartbeats: u16,
}

impl Speaker {
    /// Length of the frame, 0 when there is none.
    fn encode(&mut self, report: Report, receiver: &Receiver, frame: &mut [u8]) -> usize {
        let encoded = match report {
            Report::Sample(sample) => encode_sample(&sample, frame),
            Report::Heartbeat(mut heartbeat) => {
                let Counters { damaged, too_long, .. } = receiver.counters();
                heartbeat.damaged = damaged.saturating_add(too_long);
                self.heartbeats = self.heartbeats.wrapping_add(1);
                encode_heartbeat(&heartbeat, self.heartbeats, frame)
            }
        };
        encoded.map_or(0, <[u8]>::len)
    }
}
