//! Whose frame goes over the port next.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use dimsart_core::Command;
use dimsart_core::protocol::{LeaseAction, Request, decode_request};

/// How long the answer to a request keeps others waiting. It is shorter than a renewal of the lease can wait.
const PATIENCE: Duration = Duration::from_millis(45);
/// Frames of one client that wait; more are dropped, as by a device without room.
const ROOM: usize = 64;

/// Frames that wait. A device answers one request at a time, so that one is sent at a time: then what is urgent never waits
/// behind a heap of others.
#[derive(Debug, Default)]
pub(super) struct Turns {
    urgent: VecDeque<Vec<u8>>,
    /// The client whose turn it is first.
    queues: VecDeque<Queue>,
    /// Id of the request that is not answered yet, and when it was sent.
    asked: Option<(u16, Instant)>,
}

#[derive(Debug)]
struct Queue {
    client: u64,
    frames: VecDeque<Frame>,
}

#[derive(Debug)]
struct Frame {
    bytes: Vec<u8>,
    /// None for what is not answered, or by what nobody but its client can read.
    id: Option<u16>,
}

impl Turns {
    /// Has a frame of a client wait for its turn.
    pub(super) fn add(&mut self, client: u64, bytes: Vec<u8>, content: &[u8]) {
        let request = decode_request(content).ok();
        if request.is_some_and(|(_, request)| is_urgent(&request)) {
            self.urgent.push_back(bytes);
            return;
        }
        let frame = Frame { bytes, id: request.map(|(id, _)| id) };
        match self.queues.iter_mut().find(|queue| queue.client == client) {
            Some(queue) if queue.frames.len() < ROOM => queue.frames.push_back(frame),
            Some(_) => {}
            None => self.queues.push_back(Queue { client, frames: VecDeque::from([frame]) }),
        }
    }

    /// Drops what a client that is gone has waiting.
    pub(super) fn forget(&mut self, client: u64) {
        self.queues.retain(|queue| queue.client != client);
    }

    /// The frame that goes out now.
    pub(super) fn next(&mut self, now: Instant) -> Option<Vec<u8>> {
        if let Some(frame) = self.urgent.pop_front() {
            return Some(frame);
        }
        if self.asked.is_some_and(|(_, sent)| now.duration_since(sent) < PATIENCE) {
            return None;
        }
        let mut queue = self.queues.pop_front()?;
        let frame = queue.frames.pop_front();
        if !queue.frames.is_empty() {
            self.queues.push_back(queue);
        }
        let Frame { bytes, id } = frame?;
        self.asked = id.map(|id| (id, now));
        Some(bytes)
    }

    /// A request of this id has been answered.
    pub(super) fn answered(&mut self, id: u16) {
        self.asked = self.asked.filter(|(asked, _)| *asked != id);
    }
}

/// What brings a device to rest, or keeps it alive.
fn is_urgent(request: &Request) -> bool {
    matches!(
        request,
        Request::Command(Command::Stop) | Request::Lease(LeaseAction::Renew | LeaseAction::GiveBack)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_core::protocol::{MAX_FRAME_BYTES, Receiver, encode_request};

    struct Bench(Turns, Instant);

    impl Bench {
        fn new() -> Self {
            Self(Turns::default(), Instant::now())
        }

        fn add(&mut self, client: u64, id: u16, request: Request) {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let frame = encode_request(&request, id, &mut buffer).unwrap();
            let mut content = Vec::new();
            Receiver::new().take_all(frame, |found| content = found.to_vec());
            self.0.add(client, frame.to_vec(), &content);
        }

        /// Id of what goes out after some time.
        fn next(&mut self, after: Duration) -> Option<u16> {
            let frame = self.0.next(self.1 + after)?;
            let mut id = None;
            Receiver::new().take_all(&frame, |found| id = Some(decode_request(found).unwrap().0));
            id
        }
    }

    #[test]
    fn clients_take_turns_and_each_waits_for_the_answer_to_the_one_before() {
        let mut bench = Bench::new();
        for (client, id) in [(1, 10), (1, 11), (2, 20), (3, 30)] {
            bench.add(client, id, Request::Status);
        }
        let mut sent = Vec::new();
        while let Some(id) = bench.next(Duration::ZERO) {
            assert_eq!(bench.next(Duration::ZERO), None, "the answer to {id} is still to come");
            bench.0.answered(id + 1);
            assert_eq!(bench.next(Duration::ZERO), None, "that was the answer to another one");
            bench.0.answered(id);
            sent.push(id);
        }
        assert_eq!(sent, [10, 20, 30, 11]);
    }

    #[test]
    fn what_stops_waits_for_nobody() {
        let mut bench = Bench::new();
        for id in 0..200 {
            bench.add(1, id, Request::Status);
        }
        assert_eq!(bench.next(Duration::ZERO), Some(0));
        bench.add(2, 900, Request::Command(Command::Stop));
        bench.add(3, 901, Request::Lease(LeaseAction::Renew));
        assert_eq!([bench.next(Duration::ZERO), bench.next(Duration::ZERO)], [Some(900), Some(901)]);
        assert_eq!(bench.next(Duration::ZERO), None);
    }

    #[test]
    fn an_answer_that_is_lost_holds_the_others_up_for_a_moment_only() {
        let mut bench = Bench::new();
        bench.add(1, 1, Request::Status);
        bench.add(2, 2, Request::Status);
        assert_eq!(bench.next(Duration::ZERO), Some(1));
        assert_eq!(bench.next(PATIENCE - Duration::from_millis(1)), None);
        assert_eq!(bench.next(PATIENCE), Some(2));
    }

    #[test]
    fn a_client_that_is_gone_takes_nobody_s_turn() {
        let mut bench = Bench::new();
        bench.add(1, 1, Request::Status);
        bench.add(2, 2, Request::Status);
        bench.0.forget(1);
        assert_eq!(bench.next(Duration::ZERO), Some(2));
    }
}
