//! A station of a controller without a clock: its lease ends only by actions of clients.

use super::super::action::Edit;
use super::*;
use dimsart_core::{Command, TickResult};
use dimsart_link::protocol::{
    DeviceInfo, MAX_FRAME_BYTES, NO_CLIENT, Receiver, Request, decode_request, encode_response, serve,
};
use hil_sim::response::loaded_controllers;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};

#[derive(Debug)]
struct Controller {
    dimsart: Box<SimulatedDimsart>,
    info: DeviceInfo,
    /// Number of set parameters.
    sets: usize,
}

impl Controller {
    fn tick(&mut self) -> TickResult {
        let frame = self.dimsart.frame();
        let measured = vec![dimsart_core::Word(0); frame.output_words()];
        let mut commanded = vec![dimsart_core::Word(0); frame.input_words()];
        self.dimsart.set_motion_allowed(self.info.begin_tick());
        let tick = self.dimsart.tick(&measured, &mut commanded);
        self.info.end_tick(tick, &self.dimsart);
        tick
    }
}

/// The controller of the shipped joint, which answers clients while the gate is open.
#[derive(Debug, Clone)]
struct Shared(Arc<Mutex<Controller>>, Arc<Mutex<()>>);

#[derive(Debug)]
struct Line {
    shared: Shared,
    receiver: Receiver,
    answers: VecDeque<u8>,
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Self { shared, receiver, answers } = self;
        drop(shared.1.lock().unwrap());
        let Controller { dimsart, info, sets } = &mut *shared.0.lock().unwrap();
        receiver.push_all(bytes, |content| {
            let (id, request) = decode_request(content).unwrap();
            *sets += usize::from(matches!(request, Request::Command(Command::Set { .. })));
            let answer = serve(id, &request, dimsart, info);
            answers.extend(encode_response(&answer, id, &mut [0; MAX_FRAME_BYTES]).unwrap());
        });
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.answers.read(buffer)? {
            0 => {
                thread::sleep(Duration::from_millis(1));
                Err(ErrorKind::WouldBlock.into())
            }
            count => Ok(count),
        }
    }
}

fn station() -> (Station, Shared) {
    let file = RigFile::read(RigFile::shipped("joint").unwrap(), "joint", PathBuf::new(), &[]).unwrap();
    let dimsart = loaded_controllers(&file).unwrap().remove(0).dimsart;
    let info = DeviceInfo::new("test").with_laws().with_client_lease(1000);
    let shared = Shared(Arc::new(Mutex::new(Controller { dimsart, info, sets: 0 })), Arc::default());
    let lines = shared.clone();
    let open: OpenLine = Box::new(move || {
        let (receiver, answers) = (Receiver::new(), VecDeque::new());
        Ok(Box::new(Line { shared: lines.clone(), receiver, answers }))
    });
    let access = Access {
        port: "test".to_owned(),
        open,
        kinds: file.kinds,
        baud: None,
        hand: None,
        geometry: None,
        recordings: None,
    };
    (Station::new(0, "joint", access).unwrap(), shared)
}

fn set() -> Action {
    let [module, parameter, value] = ["PIDCTRL_MOD", "K_PARAM", "80"].map(str::to_owned);
    Action::Edit(Edit::Set { module, parameter, value })
}

#[test]
fn after_a_stop_start_moves_nothing_and_the_page_is_not_armed() {
    let (station, shared) = station();
    station.ask(1, Action::Arm).blocking_recv().unwrap().unwrap();
    station.stop().blocking_recv().unwrap().unwrap();
    let started = station.ask(1, Action::Check).blocking_recv().unwrap().unwrap();
    assert!(started.to_string().contains("no client holds the lease"), "{started}");
    {
        let mut controller = shared.0.lock().unwrap();
        assert_eq!(controller.info.heartbeat(0).lease.holder, NO_CLIENT);
        assert_eq!(controller.tick(), TickResult::Disarmed);
    }
    // The answer to this request follows the next status.
    station.ask(1, Action::Events).blocking_recv().unwrap().unwrap();
    let last = station.board().last();
    let status = last.iter().rfind(|text| text.contains("\"kind\":\"status\"")).unwrap();
    assert!(status.contains("\"holder\":null}"), "no page has armed it: {status}");
    // Arming is a separate request.
    station.ask(1, Action::Arm).blocking_recv().unwrap().unwrap();
}

#[test]
fn a_client_has_few_requests_waiting_and_none_when_it_is_gone() {
    let (station, shared) = station();
    station.ask(8, Action::Events).blocking_recv().unwrap().unwrap();
    let closed = shared.1.lock().unwrap();
    let mut answers: Vec<_> = (0..20_000).map(|_| station.ask(7, set())).collect();
    let refused =
        answers.iter_mut().map(oneshot::Receiver::try_recv).filter(|done| matches!(done, Ok(Err(_)))).count();
    assert!(refused >= 20_000 - MAX_WAITING - 1, "{refused} of 20000 are refused");
    // Another client is not refused because of it, regardless of the client ids.
    let mut other = station.ask(8, Action::Events);
    assert!(other.try_recv().is_err());
    for client in 100..1000 {
        drop(station.ask(client, Action::Events));
    }
    assert!(Arc::strong_count(&station.waiting) <= MAX_WAITING_OF_ALL + 1);
    station.hear(7, false);
    drop(closed);
    other.blocking_recv().unwrap().unwrap();
    assert!(shared.0.lock().unwrap().sets <= 1, "requests of a disconnected client are dropped");
}

#[test]
fn many_stops_at_once_are_all_answered_by_few() {
    let (station, shared) = station();
    station.ask(1, Action::Arm).blocking_recv().unwrap().unwrap();
    let closed = shared.1.lock().unwrap();
    let answers: Vec<_> = (0..10_000).map(|_| station.stop()).collect();
    drop(closed);
    let done = answers.into_iter().filter_map(|answer| answer.blocking_recv().unwrap().ok()).count();
    assert!(done >= MAX_STOPS, "{done}");
    assert_eq!(shared.0.lock().unwrap().info.heartbeat(0).lease.holder, NO_CLIENT);
}
