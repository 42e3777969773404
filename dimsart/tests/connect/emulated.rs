//! A controller behind a socket, on a configurable bad line.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Output};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use dimsart::connect::{Device, Timeouts};
use dimsart_core::{
    AxisKind, DataType, DeviceDescriptor, Dimsart, Format, ProvidedMemory, Shape, Summary, Unit, Word, types,
};
use dimsart_link::auth::Key;
use dimsart_link::protocol::{
    AccessControl, AccessOutcome, DeviceInfo, KeyAction, MAX_FRAME_BYTES, Receiver, Refusal, Request,
    Response, decode_request, encode_response, serve,
};
use dimsart_modules::ALL;
use hil_sim::link::{Stream, open_port};
use hil_sim::response::TELEMETRY_STREAMS;
use hil_sim::schemes::SchemeText;
use rand_core::{Rng, SeedableRng};

/// Timeouts for a lossless line on a busy machine.
pub(crate) const QUICK: Timeouts = Timeouts { timeout: Duration::from_secs(10), tries: 3 };
/// Timeouts for a line without answers.
pub(crate) const SHORT: Timeouts = Timeouts { timeout: Duration::from_millis(500), tries: 3 };

/// Longer than the timeout of a line with late answers.
const LATE: Duration = Duration::from_millis(120);

/// A type of this device only, larger than one answer, and unknown to the host.
const MAP: &DataType = &DataType {
    id: 0x8001,
    name: "MAP",
    unit: Unit::Energy,
    format: Format::F32,
    shape: Shape::Matrix(5, 8),
    summary: Summary::new("A map."),
};

/// A signed number without an axis.
const TURNS: &DataType = &DataType {
    id: 0x8002,
    name: "TURNS",
    unit: Unit::Position,
    format: Format::I32,
    shape: Shape::Scalar,
    summary: Summary::new("Turns of all axes together."),
};

/// A switch for each axis.
const BRAKES: &DataType = &DataType {
    id: 0x8003,
    name: "BRAKES",
    unit: Unit::One,
    format: Format::Bool,
    shape: Shape::Vector,
    summary: Summary::new("Which brakes are closed."),
};

/// Output words.
pub(crate) const MEASURED_WORDS: usize = 3 + 40 + 1 + 3;

/// A controller and the results of its ticks.
pub(crate) struct Robot {
    pub(crate) dimsart: Dimsart,
    pub(crate) info: DeviceInfo<TELEMETRY_STREAMS>,
    /// Number of received commands.
    pub(crate) commands: u32,
    gate: AccessControl,
}

impl Robot {
    pub(crate) fn new() -> Self {
        let axes = [AxisKind::Linear, AxisKind::Rotary, AxisKind::Linear];
        let outputs = &[types::POSITION, MAP, TURNS, BRAKES];
        let device = DeviceDescriptor::new("arm", &axes, 1e-3, outputs, &[types::DES_FORCE]).unwrap();
        let (dimsart, info) = (
            Dimsart::new(ProvidedMemory::leak_default(), device, ALL).unwrap(),
            DeviceInfo::new("test 0.1").with_laws(),
        );
        let info = info.with_events(Box::leak(Box::default()));
        Self { dimsart, info, commands: 0, gate: AccessControl::open() }
    }

    /// Sets a key.
    pub(crate) fn lock(&mut self, key: &[u8; 16]) {
        self.gate = AccessControl::locked(&Key::new(key), 1);
    }

    /// Returns the pending handshake frame, if any.
    pub(crate) fn handshake(&mut self) -> Vec<u8> {
        self.gate.handshake(&mut [0; MAX_FRAME_BYTES]).unwrap().unwrap_or_default().to_vec()
    }

    pub(crate) fn tick(&mut self, position: f32) {
        let mut measured = [Word(0); MEASURED_WORDS];
        measured[0] = position.into();
        measured[3..43].iter_mut().zip(1u8..).for_each(|(word, value)| *word = f32::from(value).into());
        measured[43] = (-7_i32).into();
        measured[44] = true.into();
        let tick = self.dimsart.tick(&measured, &mut [Word(0); 3]);
        self.info.end_tick(tick, &self.dimsart);
    }

