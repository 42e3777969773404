//! Executes requests on a controller.

use heapless::Vec;

use super::PROTOCOL_VERSION;
use super::blocked::NotCommandedReason;
use super::client::{NO_CLIENT, request_client};
use super::description::{Identity, InstanceDescription};
use super::device_info::DeviceInfo;
use super::frame::{BufferTooSmall, DecodeError};
use super::law::text_of;
use super::lease::LeaseAction;
use super::refusal::Refusal;
use super::request::{Request, decode_request};
use super::response::{Effect, Response, SignalWords, Status, encode_response};
use super::schemes::StoreError;
use super::telemetry::Wanted;
use crate::event_log::{Event, EventKind};
use dimsart_core::parameter::Value;
use dimsart_core::{Command, DataBase, DeviceDescriptor, Dimsart, Engine, Format, TickResult, Unit, type_at};

/// Executes the request with this id, between two ticks; see [Time](super#time) for the cost.
#[must_use]
pub fn serve<const STREAMS: usize>(
    id: u16,
    request: &Request,
    dimsart: &mut Dimsart,
    info: &mut DeviceInfo<STREAMS>,
) -> Response<'static> {
    info.hear(id);
    match *request {
        Request::Law(action) => (info.answer_law)(dimsart.engine(), action),
        _ => respond(id, request, dimsart, info).unwrap_or_else(Response::Refused),
    }
}

/// Like [`serve`], for the content of a frame: returns the id and the response. `None` if it is not a
/// request.
#[must_use]
pub fn serve_content<const STREAMS: usize>(
    content: &[u8],
    dimsart: &mut Dimsart,
    info: &mut DeviceInfo<STREAMS>,
) -> Option<(u16, Response<'static>)> {
    match decode_request(content) {
        Ok((id, request)) => Some((id, serve(id, &request, dimsart, info))),
        Err(DecodeError::Unsupported { id }) => Some((id, Response::Refused(Refusal::Unsupported))),
        Err(DecodeError::UnexpectedClass) => None,
    }
}

/// Like [`serve_content`], but encodes the frame of the response into `out`.
///
/// # Errors
/// [`BufferTooSmall`] if `out` is too small; [`MAX_FRAME_BYTES`](super::MAX_FRAME_BYTES) are enough. The request was
/// executed nevertheless.
pub fn answer<'o, const STREAMS: usize>(
    content: &[u8],
    dimsart: &mut Dimsart,
    info: &mut DeviceInfo<STREAMS>,
    out: &'o mut [u8],
) -> Result<Option<&'o [u8]>, BufferTooSmall> {
    let Some((id, response)) = serve_content(content, dimsart, info) else { return Ok(None) };
    encode_response(&response, id, out).map(Some)
}

