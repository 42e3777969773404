//! A controller that ticks by itself, as a board does, on a line that all its clients share.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use dimsart::connect::Device;
use dimsart_core::protocol::{
    HEARTBEATS_PER_S, MAX_FRAME_BYTES, Receiver, Request, decode_request, encode_heartbeat, encode_sample,
};
use dimsart_core::{Tick, Word};
use hil_sim::link::{Stream, open_port};

use crate::emulated::{MEASURED_WORDS, QUICK, Robot};

pub(crate) const TICK_HZ: u32 = 1000;

/// What all of its threads know.
#[derive(Default)]
struct Shared {
    clients: Mutex<Vec<TcpStream>>,
    last: Mutex<Option<(Tick, [Word; 3])>>,
    is_stopped: AtomicBool,
    /// Answers about its state that get lost from now on.
    lost_answers: AtomicU32,
}

/// A board at a socket. Whatever it says, every client hears.
pub(crate) struct Board {
    pub(crate) port: String,
    pub(crate) robot: Arc<Mutex<Robot>>,
    shared: Arc<Shared>,
}

impl Board {
    pub(crate) fn start() -> Self {
        let mut robot = Robot::new();
        robot.info = robot.info.for_clients(TICK_HZ);
        let (robot, shared) = (Arc::new(Mutex::new(robot)), Arc::new(Shared::default()));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = format!("tcp:{}", listener.local_addr().unwrap());
        let board = Self { port, robot, shared };
        let (robot, shared) = (Arc::clone(&board.robot), Arc::clone(&board.shared));
        thread::spawn(move || tick(&robot, &shared));
        let (robot, shared) = (Arc::clone(&board.robot), Arc::clone(&board.shared));
        thread::spawn(move || {
            for stream in listener.incoming().map(Result::unwrap) {
                shared.clients.lock().unwrap().push(stream.try_clone().unwrap());
                let (robot, shared) = (Arc::clone(&robot), Arc::clone(&shared));
                thread::spawn(move || answer(stream, &robot, &shared));
            }
        });
        board
    }

    pub(crate) fn connect(&self) -> Device<Box<dyn Stream>> {
        Device::greet(open_port(&self.port, 0).unwrap(), QUICK).unwrap()
    }

    /// Lets it tick no more.
    pub(crate) fn stop(&self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Loses the next answers about its state.
    pub(crate) fn lose_answers(&self, count: u32) {
        self.shared.lost_answers.store(count, Ordering::Relaxed);
    }

    /// Waits for a tick that ends like this, and gives what it commanded.
    pub(crate) fn wait_for(&self, wanted: Tick) -> [Word; 3] {
        for _ in 0..20_000 {
            match *self.shared.last.lock().unwrap() {
                Some((tick, commanded)) if tick == wanted => return commanded,
                _ => thread::sleep(Duration::from_millis(1)),
            }
        }
        unreachable!("no tick ended as {wanted:?}")
    }
}

impl Shared {
    fn say(&self, bytes: &[u8]) {
        self.clients.lock().unwrap().retain_mut(|stream| stream.write_all(bytes).is_ok());
    }
}

fn tick(robot: &Mutex<Robot>, shared: &Shared) {
    for number in (0..TICK_HZ / HEARTBEATS_PER_S).cycle() {
        thread::sleep(Duration::from_millis(1));
        if shared.is_stopped.load(Ordering::Relaxed) {
            return;
        }
        let mut robot = robot.lock().unwrap();
        let (mut measured, mut commanded) = ([Word(0); MEASURED_WORDS], [Word(0); 3]);
        measured[0] = Word::from(0.25);
        let Robot { dimsart, info, .. } = &mut *robot;
        dimsart.allow_motion(info.begin_tick());
        let tick = dimsart.tick(&measured, &mut commanded);
        info.end_tick(tick, dimsart);
        let samples: Vec<_> = info.samples(dimsart.engine().data_base()).collect();
        let heartbeat = (number == 0).then(|| info.heartbeat(7));
        drop(robot);
        *shared.last.lock().unwrap() = Some((tick, commanded));
        let mut frame = [0; MAX_FRAME_BYTES];
        for sample in samples {
            shared.say(encode_sample(&sample, &mut frame).unwrap());
        }
        if let Some(heartbeat) = heartbeat {
            shared.say(encode_heartbeat(&heartbeat, 1, &mut frame).unwrap());
        }
    }
}

fn answer(mut stream: TcpStream, robot: &Mutex<Robot>, shared: &Shared) {
    let (mut receiver, mut buffer) = (Receiver::new(), [0; 256]);
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        receiver.take_all(&buffer[..count], |content| {
            let answer = robot.lock().unwrap().answer(content);
            let is_about_state = matches!(decode_request(content), Ok((_, Request::Status)));
            let lose = |left: u32| left.checked_sub(1).filter(|_| is_about_state);
            if shared.lost_answers.fetch_update(Ordering::Relaxed, Ordering::Relaxed, lose).is_err() {
                shared.say(&answer);
            }
        });
    }
}
