//! The command-line task: passes requests to the tick and sends responses and unsolicited messages.
//!
//! The tick handles one request per period. A flood of requests waits in the line's buffer and is then lost,
//! as the protocol expects. Requests about stored schemes go to the [scheme service](crate::scheme_service),
//! so that the tick never waits for flash. Heartbeats continue while a scheme is collected and pause while
//! flash is written.

use boards::{Board as _, Selected};
use dimsart_link::protocol::{DecodeError, Refusal, Request, Response, encode_response};
use embassy_time::{Duration, Timer};
use firmware::{InputEvent, LineInput};

use crate::command_line::{CommandLine, CommandPort, Unsolicited};
use crate::handover::QueueReceiver;
use crate::key_service::KeyService;
use crate::motor_service::MotorService;
use crate::scheme_service::SchemeService;
use crate::tick_handover::{Answer, TickHandover};

/// Longer than the transmission of a full port buffer.
const LAST_BYTES: Duration = Duration::from_millis(5);

#[embassy_executor::task]
pub(crate) async fn serve(
    port: CommandPort,
    mut tick: TickHandover,
    reports: QueueReceiver<Unsolicited>,
    mut schemes: SchemeService,
    mut motor: MotorService,
    mut keys: KeyService,
) {
    let mut line = CommandLine::new(port, reports);
    let mut line_input = LineInput::new();
    loop {
        let length = match keys.handshake(&mut line.frame) {
            Some(length) => length,
            None => {
                match line_input.next(&mut line.port, async || line.reports.ready_to_receive().await).await {
                    InputEvent::Report => line.encode_report(),
                    InputEvent::Byte(byte) => {
                        let Some(content) = line.receiver.push(byte) else { continue };
                        let answer = match keys.take(content) {
                            Ok((id, request)) => {
                                tick.id = id;
                                match request {
                                    // The tick has no schemes, but checks the permission.
                                    Request::Schemes(action) => match who_may_not(tick.ask(request).await) {
                                        Some(refusal) => Response::Refused(refusal),
                                        None => schemes.carry_out(action, &mut tick, &mut line).await,
                                    },
                                    Request::Motor(action) => {
                                        motor.carry_out(action, &mut schemes, &mut tick).await
                                    }
                                    Request::Restart => match tick.ask(request).await {
                                        Response::Refused(Refusal::NotFound) => Response::Restarts,
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
                            Err(DecodeError::Unsupported { id }) => {
                                tick.id = id;
                                Response::Refused(keys.refusal())
                            }
                            Err(DecodeError::UnexpectedClass) => continue,
                        };
                        line_input.record_answer();
                        let length =
                            encode_response(&answer, tick.id, &mut line.frame).map_or(0, <[u8]>::len);
                        if matches!(answer, Response::Restarts) {
                            line.say(length).await;
                            // Waits until the port has sent the last byte.
                            Timer::after(LAST_BYTES).await;
                            Selected::disarm();
                            Selected::reset();
                        }
                        length
                    }
                }
            }
        };
        line.say(length).await;
    }
}

/// Returns why the client may not change the schemes, if so.
fn who_may_not(answer: Answer) -> Option<Refusal> {
    match answer {
        Response::Refused(refusal @ Refusal::Lease { .. }) => Some(refusal),
        _ => None,
    }
}