fn respond<const STREAMS: usize>(
    id: u16,
    request: &Request,
    dimsart: &mut Dimsart,
    info: &mut DeviceInfo<STREAMS>,
) -> Result<Response<'static>, Refusal> {
    if request.changes_device() {
        info.lease.check(request_client(id))?;
    }
    let (refused_ticks, state) = (dimsart.refused_ticks(), dimsart.safety().state());
    let engine = dimsart.engine_mut();
    let response = match *request {
        Request::Identify => Response::Identity(identity(engine.device(), info)),
        Request::Module { place } => {
            Response::Module((*found(dimsart.engine().kinds().list().get(usize::from(place)))?).into())
        }
        Request::Parameter { kind, index } => {
            Response::Parameter(found(dimsart.engine().kinds().describe_parameter(kind, index))?.try_into()?)
        }
        Request::Port { module, index } => Response::Port(found(engine.describe_port(module, index))?),
        Request::DataType { index } => Response::DataType(found(type_at(engine.device(), index))?.into()),
        Request::Instance { index } => Response::Instance(found(instance(engine, index))?),
        Request::Entry { index } => {
            let (_, entry) = found(engine.data_base().signals().nth(usize::from(index)))?;
            Response::Entry(entry.signal)
        }
        Request::Command(command) => Response::Effect(carry_out(command, dimsart, info)),
        Request::Get { module, parameter, entry } => {
            Response::Value(engine.get(module, parameter, entry).map_err(Refusal::Engine)?)
        }
        Request::Signal { from, .. } | Request::Memory { from, .. } => {
            let slot = match *request {
                Request::Signal { signal, .. } => engine.data_base().slot(signal),
                Request::Memory { module, port, .. } => engine.memory_slot(module, port),
                _ => None,
            };
            Response::Signal(found(words(engine.data_base(), found(slot)?, from))?)
        }
        Request::Finding { index } => {
            let (finding, faults) = engine.finding(index);
            Response::Finding { finding: found(finding)?, faults: u32::try_from(faults).unwrap_or(u32::MAX) }
        }
        Request::Status => Response::Status(Status {
            ticks: info.ticks,
            refused_ticks,
            is_running: engine.is_running(),
            blocked: blocked(engine, info),
            first_fault: info.first_fault,
            usage: engine.usage(),
            is_in_transaction: engine.is_in_transaction(),
            state,
            module_fault: engine.module_fault(),
        }),
        Request::SchemeCommand { place, index } => {
            Response::SchemeCommand(found(engine.rebuild_command(place, index))?)
        }
        Request::Timing => Response::Timing(found(info.timing)?.into()),
        Request::Schemes(_) => {
            if request.changes_device() {
                let _ = info.lease.handle(request_client(id), LeaseAction::Renew);
            }
            return Err(Refusal::Store(StoreError::NoStorage));
        }
        Request::Safety => Response::Safety(dimsart.safety().into()),
        Request::Event { back } => Response::Event(found(info.events.and_then(|events| events.get(back)))?),
        Request::DeviceType { index } => {
            let DeviceDescriptor { outputs, inputs, .. } = engine.device();
            let found = found(outputs.iter().chain(inputs.iter()).nth(usize::from(index)))?;
            Response::DeviceType { signal: found.first(), is_taken: usize::from(index) >= outputs.len() }
        }
        Request::Bound => Response::Bound(found(engine.tick_bound())?),
        Request::Motor(action) => {
            info.lease.admit_motor(action, request_client(id), engine.is_running())?;
            return Err(Refusal::NotFound);
        }
        Request::Restart => {
            return Err(match info.lease.status().holder {
                NO_CLIENT => Refusal::NotFound,
                holder => Refusal::Lease { holder },
            });
        }
        // `serve` handles laws.
        Request::Key(_) | Request::Law(_) => return Err(Refusal::Unsupported),
        Request::Cycles { .. } => return Err(Refusal::NotFound),
        Request::Lease(LeaseAction::Take | LeaseAction::Renew) if state.is_fault() => {
            return Err(Refusal::Fault(dimsart.safety().reason().number()));
        }
        Request::Lease(action) => Response::Lease(info.lease.handle(request_client(id), action)?),
        Request::Telemetry { place, signal, every_ticks } => {
            let wanted = Wanted { id, place, signal, every_ticks };
            Response::Telemetry { words: info.send(wanted, engine.data_base())? }
        }
    };
    Ok(response)
}

fn found<T>(item: Option<T>) -> Result<T, Refusal> {
    item.ok_or(Refusal::NotFound)
}

fn identity<const STREAMS: usize>(
    device: &DeviceDescriptor,
    info: &DeviceInfo<STREAMS>,
) -> Identity<'static> {
    Identity {
        protocol_version: PROTOCOL_VERSION,
        device: device.name(),
        image: info.image,
        axes: Vec::from_slice(device.axes()).unwrap_or_default(),
        sample_period_s: device.sample_period_s(),
    }
}

fn instance(engine: &Engine, index: u8) -> Option<InstanceDescription> {
    let module = engine.instances().nth(usize::from(index))?;
    let place = engine.plug_in_position(module).and_then(|place| u8::try_from(place).ok());
    Some(InstanceDescription { module, place })
}

