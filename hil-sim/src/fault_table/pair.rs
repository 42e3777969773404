//! Both sides of the shipped scheme, with a fault in one of them.

use dimsart_core::Word;

use super::FaultTableError;
use super::controller::{Controller, LIMITS};
use super::fault::{Fault, Line, Shows};
use crate::bus::Random;
use crate::experiment::{Experiment, Side};
use crate::link::{InProcess, InProcessParameters, Link};
use crate::plant::{AxisWise, Plant};
use crate::scenario::Scenario;

/// Most bits of a packet that are damaged: so few are found for sure.
const WRONG_BITS: u32 = 4;

/// A fault that lasts.
#[derive(Debug, Clone, Copy)]
struct Wrong {
    fault: Fault,
    axis: usize,
    /// Ticks that it has lasted.
    ticks: u32,
}

/// A controller, its plant and the line to it.
#[derive(Debug)]
struct End {
    controller: Controller,
    plant: Box<dyn Plant>,
    line: InProcess,
    wrong: Option<Wrong>,
    position_m: Vec<f32>,
    force_n: Vec<f32>,
    /// What its sensors showed and its actuators got in the last tick without a fault, and what came over the line last.
    shown_m: Vec<f32>,
    given_n: Vec<f32>,
    packet: Vec<u8>,
}

impl End {
    fn receive(&mut self, tick: u64, random: &mut Random) {
        let Self { controller, line, packet, wrong, .. } = self;
        let fault = wrong.and_then(|wrong| match wrong.fault {
            Fault::Line(line) => Some((line, wrong.ticks)),
            _ => None,
        });
        line.receive(tick, &mut |bytes| match fault {
            Some((Line::Silent(silent_ticks), ticks)) if ticks < silent_ticks => {}
            Some((Line::Damaged { every }, ticks)) if ticks.is_multiple_of(every) => {
                controller.receive(&damaged(bytes, random));
            }
            Some((Line::Repeats, _)) => controller.receive(packet),
            _ => {
                bytes.clone_into(packet);
                controller.receive(bytes);
            }
        });
    }

    /// What the controller is given of the sensors.
    fn measure(&mut self) -> Vec<Word> {
        self.plant.sense(&mut self.position_m);
        let mut shown_m = self.position_m.clone();
        if let Some(Wrong { fault: Fault::Sensor(shows), axis, ticks }) = self.wrong
            && let Some((shown_m, then_m)) = shown_m.get_mut(axis).zip(self.shown_m.get(axis))
        {
            #[expect(clippy::cast_precision_loss, reason = "a few thousand at most")]
            let ticks = (ticks + 1) as f32;
            *shown_m = match shows {
                Shows::This(shown_m) => shown_m,
                Shows::More(by_m) => *shown_m + by_m,
                Shows::Stuck => *then_m,
                Shows::Drift(by_m) => *shown_m + by_m * ticks,
            };
        }
        let mut measured: Vec<Word> = shown_m.iter().map(|shown_m| Word::from(*shown_m)).collect();
        match self.wrong.map(|wrong| wrong.fault) {
            None => self.shown_m = shown_m,
            Some(Fault::ShortFrame) => _ = measured.pop(),
            Some(Fault::LongFrame) => measured.push(Word(0)),
            Some(_) => {}
        }
        measured
    }

    /// A tick; gives the largest force and the largest step of one. No force leaves the range or is faster than the rate.
    fn tick(&mut self, period_s: f64) -> Result<(f32, f32), FaultTableError> {
        let measured = self.measure();
        let force_n = self.controller.tick(&measured);
        #[expect(clippy::cast_possible_truncation, reason = "controllers count in f32")]
        let most_n = LIMITS.rate_per_s * period_s as f32;
        let (mut largest_n, mut largest_step_n) = (0.0_f32, 0.0_f32);
        for (now_n, last_n) in force_n.iter().zip(&self.force_n) {
            let step_n = (now_n - last_n).abs();
            // What f32 rounds: the sum of the last value and the step.
            let rounding_n = f32::EPSILON * (now_n.abs() + last_n.abs());
            if !(LIMITS.min..=LIMITS.max).contains(now_n) || step_n > most_n + rounding_n {
                return Err(FaultTableError::LimitBroken { last_n: *last_n, now_n: *now_n });
            }
            (largest_n, largest_step_n) = (largest_n.max(now_n.abs()), largest_step_n.max(step_n));
        }
        self.force_n = force_n;
        if self.wrong.is_none() {
            self.given_n.clone_from(&self.force_n);
        }
        Ok((largest_n, largest_step_n))
    }

    fn advance(&mut self, start_s: f64, period_s: f64) {
        let mut force_n = self.force_n.clone();
        if let Some(wrong) = &mut self.wrong {
            wrong.ticks += 1;
            if wrong.fault == Fault::ActuatorStuck
                && let Some((force_n, given_n)) =
                    force_n.get_mut(wrong.axis).zip(self.given_n.get(wrong.axis))
            {
                *force_n = *given_n;
            }
        }
        self.plant.advance(start_s, period_s, &force_n);
    }
}

