//! A controller that ticks by itself, like a board, on a line shared by all clients.
//!
//! It runs in the test's time: it ticks once, a millisecond later, whenever a client waits. For separate programs it is
//! [served](Board::serve) in real time, with leases of a minute.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Result, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use dimsart::connect::{Device, Timeouts};
use dimsart_core::{TickResult, Word};
use dimsart_link::protocol::{
    HEARTBEATS_PER_S, MAX_FRAME_BYTES, Receiver, Request, decode_request, encode_heartbeat, encode_sample,
};
use hil_sim::clock::{self, SimulatedTimeGuard};
use hil_sim::link::open_port;

use crate::emulated::{MEASURED_WORDS, QUICK, Robot};

const TICK_HZ: u32 = 1000;
const PERIOD: Duration = Duration::from_millis(1);
/// A lease is 0.2 s of this number of ticks.
const MINUTE_LEASE_HZ: u32 = 300_000;

/// A board, ticked by the test's thread unless it is served.
pub(crate) struct Board {
    pub(crate) core: Arc<Mutex<Core>>,
    /// Port for programs.
    pub(crate) port: Option<String>,
    _time: Option<SimulatedTimeGuard>,
}

/// State shared by all clients.
pub(crate) struct Core {
    pub(crate) robot: Robot,
    clients: Vec<Box<dyn Write + Send>>,
    requests: Vec<Vec<u8>>,
    ticks: u32,
    last: Option<(TickResult, [Word; 3])>,
    is_stopped: bool,
    /// Number of the next status answers to lose.
    lost_answers: u32,
}

/// A client's end of the line.
pub(crate) struct Client {
    core: Arc<Mutex<Core>>,
    receiver: Receiver,
    came: Queue,
}

/// Unread bytes of a client.
#[derive(Clone, Default)]
struct Queue(Arc<Mutex<VecDeque<u8>>>);

impl Board {
    /// Starts a board in the test's time.
    pub(crate) fn start() -> Self {
        Self { core: Core::new(TICK_HZ), port: None, _time: Some(clock::freeze_time()) }
    }

    /// Serves a board in real time at a socket.
    pub(crate) fn serve() -> Self {
        let core = Core::new(MINUTE_LEASE_HZ);
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = Some(format!("tcp:{}", listener.local_addr().unwrap()));
        let of_ticks = Arc::clone(&core);
        thread::spawn(move || {
            loop {
                thread::sleep(PERIOD);
                of_ticks.lock().unwrap().tick();
            }
        });
        let of_clients = Arc::clone(&core);
        thread::spawn(move || {
            for stream in listener.incoming().map(|stream| stream.unwrap()) {
                of_clients.lock().unwrap().clients.push(Box::new(stream.try_clone().unwrap()));
                let core = Arc::clone(&of_clients);
                thread::spawn(move || take(stream, &core));
            }
        });
        Self { core, port, _time: None }
    }

    /// Connects a client to a board in the test's time.
    pub(crate) fn connect(&self) -> Device<Client> {
        self.connect_with(QUICK)
    }

    pub(crate) fn connect_with(&self, patience: Timeouts) -> Device<Client> {
        Device::identify(self.line(), patience, dimsart_modules::ALL).unwrap()
    }

    pub(crate) fn line(&self) -> Client {
        let came = Queue::default();
        self.core.lock().unwrap().clients.push(Box::new(came.clone()));
        Client { core: Arc::clone(&self.core), receiver: Receiver::new(), came }
    }

    /// Connects a client to a served board.
    pub(crate) fn dial(&self) -> Device<Box<dyn hil_sim::link::Stream>> {
        Device::identify(open_port(self.port.as_ref().unwrap(), 0).unwrap(), QUICK, dimsart_modules::ALL)
            .unwrap()
    }

    /// Stops the ticks.
    pub(crate) fn stop(&self) {
        self.core.lock().unwrap().is_stopped = true;
    }

    /// Loses the next status answers.
    pub(crate) fn lose_answers(&self, count: u32) {
        self.core.lock().unwrap().lost_answers = count;
    }

    /// Waits for a tick with this result and returns its command.
    pub(crate) fn wait_for(&self, wanted: TickResult) -> [Word; 3] {
        for _ in 0..60_000 {
            match self.core.lock().unwrap().last {
                Some((tick, commanded)) if tick == wanted => return commanded,
                _ => {}
            }
            match &self.port {
                Some(_) => thread::sleep(PERIOD),
                None => self.core.lock().unwrap().pass(),
            }
        }
        unreachable!("no tick ended as {wanted:?}")
    }
}

impl Core {
    fn new(tick_hz: u32) -> Arc<Mutex<Self>> {
        let mut robot = Robot::new();
        robot.info = robot.info.with_client_lease(tick_hz);
        Arc::new(Mutex::new(Self {
            robot,
            clients: Vec::new(),
            requests: Vec::new(),
            ticks: 0,
            last: None,
            is_stopped: false,
            lost_answers: 0,
        }))
    }

    /// Advances by a millisecond.
    fn pass(&mut self) {
        clock::sleep(PERIOD);
        self.tick();
    }

    /// Sends bytes to every client.
    fn say(&mut self, bytes: &[u8]) {
        self.clients.retain_mut(|client| client.write_all(bytes).is_ok());
    }

    fn tick(&mut self) {
        for content in std::mem::take(&mut self.requests) {
            let answer = self.robot.answer(&content);
            let is_about_state = matches!(decode_request(&content), Ok((_, Request::Status)));
            match self.lost_answers.checked_sub(1).filter(|_| is_about_state) {
                Some(left) => self.lost_answers = left,
                None => self.say(&answer),
            }
        }
        if self.is_stopped {
            return;
        }
        let (mut measured, mut commanded) = ([Word(0); MEASURED_WORDS], [Word(0); 3]);
        measured[0] = Word::from(0.25);
        let Robot { dimsart, info, .. } = &mut self.robot;
        dimsart.set_motion_allowed(info.begin_tick());
        let tick = dimsart.tick(&measured, &mut commanded);
        info.end_tick(tick, dimsart);
        let samples: Vec<_> = info.samples(dimsart.engine().data_base()).collect();
        self.last = Some((tick, commanded));
        let mut frame = [0; MAX_FRAME_BYTES];
        for sample in samples {
            self.say(encode_sample(&sample, &mut frame).unwrap());
        }
        if self.ticks.is_multiple_of(TICK_HZ / HEARTBEATS_PER_S) {
            let heartbeat = self.robot.info.heartbeat(7);
            self.say(encode_heartbeat(&heartbeat, 1, &mut frame).unwrap());
        }
        self.ticks += 1;
    }
}

/// Handles requests of a client of a served board.
fn take(mut stream: TcpStream, core: &Mutex<Core>) {
    let (mut receiver, mut buffer) = (Receiver::new(), [0; 256]);
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        receiver.push_all(&buffer[..count], |content| core.lock().unwrap().requests.push(content.to_vec()));
    }
}

impl Read for Client {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        if self.came.0.lock().unwrap().is_empty() {
            self.core.lock().unwrap().pass();
        }
        match self.came.0.lock().unwrap().read(buffer)? {
            0 => Err(ErrorKind::WouldBlock.into()),
            count => Ok(count),
        }
    }
}

impl Write for Client {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let core = &self.core;
        self.receiver.push_all(bytes, |content| core.lock().unwrap().requests.push(content.to_vec()));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Write for Queue {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}
