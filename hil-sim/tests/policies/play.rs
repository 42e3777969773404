//! Plays a scenario, and holds every tick of both sides to the policies.

use crate::faulty_pair::{CLIENT, Controller, Fault, Line, Pair, Parts, Wrong};
use dimsart_core::Command;
use dimsart_core::scheme::Row;
use dimsart_link::EventLog;
use dimsart_link::protocol::{LeaseAction, Request, Response};

use crate::moment::{Asked, Known, Moment};
use crate::parts::{plants, scheme};
use crate::policy::POLICIES;
use crate::scenario::{Event, LAST_FAULT_TICK, Scenario, What};
use crate::seen::Seen;

/// The forces of all faults are gone, and schemes are put right.
const REPAIR_TICK: u32 = LAST_FAULT_TICK + 30;
/// What was on its way meanwhile has come: a side begins.
const RECOVERY_TICK: u32 = REPAIR_TICK + 10;
/// The hand lets go.
pub(crate) const RELEASE_TICK: u32 = RECOVERY_TICK + 60;
/// From then on forces are looked at in spells: so many are enough.
const SETTLING_TICK: u32 = RELEASE_TICK + 200;
const SPELL_TICKS: u32 = 50;
const SPELLS: u32 = 100;
/// What is left of the forces then, N: nothing that matters.
const REST_N: f32 = 0.02;
/// A client other than the pair's.
const STRANGER: u8 = 2;

/// Result of a scenario without a violated policy.
#[derive(Debug, Default)]
pub(crate) struct Played {
    /// How many ticks each policy was about.
    pub(crate) about: Vec<u64>,
    /// Whether range and rate still hold its commands when nothing is wrong any more, or a device ran on until its sensor
    /// could not follow. Where one was a metre from the other while it was disarmed, or had gains that nobody gives, it
    /// can swing between its limits from then on, and no law of the library ends that.
    pub(crate) is_swinging: bool,
    /// Of every force of every tick.
    pub(crate) digest: u64,
}

/// The logs of the two sides: a controller's is never given back.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Logs([&'static EventLog; 2]);

impl Logs {
    pub(crate) fn new() -> Self {
        Self([(); 2].map(|()| &*Box::leak(Box::new(EventLog::new()))))
    }
}

struct Play<'a> {
    scenario: &'a Scenario,
    logs: Logs,
    pair: Pair,
    known: [Known; 2],
    before: [Seen; 2],
    asked: [Vec<Asked>; 2],
    /// Whether a device has run on until its sensor could not follow, with nothing wrong any more.
    has_run_away: bool,
    played: Played,
}

/// Plays it to its end; an error says which policy did not hold, and where.
pub(crate) fn play(scenario: &Scenario, logs: Logs) -> Result<Played, String> {
    let mut play = Play::new(scenario, logs);
    let shipped = [0, 1].map(|side| play.pair.of(side)[0].commands());
    while play.pair.ticks() < SETTLING_TICK {
        let tick = play.pair.ticks();
        match tick {
            REPAIR_TICK => play.repair(&shipped)?,
            RECOVERY_TICK => play.recover()?,
            _ => {}
        }
        for event in scenario.events.iter().filter(|event| event.tick == tick) {
            play.happen(event)?;
        }
        play.tick()?;
    }
    play.settle()?;
    Ok(play.played)
}

impl<'a> Play<'a> {
    fn new(scenario: &'a Scenario, logs: Logs) -> Self {
        let mut pair = Pair::new(Parts {
            dof: scenario.dof,
            sample_period_s: 1e-3,
            scheme: &scheme(scenario),
            plants: plants(scenario),
            delay_ticks: scenario.link_ticks,
            spare_cycles: scenario.spare_cycles,
            seed: 1,
        })
        .unwrap();
        let before = [0, 1].map(|side| {
            pair.of(side)[0].keep_events(logs.0[side]);
            Seen::of(&mut pair, side, logs.0[side], logs.0[side].last())
        });
        // Who makes the pair has taken both leases.
        let take = Asked { client: CLIENT, request: Request::Lease(LeaseAction::Take), is_taken: true };
        let known = [(); 2].map(|()| {
            let mut known = Known::default();
            known.note(&take, true);
            known
        });
        let played = Played { about: vec![0; POLICIES.len()], is_swinging: false, digest: 0 };
        Self { scenario, logs, pair, known, before, asked: [vec![], vec![]], has_run_away: false, played }
    }

    fn happen(&mut self, event: &Event) -> Result<(), String> {
        let side = event.side;
        match &event.what {
            What::Wrong { fault, axis, ticks } => {
                let ticks = (*ticks).min(LAST_FAULT_TICK - event.tick);
                self.pair.begin(side, *fault, axis % self.scenario.dof, ticks);
            }
            What::Lease(action) => self.ask(side, CLIENT, Request::Lease(*action))?,
            What::StrangerLease(action) => self.ask(side, STRANGER, Request::Lease(*action))?,
            What::Rows(rows) => {
                for row in rows {
                    self.give(side, CLIENT, row)?;
                }
            }
            What::RejectedPackets(row) => self.give(side, STRANGER, row)?,
        }
        Ok(())
    }

    fn give(&mut self, side: usize, client: u8, row: &str) -> Result<(), String> {
        let words: Vec<&str> = std::iter::once("all").chain(row.split_whitespace()).collect();
        let row = Row::from_words(&words);
        // What is not understood is never sent.
        match row.command(self.pair.of(side)[0].dimsart().engine()) {
            Ok(command) => self.ask(side, client, Request::Command(command)),
            Err(_) => Ok(()),
        }
    }

