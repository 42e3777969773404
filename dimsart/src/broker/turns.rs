//! Schedules the frames of all clients.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use dimsart_core::Command;
use dimsart_link::protocol::{LeaseAction, Request, decode_request};

/// Maximum wait for an answer before the next request; shorter than the slack of a lease renewal.
const PATIENCE: Duration = Duration::from_millis(45);
/// Wait after a frame without a readable answer: about its time on a serial line.
const PAUSE: Duration = Duration::from_millis(3);
/// Capacity of a client's queue; further frames are dropped.
pub(super) const ROOM: usize = 64;

/// Pending frames. One request is sent at a time, since a device answers one at a time; so an urgent request never waits behind
/// many others. Each client has at most one pending request of each urgency, sent after the answer to the previous one.
#[derive(Debug, Default)]
pub(super) struct Turns {
    urgent: VecDeque<Urgent>,
    /// Client, urgency, id and deadline of unanswered urgent requests.
    unanswered: Vec<(u64, Urgency, u16, Instant)>,
    /// In the order of their turns.
    queues: VecDeque<Queue>,
    /// Id and deadline of the unanswered normal request.
    asked: Option<(Option<u16>, Instant)>,
}

/// Requests that stop a device or keep its lease, by priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Urgency {
    Stop,
    Release,
    Renew,
}

#[derive(Debug)]
struct Urgent {
    client: u64,
    urgency: Urgency,
    id: u16,
    bytes: Vec<u8>,
}

#[derive(Debug)]
struct Queue {
    client: u64,
    frames: VecDeque<Frame>,
}

#[derive(Debug)]
struct Frame {
    bytes: Vec<u8>,
    /// None if there is no answer, or only its client can read it.
    id: Option<u16>,
}

/// The frame to send now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Next {
    pub(super) bytes: Vec<u8>,
    pub(super) is_urgent: bool,
}

impl Turns {
    /// Queues a frame. Replaces a pending request of the same client and urgency.
    pub(super) fn add(&mut self, client: u64, bytes: Vec<u8>, content: &[u8]) {
        let request = decode_request(content).ok();
        if let Some((id, urgency)) = request.and_then(|(id, request)| Some((id, urgency(&request)?))) {
            let is_same = |found: &&mut Urgent| (found.client, found.urgency) == (client, urgency);
            match self.urgent.iter_mut().find(is_same) {
                Some(waiting) => (waiting.id, waiting.bytes) = (id, bytes),
                None => self.urgent.push_back(Urgent { client, urgency, id, bytes }),
            }
            return;
        }
        let frame = Frame { bytes, id: request.map(|(id, _)| id) };
        match self.queues.iter_mut().find(|queue| queue.client == client) {
            Some(queue) if queue.frames.len() < ROOM => queue.frames.push_back(frame),
            Some(_) => {}
            None => self.queues.push_back(Queue { client, frames: VecDeque::from([frame]) }),
        }
    }

    /// Drops the pending frames of a disconnected client, except STOP.
    pub(super) fn forget(&mut self, client: u64) {
        self.queues.retain(|queue| queue.client != client);
        self.urgent.retain(|found| found.client != client || found.urgency == Urgency::Stop);
    }

    /// Returns the frame to send now.
    pub(super) fn next(&mut self, now: Instant) -> Option<Next> {
        if let Some(bytes) = self.next_urgent(now) {
            return Some(Next { bytes, is_urgent: true });
        }
        if self.asked.is_some_and(|(_, until)| now < until) {
            return None;
        }
        let mut queue = self.queues.pop_front()?;
        let frame = queue.frames.pop_front();
        if !queue.frames.is_empty() {
            self.queues.push_back(queue);
        }
        let Frame { bytes, id } = frame?;
        self.asked = Some((id, now + if id.is_some() { PATIENCE } else { PAUSE }));
        Some(Next { bytes, is_urgent: false })
    }

    fn next_urgent(&mut self, now: Instant) -> Option<Vec<u8>> {
        let Self { urgent, unanswered, .. } = self;
        unanswered.retain(|(.., until)| now < *until);
        let may_go = |found: &Urgent| {
            unanswered
                .iter()
                .all(|(client, urgency, ..)| (*client, *urgency) != (found.client, found.urgency))
        };
        // The first of the highest urgency.
        let waiting = urgent.iter().enumerate().filter(|(_, found)| may_go(found));
        let (place, _) = waiting.min_by_key(|(_, found)| found.urgency)?;
        let Urgent { client, urgency, id, bytes } = urgent.remove(place)?;
        unanswered.push((client, urgency, id, now + PATIENCE));
        Some(bytes)
    }

