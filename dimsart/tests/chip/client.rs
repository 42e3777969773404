//! A host at the board's command line, in the board's time.

use dimsart_core::{Command, ModuleRef, SafetyReason, TypeRef, Value};
use dimsart_link::protocol::{
    LeaseAction, MAX_FRAME_BYTES, Receiver, Request, Response, decode_response, encode_request, request_id,
};

use crate::motor::Powered;

const CLIENT: u8 = 7;
/// Timeout of an answer.
const PATIENCE_S: f64 = 0.1;
/// Interval of renewals; a lease lasts 200 ms.
const RENEWAL_S: f64 = 0.08;

#[derive(Clone)]
pub(crate) struct Client {
    number: u8,
    generator: ModuleRef,
    amplitude: u8,
    is_holding: bool,
    renewed_s: f64,
}

impl Client {
    /// Sends the board a scheme with a constant force, initially 0.
    pub(crate) fn new(powered: &mut Powered) -> Self {
        let mut client = Self {
            number: 0,
            generator: ModuleRef::new("SIGGEN_MOD", 1),
            amplitude: 0,
            is_holding: false,
            renewed_s: 0.0,
        };
        let module = client.generator;
        let kind = module.kind;
        let parameter = client.find(powered, "FORM", |index| Request::Parameter { kind, index });
        client.amplitude = client.find(powered, "AMPLITUDE", |index| Request::Parameter { kind, index });
        let port = client.find(powered, "SIGNAL_OUT", |index| Request::Port { module, index });
        let force = TypeRef { id: dimsart_core::types::DES_FORCE.id, number: 1 };
        for command in [
            Command::Close,
            Command::Set { module, parameter, entry: None, value: Value::Choice(0) },
            Command::Set { module, parameter: client.amplitude, entry: None, value: Value::Real(0.0) },
            Command::Bind { module, port, signal: force },
            Command::PlugIn(module),
            Command::Check,
        ] {
            client.command(powered, command);
        }
        client
    }

    /// Returns the index of an item by name.
    fn find(&mut self, powered: &mut Powered, name: &str, request: impl Fn(u8) -> Request) -> u8 {
        let is_it = |response: Response<'_>| match response {
            Response::Module(module) => Some(module.name == name),
            Response::Parameter(parameter) => Some(parameter.name == name),
            Response::Port(port) => Some(port.name == name),
            _ => None,
        };
        (0..).find(|place| self.ask(powered, &request(*place), is_it)).unwrap()
    }

    fn command(&mut self, powered: &mut Powered, command: Command) {
        self.ask(powered, &Request::Command(command), |response| match response {
            Response::Effect(_) => Some(()),
            other => {
                eprintln!("{command:?}: {other:?}");
                None
            }
        });
    }

    /// Sends a request and runs until the answer arrives. Panics without an answer, or if `take` rejects it.
    fn ask<T>(
        &mut self,
        powered: &mut Powered,
        request: &Request,
        take: impl Fn(Response<'_>) -> Option<T>,
    ) -> T {
        let id = self.send(powered, request);
        let (mut receiver, end_s) = (Receiver::new(), powered.time_s() + PATIENCE_S);
        let mut answer = None;
        while answer.is_none() && powered.time_s() < end_s {
            powered.period();
            let bytes: Vec<u8> = powered.received.drain(..).collect();
            receiver.push_all(&bytes, |content| {
                if let Ok((of, response)) = decode_response(content)
                    && of == id
                {
                    answer = Some(take(response).unwrap());
                }
            });
        }
        answer.unwrap_or_else(|| panic!("no answer to {request:?} at {}", powered.bench.processor.location()))
    }

    fn send(&mut self, powered: &mut Powered, request: &Request) -> u16 {
        self.number = self.number.wrapping_add(1);
        let id = request_id(CLIENT, self.number);
        let mut buffer = [0; MAX_FRAME_BYTES];
        powered.bench.send(encode_request(request, id, &mut buffer).unwrap());
        id
    }

    /// Sends a numbered request without waiting for its answer.
    pub(crate) fn ask_in_passing(&mut self, powered: &mut Powered, number: u32) {
        let renewal = Request::Lease(LeaseAction::Renew);
        let requests = [Request::Status, Request::Timing, renewal, Request::Safety, Request::Identify];
        let place = usize::try_from(number).unwrap() % requests.len();
        self.send(powered, &requests[place]);
    }

    /// Enables the motor.
    pub(crate) fn take_lease(&mut self, powered: &mut Powered) {
        let holder = self.ask(powered, &Request::Lease(LeaseAction::Take), |response| match response {
            Response::Lease(status) => Some(status.holder),
            _ => None,
        });
        assert_eq!(holder, CLIENT);
        (self.is_holding, self.renewed_s) = (true, powered.time_s());
    }

    /// Clears faults and enables motion again.
    pub(crate) fn reset(&mut self, powered: &mut Powered) {
        self.is_holding = false;
        self.command(powered, Command::Reset);
        self.take_lease(powered);
    }

    /// Sets the torque command of the scheme, `N m`.
    pub(crate) fn want(&mut self, powered: &mut Powered, torque_nm: f32) {
        let (module, parameter) = (self.generator, self.amplitude);
        self.command(powered, Command::Set { module, parameter, entry: None, value: Value::Real(torque_nm) });
    }

    /// Runs one period; renews the lease if it was taken.
    pub(crate) fn period(&mut self, powered: &mut Powered) {
        if self.is_holding && powered.time_s() - self.renewed_s > RENEWAL_S {
            self.renewed_s = powered.time_s();
            self.send(powered, &Request::Lease(LeaseAction::Renew));
        }
        powered.period();
    }

    pub(crate) fn run_for(&mut self, powered: &mut Powered, time_s: f64) {
        let end_s = powered.time_s() + time_s;
        while powered.time_s() < end_s {
            self.period(powered);
        }
    }

    /// Returns why the scheme does not command the device; `None` if it does.
    pub(crate) fn reason(&mut self, powered: &mut Powered) -> Option<SafetyReason> {
        let number = self.ask(powered, &Request::Safety, |response| match response {
            Response::Safety(report) => Some(report.reason),
            _ => None,
        });
        SafetyReason::ALL.iter().copied().find(|reason| reason.number() == number)
    }

    /// Returns the first word of a signal as a real number.
    pub(crate) fn signal(&mut self, powered: &mut Powered, id: u16) -> f32 {
        let signal = TypeRef { id, number: 1 };
        self.ask(powered, &Request::Signal { signal, from: 0 }, |response| match response {
            Response::Signal(text) => text.words.first().map(|word| f32::from_bits(*word)),
            _ => None,
        })
    }
}