    pub(crate) fn answer(&mut self, content: &[u8]) -> Vec<u8> {
        let is_command = matches!(decode_request(content), Ok((_, Request::Command(_))));
        self.commands += u32::from(is_command);
        let (id, response) = match self.gate.check(content) {
            AccessOutcome::Request(id, Request::Key(KeyAction::Read)) => {
                (id, Response::Key(self.gate.state()))
            }
            AccessOutcome::Request(id, request) => {
                (id, serve(id, &request, &mut self.dimsart, &mut self.info))
            }
            AccessOutcome::Refused(id, refusal) => (id, Response::Refused(Refusal::Key(refusal))),
            AccessOutcome::Unsupported(id) => (id, Response::Refused(Refusal::Unsupported)),
            AccessOutcome::Nothing => return self.handshake(),
        };
        let mut bytes = encode_response(&response, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
        bytes.extend(self.handshake());
        bytes
    }
}

/// Faults of answers on the line.
#[derive(Clone, Copy, Default)]
pub(crate) struct Faults {
    /// Random bytes before every answer.
    pub(crate) noise_bytes: usize,
    /// Loses every Nth byte; 0: none.
    pub(crate) drop_one_in: u32,
    /// Delays every Nth answer; 0: none.
    pub(crate) late_each: u32,
    /// Delays the answer of every Nth command; 0: none.
    pub(crate) late_commands_each: u32,
}

/// A device behind a socket.
pub(crate) struct Emulated {
    pub(crate) port: String,
    pub(crate) robot: Arc<Mutex<Robot>>,
}

impl Emulated {
    pub(crate) fn start() -> Self {
        Self::on(Faults::default())
    }

    pub(crate) fn on(faults: Faults) -> Self {
        let robot = Arc::new(Mutex::new(Robot::new()));
        let shared = Arc::clone(&robot);
        let mut random = rand_pcg::Pcg32::seed_from_u64(7);
        let mut answers = 0;
        let port = listen(move |content| {
            let (frame, is_command, commands) = {
                let mut robot = shared.lock().unwrap();
                let before = robot.commands;
                (robot.answer(content), robot.commands > before, robot.commands)
            };
            answers += 1;
            let is_late = |count: u32, each| each != 0 && count.is_multiple_of(each);
            if is_late(answers, faults.late_each)
                || is_command && is_late(commands, faults.late_commands_each)
            {
                thread::sleep(LATE);
            }
            let mut bytes = vec![0; faults.noise_bytes];
            random.fill_bytes(&mut bytes);
            bytes.extend(frame);
            bytes.retain(|_| faults.drop_one_in == 0 || random.next_u32() % faults.drop_one_in != 0);
            bytes
        });
        Self { port, robot }
    }

    /// Starts a device with one side of the shipped scheme running.
    pub(crate) fn with_scheme(side: &str) -> Self {
        let emulated = Self::start();
        let mut device = emulated.connect(QUICK);
        device.send_scheme(&SchemeText::read("builtin:bilateral").unwrap(), side).unwrap();
        emulated
    }

    pub(crate) fn connect(&self, patience: Timeouts) -> Device<Box<dyn Stream>> {
        Device::identify(open_port(&self.port, 0).unwrap(), patience, ALL).unwrap()
    }

    pub(crate) fn state(&self) -> String {
        format!("{:?}", self.robot.lock().unwrap().dimsart)
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        dimsart(&[&["connect", &self.port], arguments].concat())
    }

    /// Returns standard output of a command that ends with `status`.
    pub(crate) fn out(&self, arguments: &[&str], status: i32) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {output:?}");
        String::from_utf8(output.stdout).unwrap()
    }

    pub(crate) fn json(&self, arguments: &[&str], status: i32) -> serde_json::Value {
        serde_json::from_str(&self.out(arguments, status)).unwrap()
    }
}

/// A socket at which `answer` converts the content of every frame to bytes.
pub(crate) fn listen(answer: impl FnMut(&[u8]) -> Vec<u8> + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    let answer = Arc::new(Mutex::new(answer));
    thread::spawn(move || {
        for stream in listener.incoming() {
            let answer = Arc::clone(&answer);
            thread::spawn(move || talk(&stream.unwrap(), |content| (*answer.lock().unwrap())(content)));
        }
    });
    port
}

fn talk(mut stream: &TcpStream, answer: impl Fn(&[u8]) -> Vec<u8>) {
    let (mut receiver, mut buffer) = (Receiver::new(), [0; 256]);
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        let mut bytes = Vec::new();
        receiver.push_all(&buffer[..count], |content| bytes.extend(answer(content)));
        if stream.write_all(&bytes).is_err() {
            break;
        }
    }
}

pub(crate) fn dimsart(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dimsart")).args(arguments).output().unwrap()
}

pub(crate) fn message(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    String::from_utf8(output.stderr.clone()).unwrap()
}
