//! The command line: bytes in, requests to the tick, answers back, bytes out; and what the tick says unsolicited.
//!
//! One request is with the tick at a time. A flood of them waits in the line and then is lost, as the
//! protocol expects; the tick carries out one per period. Requests for the kept schemes go to their
//! [scheme service](crate::scheme_service) instead: the tick never waits for flash. Heartbeats go on while a scheme is
//! collected, and wait while flash is written.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use boards::{Board as _, Selected};
use dimsart_link::protocol::{
    Counters, DecodeError, Heartbeat, MAX_FRAME_BYTES, Receiver, Refusal, Request, Response, Sample,
    encode_heartbeat, encode_response, encode_sample,
};
use embassy_time::{Duration, Timer};
use embedded_io_async::Write as _;
use firmware::{LineInput, Next};

use crate::handover::{Giver, Taker};
use crate::key_service::KeyService;
use crate::motor_service::MotorService;
use crate::scheme_service::SchemeService;

type CommandPort = <Selected as boards::Board>::CommandPort;

/// What the tick makes of a request.
pub(crate) type Answer = Response<'static>;

/// What the tick says unsolicited.
pub(crate) enum Unsolicited {
    Heartbeat(Heartbeat),
    Sample(Sample),
}

/// The way to the tick and back.
pub(crate) struct TickHandover {
    pub(crate) requests: Giver<(u16, Request)>,
    pub(crate) answers: Taker<Answer>,
    /// Of the request that is being carried out.
    pub(crate) id: u16,
}

impl TickHandover {
    pub(crate) async fn ask(&mut self, request: Request) -> Answer {
        self.requests.give((self.id, request));
        self.answers.next().await
    }
}

/// Longer than what a port may hold takes.
const LAST_BYTES: Duration = Duration::from_millis(5);

/// Counts up as long as the task is alive.
static ALIVE: AtomicU32 = AtomicU32::new(0);

/// Another number as long as the task is alive.
pub(crate) fn alive() -> u32 {
    ALIVE.load(Relaxed)
}

#[embassy_executor::task]
pub(crate) async fn serve(
    port: CommandPort,
    mut tick: TickHandover,
    reports: Taker<Unsolicited>,
    mut schemes: SchemeService,
    mut motor: MotorService,
    mut keys: KeyService,
) {
    let mut line =
        CommandLine { port, reports, receiver: Receiver::new(), frame: [0; MAX_FRAME_BYTES], heartbeats: 0 };
    let mut line_input = LineInput::new();
    loop {
        let length = match keys.handshake(&mut line.frame) {
            Some(length) => length,
            None => match line_input.next(&mut line.port, async || line.reports.ready().await).await {
                Next::Report => line.encode_report(),
                Next::Byte(byte) => {
                    let Some(content) = line.receiver.take(byte) else { continue };
                    let answer = match keys.take(content) {
                        Ok((id, request)) => {
                            tick.id = id;
                            match request {
                                // The tick keeps none, but knows who may change them.
                                Request::Schemes(action) => match who_may_not(tick.ask(request).await) {
                                    Some(refusal) => Response::Refused(refusal),
                                    None => schemes.carry_out(action, &mut tick, &mut line).await,
                                },
                                Request::Motor(action) => {
                                    motor.carry_out(action, &mut schemes, &mut tick).await
                                }
                                Request::Restart => match tick.ask(request).await {
                                    Response::Refused(Refusal::NotThere) => Response::Restarts,
                                    refused => refused,
                                },
                                #[cfg(feature = "auth")]
                                Request::Key(action) => {
                                    let flash = schemes.store.as_mut().map(firmware::SchemeStore::flash);
                                    keys.carry_out(action, flash, &mut tick).await
                                }
                                #[cfg(not(feature = "auth"))]
                                Request::Key(action) => match action {},
                                request => tick.ask(request).await,
                            }
                        }
                        Err(DecodeError::NotUnderstood { id }) => {
                            tick.id = id;
                            Response::Refused(keys.refusal())
                        }
                        Err(DecodeError::OtherClass) => continue,
                    };
                    line_input.answered();
                    let length = encode_response(&answer, tick.id, &mut line.frame).map_or(0, <[u8]>::len);
                    if matches!(answer, Response::Restarts) {
                        line.say(length).await;
                        // Until the last byte has left the port.
                        Timer::after(LAST_BYTES).await;
                        Selected::disarm();
                        Selected::reset();
                    }
                    length
                }
            },
        };
        line.say(length).await;
    }
}

/// Why the schemes are not this client's to change, if so.
fn who_may_not(answer: Answer) -> Option<Refusal> {
    match answer {
        Response::Refused(refusal @ Refusal::Lease { .. }) => Some(refusal),
        _ => None,
    }
}

/// The line, and what the tick wants to be said on it.
pub(crate) struct CommandLine {
    port: CommandPort,
    reports: Taker<Unsolicited>,
    receiver: Receiver,
    frame: [u8; MAX_FRAME_BYTES],
    heartbeats: u16,
}

impl CommandLine {
    /// Says what the tick has to say, if anything.
    pub(crate) async fn say_report(&mut self) {
        let length = self.encode_report();
        self.say(length).await;
    }

    /// Length of the next report's frame, 0 when there is none.
    #[inline(never)]
    fn encode_report(&mut self) -> usize {
        let encoded = match self.reports.take() {
            None => return 0,
            Some(Unsolicited::Sample(sample)) => encode_sample(&sample, &mut self.frame),
            Some(Unsolicited::Heartbeat(mut heartbeat)) => {
                let Counters { damaged, too_long, .. } = self.receiver.counters();
                heartbeat.damaged = damaged.saturating_add(too_long);
                self.heartbeats = self.heartbeats.wrapping_add(1);
                encode_heartbeat(&heartbeat, self.heartbeats, &mut self.frame)
            }
        };
        encoded.map_or(0, <[u8]>::len)
    }

    /// Sends the frame. An error of the line is a lost frame: the host finds that out.
    async fn say(&mut self, length: usize) {
        ALIVE.store(alive().wrapping_add(1), Relaxed);
        let _ = self.port.write_all(self.frame.get(..length).unwrap_or_default()).await;
    }
}