    /// Notes the answer to a request.
    pub(super) fn answered(&mut self, id: u16) {
        self.unanswered.retain(|(.., asked, _)| *asked != id);
        self.asked = self.asked.filter(|(asked, _)| *asked != Some(id));
    }

    /// Number of pending frames.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.urgent.len() + self.queues.iter().map(|queue| queue.frames.len()).sum::<usize>()
    }
}

fn urgency(request: &Request) -> Option<Urgency> {
    match request {
        Request::Command(Command::Stop) => Some(Urgency::Stop),
        Request::Lease(LeaseAction::Release) => Some(Urgency::Release),
        Request::Lease(LeaseAction::Renew) => Some(Urgency::Renew),
        _ => None,
    }
}

/// Whether a frame's content is a STOP.
pub(super) fn is_stop(content: &[u8]) -> bool {
    decode_request(content).is_ok_and(|(_, request)| urgency(&request) == Some(Urgency::Stop))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dimsart_link::protocol::{MAX_FRAME_BYTES, Receiver, encode_request};

    struct Bench(Turns, Instant);

    impl Bench {
        fn new() -> Self {
            Self(Turns::default(), Instant::now())
        }

        fn add(&mut self, client: u64, id: u16, request: Request) {
            let mut buffer = [0; MAX_FRAME_BYTES];
            let frame = encode_request(&request, id, &mut buffer).unwrap();
            let mut content = Vec::new();
            Receiver::new().push_all(frame, |found| content = found.to_vec());
            self.0.add(client, frame.to_vec(), &content);
        }

        /// Id of the frame sent after some time.
        fn next(&mut self, after: Duration) -> Option<u16> {
            let frame = self.0.next(self.1 + after)?.bytes;
            let mut id = None;
            Receiver::new().push_all(&frame, |found| id = Some(decode_request(found).unwrap().0));
            id
        }
    }

    const STOP: Request = Request::Command(Command::Stop);

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
    fn urgent_requests_go_first_and_stop_before_all() {
        let mut bench = Bench::new();
        for id in 0..200 {
            bench.add(1, id, Request::Status);
        }
        assert_eq!(bench.next(Duration::ZERO), Some(0));
        bench.add(3, 901, Request::Lease(LeaseAction::Renew));
        bench.add(2, 900, STOP);
        assert_eq!([bench.next(Duration::ZERO), bench.next(Duration::ZERO)], [Some(900), Some(901)]);
        assert_eq!(bench.next(Duration::ZERO), None);
    }

    #[test]
    fn of_many_stops_of_a_client_one_waits_and_every_client_has_its_turn() {
        let mut bench = Bench::new();
        for id in 0..10_000 {
            bench.add(1, id, STOP);
            bench.add(1, id, Request::Lease(LeaseAction::Renew));
            bench.add(1, id, Request::Lease(LeaseAction::Release));
        }
        assert_eq!(bench.0.len(), 3);
        bench.add(2, 20_000, STOP);
        assert_eq!(bench.next(Duration::ZERO), Some(9999));
        bench.add(1, 10_001, STOP);
        assert_eq!(bench.next(Duration::ZERO), Some(20_000), "each stop is answered");
        assert_eq!([bench.next(Duration::ZERO), bench.next(Duration::ZERO)], [Some(9999); 2], "of the lease");
        assert_eq!(bench.next(Duration::ZERO), None, "the answer to the stop before is still to come");
        bench.0.answered(9999);
        assert_eq!(bench.next(Duration::ZERO), Some(10_001));
        bench.add(1, 10_002, STOP);
        assert_eq!(
            bench.next(PATIENCE),
            Some(10_002),
            "an answer that is lost holds it up for a moment only"
        );
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
    fn a_client_that_is_gone_takes_no_turn_and_its_stop_is_sent() {
        let mut bench = Bench::new();
        for (client, request) in [(1, Request::Status), (1, STOP), (2, Request::Status)] {
            bench.add(client, u16::try_from(client).unwrap(), request);
        }
        bench.add(1, 1, Request::Lease(LeaseAction::Renew));
        bench.0.forget(1);
        assert_eq!([bench.next(Duration::ZERO), bench.next(Duration::ZERO)], [Some(1), Some(2)]);
        assert_eq!(bench.0.len(), 0);
    }
}
