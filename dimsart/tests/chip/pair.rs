//! Two nucleo-g474re on one bus: a hand holds the master's shaft, the slave's shaft turns a spring.
//!
//! ```text
//! hand ──▶ encoder ──▶ master ◀── CAN ──▶ slave ──▶ duty cycle ──▶ motor, inertia, spring ──▶ encoder
//! ```

use std::collections::VecDeque;
use std::f64::consts::TAU;
use std::sync::Arc;

use chips::{Bench, Board, BusFrame, CanBus, FrameResult};
use cycles::image::Image;
use dimsart::stamp::StampedImage;
use dimsart_core::DataType;
use dimsart_core::limits::MAX_DOF;
use dimsart_link::protocol::{
    Heartbeat, LeaseAction, MAX_FRAME_BYTES, NotCommandedReason, Receiver, Request, Response,
    decode_heartbeat, decode_response, encode_request, request_id,
};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use hil_sim::plant::{Joint, JointParameters};
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::device;
use hil_sim::schemes::{self, SchemeText, Setting};

pub(crate) const MASTER: usize = 0;
pub(crate) const SLAVE: usize = 1;
const TICK_S: f64 = 1e-3;
const BOARD: &str = "nucleo-g474re";
/// From `boards/src/catalogue/nucleo_g474re.rs`.
const TORQUE_CONSTANT_NM_PER_A: f64 = 0.05;
const RESISTANCE_OHM: f64 = 1.0;
const SUPPLY_V: f64 = 12.0;
pub(crate) const COUNTS_PER_TURN: f64 = 4096.0;
/// Torque at standstill with a duty cycle of 1.
pub(crate) const FULL_NM: f64 = SUPPLY_V / RESISTANCE_OHM * TORQUE_CONSTANT_NM_PER_A;
/// Timer of the first axis' encoder.
const ENCODER: u32 = 2;
const INERTIA_KG_M2: f64 = 1e-4;
pub(crate) const SPRING_NM_PER_RAD: f64 = 0.2;
const CLIENT: u8 = 77;
const RENEWAL_TICKS: u64 = 50;

/// Both boards and their surroundings.
pub(crate) struct Pair {
    pub(crate) bus: CanBus,
    receivers: [Receiver; 2],
    /// Contents of frames by the id of their request.
    answers: [VecDeque<(u16, Vec<u8>)>; 2],
    heartbeats: [Option<Heartbeat>; 2],
    requests: u8,
    ticks: u64,
    lease: Option<LeaseAction>,
    /// Present counts of each encoder.
    counts: [i64; 2],
    /// Position at which the hand holds the master, `rad`.
    pub(crate) hand_rad: f64,
    pub(crate) joint: Joint,
    pub(crate) passed: Vec<BusFrame>,
}

/// Returns an image that is stamped with a side of the scheme for small motors.
pub(crate) fn stamped(
    board: &str,
    side: &str,
    settings: &[(&'static str, &'static str)],
) -> Option<Arc<Image>> {
    let text = SchemeText::read("builtin:small_motors").unwrap();
    let mut dimsart = SimulatedDimsart::new(
        device(if side == "master" { "master" } else { "slave" }, MAX_DOF, TICK_S).unwrap(),
        ALL,
    )
    .unwrap();
    let settings = settings.iter().map(|(command, value)| Setting {
        module: "COMM_RXMOD".to_owned(),
        command: (*command).to_owned(),
        value: (*value).to_owned(),
        key: (*command).to_owned(),
    });
    let settings: Vec<Setting> = settings.collect();
    assert!(schemes::load(&text, side, &settings, &mut dimsart).is_valid());
    let scheme = saved_scheme::save(dimsart.engine_mut()).unwrap();
    let mut image = StampedImage::read(&test_requirements::image(board)?).unwrap();
    image.set_scheme("small_motors", side, &scheme).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("image");
    image.write(&file).unwrap();
    Some(Arc::new(Image::read(&std::fs::read(file).unwrap()).unwrap()))
}

impl Pair {
    /// Both boards, started and enabled; `None` without images. The settings are for the receiving module.
    pub(crate) fn start(settings: &[(&'static str, &'static str)]) -> Option<Self> {
        let mut pair = Self::power_up(settings, 1.0)?;
        pair.run(100);
        pair.arm();
        pair.run(100);
        Some(pair)
    }

    /// Both boards, powered on; the slave's crystal is too fast by this share.
    pub(crate) fn power_up(settings: &[(&'static str, &'static str)], slave_clock: f64) -> Option<Self> {
        let board = Board::find(BOARD).unwrap();
        let mut benches = Vec::new();
        let sides = [("master", *b"MASTER-G474\0", 1.0), ("slave", *b"SLAVE-G474\0\0", slave_clock)];
        for (side, serial, clock) in sides {
            let mut bench = Bench::new(board, stamped(BOARD, side, settings)?).unwrap();
            bench.chip().set_serial_number(serial);
            bench.chip().set_crystal(Some(clock * board.crystal_hz));
            benches.push(bench);
        }
        let mut joint = JointParameters::of_inertia(INERTIA_KG_M2);
        // A voltage-driven motor brakes by its back-EMF.
        joint.load.damping = TORQUE_CONSTANT_NM_PER_A.powi(2) / RESISTANCE_OHM;
        joint.load.stiffness = SPRING_NM_PER_RAD;
        Some(Self {
            bus: CanBus::new(benches),
            receivers: [Receiver::new(), Receiver::new()],
            answers: [VecDeque::new(), VecDeque::new()],
            heartbeats: [None, None],
            requests: 0,
            ticks: 0,
            lease: None,
            counts: [0; 2],
            hand_rad: 0.0,
            joint: joint.build().unwrap(),
            passed: Vec::new(),
        })
    }

