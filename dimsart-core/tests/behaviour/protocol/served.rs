//! A controller at the far end of a line, and a host that queries it.

use dimsart_core::{
    AxisKind, Command, DataType, DeviceDescriptor, Dimsart, Format, ModuleRef, ProvidedMemory, Shape,
    Summary, Unit, Word, types,
};
use dimsart_link::protocol::{
    DeviceInfo, Effect, MAX_FRAME_BYTES, Receiver, Refusal, Request, Response, answer, decode_response,
    encode_request,
};
use dimsart_modules::ALL;

/// A type of this device only, larger than one answer.
pub(super) const MAP: &DataType = &DataType {
    id: 0x8001,
    name: "MAP",
    unit: Unit::One,
    format: Format::F32,
    shape: Shape::Matrix(5, 8),
    summary: Summary::new("A map."),
};

pub(super) fn robot() -> Dimsart {
    let axes = [AxisKind::Linear, AxisKind::Rotary, AxisKind::Linear];
    let device = DeviceDescriptor::new("arm", &axes, 1e-3, &[types::POSITION, MAP], &[types::DES_FORCE]);
    Dimsart::new(ProvidedMemory::leak_default(), device.unwrap(), ALL).unwrap()
}

/// A controller at the far end of a line.
pub(super) struct ServedDevice {
    pub(super) dimsart: Dimsart,
    pub(super) info: DeviceInfo,
    pub(super) device: Receiver,
    host: Receiver,
    id: u16,
}

impl ServedDevice {
    pub(super) fn new() -> Self {
        let info = DeviceInfo::new("test 0.1").with_laws();
        Self { dimsart: robot(), info, device: Receiver::new(), host: Receiver::new(), id: 0 }
    }

    /// Sends bytes and returns the reply.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Vec<(u16, Response<'static>)> {
        let mut answers = Vec::new();
        let Self { dimsart, info, device, host, .. } = self;
        device.push_all(bytes, |content| {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let frame = answer(content, dimsart, info, &mut buffer).unwrap().unwrap();
            host.push_all(frame, |content| {
                // Leaked, so that the texts in the response outlive the frame.
                answers.push(decode_response(content.to_vec().leak()).unwrap());
            });
        });
        answers
    }

    pub(super) fn ask(&mut self, request: Request) -> Response<'static> {
        self.id += 1;
        let answers = self.send(&frame(request, self.id));
        let [(id, response)] = answers.try_into().unwrap();
        assert_eq!(id, self.id);
        response
    }

    pub(super) fn command(&mut self, command: Command) -> Effect {
        match self.ask(Request::Command(command)) {
            Response::Effect(effect) => effect,
            other => panic!("{other:?}"),
        }
    }

    /// Requests index 0, 1, ... until the device reports the end.
    pub(super) fn list(&mut self, request: impl Fn(u8) -> Request) -> Vec<Response<'static>> {
        let answers = (0..=u8::MAX).map(|index| self.ask(request(index)));
        answers.take_while(|response| *response != Response::Refused(Refusal::NotFound)).collect()
    }

    pub(super) fn tick(&mut self, position: f32) {
        let mut measured = [Word(0); 43];
        measured[0] = position.into();
        measured[3..].iter_mut().zip(1u8..).for_each(|(word, value)| *word = f32::from(value).into());
        let tick = self.dimsart.tick(&measured, &mut [Word(0); 3]);
        self.info.end_tick(tick, &self.dimsart);
    }

    pub(super) fn state(&self) -> String {
        format!("{:?}", self.dimsart)
    }
}

pub(super) fn frame(request: Request, id: u16) -> Vec<u8> {
    encode_request(&request, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

pub(super) fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}
