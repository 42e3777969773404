//! A STOP among hostile clients, with a simulated port and clock.

use super::*;
use dimsart_core::Command;
use dimsart_link::protocol::{Request, Response, decode_request, encode_request, encode_response};
use std::sync::{Arc, Mutex};

const HOSTILE: usize = 8;

/// A device that accepts bytes while it is open, and answers every request immediately.
#[derive(Debug, Clone, Default)]
struct Port(Arc<Mutex<Wire>>);

#[derive(Debug, Default)]
struct Wire {
    is_blocked: bool,
    /// Maximum bytes per write; 0: unlimited.
    most: usize,
    receiver: dimsart_link::protocol::Receiver,
    /// Received requests, in order.
    requests: Vec<Request>,
    answers: Vec<u8>,
}

impl Read for Port {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let answers = &mut self.0.lock().unwrap().answers;
        let count = answers.len().min(buffer.len());
        buffer[..count].copy_from_slice(&answers[..count]);
        answers.drain(..count);
        if count == 0 { Err(ErrorKind::WouldBlock.into()) } else { Ok(count) }
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let Wire { is_blocked, most, receiver, requests, answers } = &mut *self.0.lock().unwrap();
        if *is_blocked {
            return Err(ErrorKind::TimedOut.into());
        }
        let count = if *most == 0 { bytes.len() } else { bytes.len().min(*most) };
        *is_blocked = *most != 0;
        receiver.push_all(&bytes[..count], |content| {
            if let Ok((id, request)) = decode_request(content) {
                requests.push(request);
                let mut frame = [0; MAX_FRAME_BYTES];
                answers.extend(encode_response(&Response::Restarts, id, &mut frame).unwrap());
            }
        });
        Ok(count)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn frame(id: u16, request: Request) -> Vec<u8> {
    encode_request(&request, id, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
}

const STOP: Request = Request::Command(Command::Stop);

struct Bench {
    passing: Passing,
    port: Port,
    now: Instant,
    hostile: Vec<Pipe>,
    ninth: Pipe,
}

impl Bench {
    fn new() -> Self {
        let port = Port::default();
        let mut passing = Passing::new(Box::new(port.clone()));
        let mut join = || {
            let [client, here] = pair_with_capacities([Duration::ZERO; 2], [MAX_QUEUED_WRITES, CLIENT_ROOM]);
            passing.welcome(here);
            client
        };
        let (hostile, ninth) = ((0..HOSTILE).map(|_| join()).collect(), join());
        Self { passing, port, now: Instant::now(), hostile, ninth }
    }

    /// Every hostile client writes until the broker blocks; one client is replaced.
    fn flood(&mut self) {
        let whole = frame(1, Request::Status);
        let (half, _) = whole.split_at(5);
        let pieces = [
            whole.repeat(40),
            frame(2, STOP),
            frame(3, STOP).repeat(40),
            half.to_vec(),
            vec![0xA5; 1000],
            vec![0; 1000],
            // A response, which no device answers.
            encode_response(&Response::Restarts, 9, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec(),
            whole.clone(),
        ];
        for (client, piece) in self.hostile.iter_mut().zip(&pieces) {
            while client.write(piece).is_ok() {}
        }
        let [client, here] = pair_with_capacities([Duration::ZERO; 2], [MAX_QUEUED_WRITES, CLIENT_ROOM]);
        self.passing.welcome(here);
        self.hostile[HOSTILE - 1] = client;
    }

    fn round(&mut self) {
        self.now += Duration::from_millis(1);
        assert!(self.passing.round(self.now));
    }

    fn requests(&self) -> usize {
        self.port.0.lock().unwrap().requests.len()
    }
}

#[test]
fn the_stop_of_a_ninth_client_goes_out_among_the_next_frames() {
    let mut bench = Bench::new();
    for round in 0..600 {
        bench.flood();
        bench.round();
        let waiting = bench.passing.turns.len();
        assert!(waiting <= HOSTILE * (turns::ROOM + 3), "round {round}: {waiting} frames wait");
        if round % 100 == 99 {
            let before = bench.requests();
            bench.ninth.write_all(&frame(900, STOP)).unwrap();
            bench.flood();
            bench.round();
            let sent = bench.port.0.lock().unwrap().requests[before..].to_vec();
            // This request, and the same request of two hostile clients.
            assert!((1..=4).contains(&sent.len()), "{sent:?}");
            assert!(sent[..sent.len() - 1].iter().all(|request| *request == STOP), "{sent:?}");
            let mut answers = Vec::new();
            bench.round();
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = bench.ninth.read(&mut buffer) {
                answers.extend_from_slice(&buffer[..count]);
            }
            let mut ids = Vec::new();
            dimsart_link::protocol::Receiver::new().push_all(&answers, |content| {
                ids.push(decode_response(content).unwrap().0);
            });
            assert!(ids.contains(&900), "it is answered: {ids:?}");
        }
    }
    // The other clients are served, too.
    let sent = bench.port.0.lock().unwrap().requests.clone();
    assert!(sent.contains(&Request::Status));
    assert!(bench.passing.clients.len() <= HOSTILE + 2, "clients that are gone are forgotten");
}

#[test]
fn a_port_that_takes_no_bytes_keeps_nothing_but_a_stop_waiting() {
    let mut bench = Bench::new();
    bench.port.0.lock().unwrap().is_blocked = true;
    for _ in 0..500 {
        bench.flood();
        bench.ninth.write_all(&frame(900, STOP)).unwrap();
        bench.round();
        assert!(bench.passing.turns.len() <= (HOSTILE + 1) * (turns::ROOM + 3));
    }
    // A few bytes per write: the current frame is completed, then the STOPs follow.
    bench.port.0.lock().unwrap().most = 3;
    for _ in 0..40 {
        bench.port.0.lock().unwrap().is_blocked = false;
        bench.round();
    }
    assert!(bench.requests() >= 2, "{}", bench.requests());
    assert!(bench.port.0.lock().unwrap().requests.iter().all(|request| *request == STOP));
}

#[test]
fn a_stop_behind_a_flood_of_the_same_client_goes_out_after_few_frames() {
    let mut bench = Bench::new();
    let flood = frame(1, Request::Status).repeat(95);
    while bench.ninth.write(&flood[..1000]).is_ok() {}
    // Space for one more write.
    bench.round();
    bench.ninth.write_all(&[vec![0], frame(900, STOP)].concat()).unwrap();
    let rounds = CLIENT_ROOM * 1024 / ROUND_BYTES + 2;
    let is_sent = (0..rounds).any(|_| {
        bench.round();
        bench.port.0.lock().unwrap().requests.contains(&STOP)
    });
    assert!(is_sent, "after {rounds} rounds");
    assert!(bench.requests() <= rounds + 2, "{} frames before", bench.requests());
}