    /// Asks, and holds a refusal to its word: nothing has changed.
    fn ask(&mut self, side: usize, client: u8, request: Request) -> Result<(), String> {
        let tick = self.pair.ticks();
        let [controller, _] = self.pair.of(side);
        let looks = |controller: &mut Controller| {
            let engine = controller.dimsart().engine();
            let order: Vec<_> = engine.steps().collect();
            let flags = (engine.is_running(), engine.is_in_transaction(), engine.usage());
            let state = (controller.dimsart().safety().state(), controller.info().heartbeat(0).lease);
            (order, flags, state, controller.commands())
        };
        let is_running = controller.dimsart().engine().is_running();
        let before = looks(controller);
        let answer = controller.ask(client, &request);
        let is_taken = match answer {
            Response::Refused(_) => false,
            Response::Effect(effect) => effect.refused.is_none(),
            _ => true,
        };
        if !is_taken && looks(controller) != before {
            return Err(format!(
                "tick {tick}, side {side}: {request:?} was refused and has changed something"
            ));
        }
        let asked = Asked { client, request, is_taken };
        self.known[side].note(&asked, is_running);
        self.asked[side].push(asked);
        Ok(())
    }

    /// Puts the scheme right where an operator has left another one.
    fn repair(&mut self, shipped: &[Vec<Command>; 2]) -> Result<(), String> {
        for (side, shipped) in shipped.iter().enumerate() {
            // Whoever else holds the lease gives it back.
            self.ask(side, STRANGER, Request::Lease(LeaseAction::Release))?;
            self.ask(side, CLIENT, Request::Command(Command::Abort))?;
            if self.pair.of(side)[0].commands() != *shipped {
                self.ask(side, CLIENT, Request::Command(Command::Close))?;
                for command in shipped {
                    self.ask(side, CLIENT, Request::Command(*command))?;
                }
            }
            self.ask(side, CLIENT, Request::Command(Command::Check))?;
        }
        Ok(())
    }

    /// Does what a person does when nothing is wrong any more.
    fn recover(&mut self) -> Result<(), String> {
        for side in 0..2 {
            for request in [Request::Command(Command::Reset), Request::Lease(LeaseAction::Take)] {
                self.ask(side, CLIENT, request)?;
                let asked = self.asked[side].last();
                if !asked.is_some_and(|asked| asked.is_taken) {
                    return Err(format!("side {side} cannot go on: {asked:?}"));
                }
            }
        }
        Ok(())
    }

    /// Goes on until no force is left, as without a fault; or until it is clear that range and rate hold them.
    fn settle(&mut self) -> Result<(), String> {
        let mut left_n = 0.0_f32;
        for _ in 0..SPELLS {
            (left_n, self.played.is_swinging) = (0.0, self.has_run_away);
            for _ in 0..SPELL_TICKS {
                self.tick()?;
                for seen in &self.before {
                    left_n = seen.given_n.iter().fold(left_n, |max_n, now_n| max_n.max(now_n.abs()));
                    self.played.is_swinging |= seen.reason.is_limit();
                }
            }
            if left_n < REST_N {
                return Ok(());
            }
        }
        let is_swinging = self.played.is_swinging;
        if is_swinging { Ok(()) } else { Err(format!("{left_n} N are left when nothing moves any more")) }
    }

    /// A tick of both sides, and every policy on it.
    fn tick(&mut self) -> Result<(), String> {
        let tick = self.pair.ticks();
        let wrong = self.pair.wrong().map(<[_]>::to_vec);
        self.pair.step();
        let (mut armed, mut bad_frames) = ([false; 2], [false; 2]);
        let now = [0, 1].map(|side| {
            let before = &self.before[side];
            let now = Seen::of(&mut self.pair, side, self.logs.0[side], before.last_event);
            let known = &mut self.known[side];
            armed[side] = known.count_lease(self.pair.of(side)[0].has_renewed());
            bad_frames[side] = known.sensors.refuse(self.pair.measured()[side], now.given_n.len());
            if bad_frames[side] && !now.state.is_fault() {
                // Nothing moves it: it may be moved by hand meanwhile.
                known.sensors.begin_anew();
            }
            known.hear(self.pair.heard()[side], &now);
            known.count_energy(&now);
            let repeats = |wrong: &Wrong| wrong.fault == Fault::Line(Line::Repeats);
            known.is_replayed |= known.heard.is_none() && wrong[side].iter().any(repeats);
            if now.state.is_fault() {
                known.lease = None;
            }
            for now_n in &now.given_n {
                self.played.digest = self.played.digest.rotate_left(5) ^ u64::from(now_n.to_bits());
            }
            now
        });
        for side in 0..2 {
            let moment = Moment {
                before: &self.before[side],
                asked: &self.asked[side],
                now: &now[side],
                wrong: &wrong[side],
                is_armed: armed[side],
                is_frame_bad: bad_frames[side],
                known: &self.known[side],
                other: &self.known[1 - side],
                spare_cycles: self.scenario.spare_cycles,
            };
            for (policy, about) in POLICIES.iter().zip(&mut self.played.about) {
                match (policy.holds)(&moment) {
                    Some(false) => {
                        return Err(format!(
                            "tick {tick}, side {side}: not so: {}\n{moment:#?}",
                            policy.says
                        ));
                    }
                    Some(true) => *about += 1,
                    None => {}
                }
            }
        }
        self.has_run_away |= tick >= RECOVERY_TICK && bad_frames.contains(&true);
        if tick >= RECOVERY_TICK && !self.has_run_away && now.iter().any(Seen::is_held_back) {
            let came = now.map(|seen| seen.came);
            return Err(format!("tick {tick}: nothing is wrong any more, and the sides came to {came:?}"));
        }
        self.before = now;
        self.asked.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}
