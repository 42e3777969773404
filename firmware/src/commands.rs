//! The command line: bytes in, requests to the tick, answers back, bytes out; and what the tick says unsolicited.
//!
//! One request is with the tick at a time. A flood of them waits in the line and then is lost, as the
//! protocol expects; the tick carries out one per period. Requests for the kept schemes go to their
//! [scheme service](crate::scheme_service) instead: the tick never waits for flash. Heartbeats go on while a scheme is
//! collected, and wait while flash is written.

use boards::{Board as _, Selected};
use dimsart_link::protocol::{DecodeError, Refusal, Request, Response, encode_response};
use embassy_time::{Duration, Timer};
use firmware::{LineInput, Next};

use crate::command_line::{CommandLine, CommandPort, Unsolicited};
use crate::handover::Taker;
use crate::key_service::KeyService;
use crate::motor_service::MotorService;
use crate::scheme_service::SchemeService;
use crate::tick_handover::{Answer, TickHandover};

/// Longer than what a port may hold takes.
const LAST_BYTES: Duration = Duration::from_millis(5);

#[embassy_executor::task]
pub(crate) async fn serve(
    port: CommandPort,
    mut tick: TickHandover,
    reports: Taker<Unsolicited>,
    mut schemes: SchemeService,
    mut motor: MotorService,
    mut keys: KeyService,
) {
    let mut line = CommandLine::new(port, reports);
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