    /// Enables motion of both.
    pub(crate) fn arm(&mut self) {
        for board in [MASTER, SLAVE] {
            self.send(board, &Request::Lease(LeaseAction::Take));
        }
        self.lease = Some(LeaseAction::Renew);
    }

    pub(crate) fn bench(&mut self, board: usize) -> &mut Bench {
        self.bus.bench(board).unwrap()
    }

    pub(crate) fn send(&mut self, board: usize, request: &Request) -> u16 {
        self.requests = self.requests.wrapping_add(1);
        let id = request_id(CLIENT, self.requests);
        let mut frame = [0; MAX_FRAME_BYTES];
        self.bench(board).send(encode_request(request, id, &mut frame).unwrap());
        id
    }

    /// Sends a request and runs until the answer arrives.
    pub(crate) fn ask<T>(
        &mut self,
        board: usize,
        request: &Request,
        take: impl FnOnce(&Response<'_>) -> T,
    ) -> T {
        let id = self.send(board, request);
        for _ in 0..100 {
            self.run(1);
            let found = self.answers[board].iter().position(|(answered, _)| *answered == id);
            if let Some(place) = found {
                let content = self.answers[board].remove(place).unwrap().1;
                return take(&decode_response(&content).unwrap().1);
            }
        }
        panic!("board {board} does not answer {request:?}");
    }

    /// Returns the first word of a signal.
    pub(crate) fn word(&mut self, board: usize, signal: &'static DataType) -> u32 {
        let request = Request::Signal { signal: signal.first(), from: 0 };
        self.ask(board, &request, |answer| match answer {
            Response::Signal(text) => text.words[0],
            other => panic!("{other:?}"),
        })
    }

    /// Returns why a board's scheme does not command its device, by its last heartbeat.
    pub(crate) fn blocked(&self, board: usize) -> Option<NotCommandedReason> {
        self.heartbeats[board].as_ref().unwrap().blocked
    }

    /// Returns the codes of a board's events, oldest first.
    pub(crate) fn events(&mut self, board: usize) -> Vec<u8> {
        let mut events = Vec::new();
        for back in 0..64 {
            let found = self.ask(board, &Request::Event { back }, |answer| match answer {
                Response::Event(event) => Some(event.what),
                _ => None,
            });
            let Some(what) = found else { break };
            events.insert(0, what);
        }
        events
    }

    /// Returns the torque of the slave's bridge at standstill, `N m`; `None` while it is off.
    pub(crate) fn torque_nm(&mut self, board: usize) -> Option<f64> {
        let chip = self.bench(board).chip();
        let is_enabled = chip.output('C', 3) == Some(true);
        let is_forward = chip.output('C', 0)?;
        let duty = chip.pulses().filter(|_| is_enabled)?.duties[0]?;
        Some(FULL_NM * if is_forward { duty } else { -duty })
    }

    pub(crate) fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    fn tick(&mut self) {
        if let Some(lease) = self.lease
            && self.ticks.is_multiple_of(RENEWAL_TICKS)
        {
            self.send(MASTER, &Request::Lease(lease));
            self.send(SLAVE, &Request::Lease(lease));
        }
        self.bus.run_for(TICK_S).unwrap();
        self.passed.extend(self.bus.take_frames());
        let torque_nm = self.torque_nm(SLAVE).unwrap_or(0.0);
        self.joint.advance(self.ticks as f64 * TICK_S, TICK_S, torque_nm, &|_| 0.0);
        self.ticks += 1;
        for (board, angle_rad) in [(MASTER, self.hand_rad), (SLAVE, self.joint.state().position)] {
            #[expect(clippy::cast_possible_truncation, reason = "a few turns")]
            let count = (angle_rad / TAU * COUNTS_PER_TURN).floor() as i64;
            let turned = count - self.counts[board];
            self.counts[board] = count;
            self.bench(board).chip().turn_encoder(ENCODER, turned);
            let bytes = self.bench(board).take_received();
            let (answers, heartbeats) = (&mut self.answers[board], &mut self.heartbeats[board]);
            self.receivers[board].push_all(&bytes, |content| {
                if let Ok((_, heartbeat)) = decode_heartbeat(content) {
                    *heartbeats = Some(heartbeat);
                } else if let Ok((id, _)) = decode_response(content) {
                    answers.push_back((id, content.to_vec()));
                    while answers.len() > 32 {
                        answers.pop_front();
                    }
                }
            });
        }
    }

    /// Moves the hand at constant speed.
    pub(crate) fn turn_hand(&mut self, to_rad: f64, ticks: u32) {
        let step_rad = (to_rad - self.hand_rad) / f64::from(ticks);
        for _ in 0..ticks {
            self.hand_rad += step_rad;
            self.run(1);
        }
        self.hand_rad = to_rad;
    }

    /// Returns a board's frames since the last call: received and lost.
    pub(crate) fn take_frames(&mut self, board: usize) -> (usize, usize) {
        let mine = self.passed.iter().filter(|frame| frame.sender == board);
        let counts = mine.fold((0, 0), |(passed, others), frame| match frame.result {
            FrameResult::Acknowledged => (passed + 1, others),
            _ => (passed, others + 1),
        });
        self.passed.retain(|frame| frame.sender != board);
        counts
    }
}