/// Master and slave, stepped as a [`Rig`](crate::rig::Rig) steps its stations.
#[derive(Debug)]
pub(super) struct Pair {
    ends: [End; 2],
    period_s: f64,
    tick: u32,
    pub(super) end_tick: u32,
    pub(super) largest_n: f32,
    pub(super) largest_step_n: f32,
}

impl Pair {
    /// Both sides as they are shipped, before their first tick.
    pub(super) fn new(spare_cycles: u32) -> Result<Self, FaultTableError> {
        let scenario = Scenario::default();
        let mut experiment = Experiment::new(&scenario)?;
        let end_s = experiment.phases().end_s;
        let rig = experiment.rig_mut();
        let mut plants = rig.stations_mut().iter_mut().map(|station| {
            let none: Box<dyn Plant> = Box::new(AxisWise::new(Vec::new()));
            std::mem::replace(&mut station.plant, none)
        });
        let mut end = |side, delay_ticks| {
            let parameters = InProcessParameters { delay_ticks, ..InProcessParameters::default() };
            let zeros = vec![0.0; scenario.dof];
            Ok::<_, FaultTableError>(End {
                controller: Controller::new(&scenario, side, spare_cycles)?,
                plant: plants.next().unwrap_or_else(|| Box::new(AxisWise::new(Vec::new()))),
                line: InProcess::new(parameters, 0),
                wrong: None,
                position_m: zeros.clone(),
                force_n: zeros.clone(),
                shown_m: zeros.clone(),
                given_n: zeros,
                packet: Vec::new(),
            })
        };
        let master = end(Side::Master, scenario.link.backward_delay_ticks)?;
        let slave = end(Side::Slave, scenario.link.forward_delay_ticks)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand ticks")]
        let end_tick = (end_s / scenario.sample_period_s) as u32;
        let period_s = scenario.sample_period_s;
        Ok(Self { ends: [master, slave], period_s, tick: 0, end_tick, largest_n: 0.0, largest_step_n: 0.0 })
    }

    /// Ticks so far.
    pub(super) fn ticks(&self) -> u32 {
        self.tick
    }

    /// Forces of the last tick, N, of the master and of the slave.
    pub(super) fn force_n(&self) -> [&[f32]; 2] {
        self.ends.each_ref().map(|end| end.force_n.as_slice())
    }

    /// The controllers of a side, 0 for the master and 1 for the slave, and of the other one.
    pub(super) fn of(&mut self, side: usize) -> [&mut Controller; 2] {
        let [master, slave] = self.ends.each_mut().map(|end| &mut end.controller);
        if side == 0 { [master, slave] } else { [slave, master] }
    }

    /// Begins a fault at a side, or ends the one there is; what was measured of the forces is forgotten.
    pub(super) fn begin(&mut self, side: usize, fault: Fault, axis: usize) -> Result<(), FaultTableError> {
        (self.largest_n, self.largest_step_n) = (0.0, 0.0);
        let Some(end) = self.ends.get_mut(side) else { return Ok(()) };
        let lasting = end.wrong.replace(Wrong { fault, axis, ticks: 0 });
        let (fault, is_end) = match (lasting, fault) {
            (Some(lasting), Fault::None) => {
                end.wrong = None;
                (lasting.fault, true)
            }
            _ => (fault, false),
        };
        match fault {
            Fault::Writes(number, what) => {
                end.controller.let_write(number, if is_end { "SOUND" } else { what }, axis)?;
            }
            Fault::TakesLonger(module, percent) => {
                end.controller.take_times(module, if is_end { 0 } else { percent });
            }
            Fault::LeaseNotRenewed => end.controller.renews = is_end,
            _ => {}
        }
        Ok(())
    }

    /// A tick of both sides, and what moves in it.
    pub(super) fn step(&mut self, random: &mut Random) -> Result<(), FaultTableError> {
        let tick = u64::from(self.tick);
        for is_master in [true, false] {
            let [master, slave] = &mut self.ends;
            let (own, other) = if is_master { (master, slave) } else { (slave, master) };
            own.receive(tick, random);
            let (largest_n, largest_step_n) = own.tick(self.period_s)?;
            self.largest_n = self.largest_n.max(largest_n);
            self.largest_step_n = self.largest_step_n.max(largest_step_n);
            if let Some(packet) = own.controller.outgoing() {
                other.line.send(tick, &packet.to_bytes());
            }
        }
        let start_s = f64::from(self.tick) * self.period_s;
        self.ends.iter_mut().for_each(|end| end.advance(start_s, self.period_s));
        self.tick += 1;
        Ok(())
    }
}

/// The bytes with 1 to [`WRONG_BITS`] wrong bits.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    let most = u32::try_from(8 * bytes.len()).unwrap_or(u32::MAX).saturating_sub(1);
    for _ in 0..=random.up_to(WRONG_BITS - 1) {
        let bit = usize::try_from(random.up_to(most)).unwrap_or_default();
        if let Some(byte) = damaged.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
    damaged
}