fn carry_out<const STREAMS: usize>(
    command: Command,
    dimsart: &mut Dimsart,
    info: &mut DeviceInfo<STREAMS>,
) -> Effect {
    if matches!(command, Command::Stop) {
        // Motion after a STOP requires arming.
        info.end_lease();
    }
    let refused = dimsart.command(command).err();
    let engine = dimsart.engine_mut();
    if refused.is_none() {
        match command {
            Command::Reset => {
                info.forget_fault();
                info.log(Event::of(EventKind::Reset as u8));
            }
            Command::Commit => info.log(Event::of(EventKind::SchemeChange as u8)),
            _ => {}
        }
    }
    let value = match command {
        Command::Set { module, parameter, entry, .. } => {
            engine.get(module, parameter, entry.unwrap_or(0)).ok()
        }
        Command::Bind { module, port: index, .. } => {
            engine.describe_port(module, index).and_then(|port| port.bound).map(Value::Type)
        }
        _ => None,
    };
    Effect { refused, blocked: blocked(engine, info), value, is_in_transaction: engine.is_in_transaction() }
}

fn blocked<const STREAMS: usize>(engine: &Engine, info: &DeviceInfo<STREAMS>) -> Option<NotCommandedReason> {
    if engine.is_running() {
        return info.keeps_still();
    }
    Some(
        engine.first_fault().map_or(NotCommandedReason::Tick(TickResult::Idle), NotCommandedReason::Mismatch),
    )
}

/// Returns as many words of a slot as fit, starting at `from`.
fn words(data_base: &DataBase, slot: u8, from: u16) -> Option<SignalWords> {
    // A memory has no signal type.
    let meaning = data_base.entry(slot).map(|entry| (entry.data_type.format, entry.data_type.unit));
    let (format, unit) = meaning.unwrap_or((Format::U32, Unit::One));
    text_of(data_base.words(slot), from, format, unit)
}

#[cfg(test)]
mod tests {
    use super::super::frame::encode;
    use super::super::{Receiver, decode_response};
    use super::*;
    use dimsart_core::envelope::Class;
    use dimsart_core::{AxisKind, ModuleKinds, ProvidedMemory};

    const LONG: &str = match core::str::from_utf8(&[b'x'; 256]) {
        Ok(text) => text,
        Err(_) => "",
    };

    fn controller() -> Dimsart {
        let device = DeviceDescriptor::new("arm", &[AxisKind::Linear], 1e-3, &[], &[]);
        Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ModuleKinds::NONE).unwrap()
    }

    fn content(frame: &[u8]) -> std::vec::Vec<u8> {
        let (mut receiver, mut found) = (Receiver::new(), std::vec::Vec::new());
        receiver.push_all(frame, |content| found = content.to_vec());
        found
    }

    fn send(class: Class, payload: &[u8], out: &mut [u8]) -> Result<std::vec::Vec<u8>, BufferTooSmall> {
        // A tuple of bytes is encoded as the bytes themselves.
        let mut frame = [0; 300];
        let length = match *payload {
            [a] => encode(class, 9, &(a,), &mut frame),
            [a, b] => encode(class, 9, &(a, b), &mut frame),
            [a, b, c] => encode(class, 9, &(a, b, c), &mut frame),
            _ => unreachable!(),
        };
        let request = content(&frame[..length.ok().unwrap()]);
        let mut info: DeviceInfo = DeviceInfo::new(LONG);
        Ok(answer(&request, &mut controller(), &mut info, out)?.map(content).unwrap_or_default())
    }

    fn refusal(payload: &[u8]) -> Refusal {
        let answer = send(Class::Request, payload, &mut [0; 300]).unwrap();
        match decode_response(&answer) {
            Ok((9, Response::Refused(refusal))) => refusal,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_request_of_another_version_is_refused_by_name() {
        assert_eq!(refusal(&[250]), Refusal::Unsupported, "unknown");
        assert_eq!(refusal(&[1]), Refusal::Unsupported, "too short");
        assert_eq!(refusal(&[0, 0]), Refusal::Unsupported, "too long");
    }

    #[test]
    fn who_does_not_measure_says_so() {
        assert_eq!(refusal(&[18, 0, 0]), Refusal::NotFound);
    }

    #[test]
    fn an_answer_that_fits_no_frame_is_refused_and_a_small_buffer_reported() {
        assert_eq!(refusal(&[0]), Refusal::TooLong);
        assert_eq!(send(Class::Request, &[0], &mut [0; 8]), Err(BufferTooSmall));
    }

    #[test]
    fn a_response_is_not_answered() {
        assert_eq!(send(Class::Response, &[0], &mut [0; 300]), Ok(std::vec::Vec::new()));
    }
}
