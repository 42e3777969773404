//! Both sides of a scheme as boards run them, with faults in them: calls are timed, and a client holds each side's lease.
//!
//! Three modules that can fail pass the scheme's signals on, in three places of it. They change no bit while they do not
//! fail.

mod controller;
mod failing;
mod fault;

use dimsart_core::protocol::Refusal;
use dimsart_core::{DescriptorError, Packet, Word};

pub use controller::{CLIENT, Controller, LIMITS};
pub use failing::{Failing, Kinds};
pub use fault::{Fault, Line, Shows, Writes, Wrong};

use crate::bus::Random;
use crate::experiment::{Experiment, ExperimentError, Side, device};
use crate::link::{InProcess, InProcessParameters, Link};
use crate::plant::{AxisWise, Plant};
use crate::scenario::Scenario;
use crate::schemes::{SchemeFileError, SchemeText};

/// Most bits of a packet that are damaged: so few are found for sure.
const WRONG_BITS: u32 = 4;

/// Why there is no pair, or it does not move.
#[derive(Debug, thiserror::Error)]
pub enum PairError {
    /// The experiment cannot be made.
    #[error("{0}")]
    Experiment(#[from] ExperimentError),
    /// The device cannot be described.
    #[error("{0}")]
    Device(#[from] DescriptorError),
    /// The scheme cannot be read.
    #[error("{0}")]
    SchemeFile(#[from] SchemeFileError),
    /// A row of the scheme was refused.
    #[error("a row is refused: {0}")]
    Scheme(String),
    /// The client was refused something.
    #[error("refused: {0:?}")]
    Refused(Refusal),
}

/// What a pair is made of; of two, the master's is first.
#[derive(Debug)]
pub struct Parts<'a> {
    /// Axes of each device.
    pub dof: usize,
    /// Of both controllers.
    pub sample_period_s: f64,
    /// The shipped scheme, with other values perhaps.
    pub scheme: &'a str,
    /// What the controllers move.
    pub plants: [Box<dyn Plant>; 2],
    /// Of the lines to them.
    pub delay_ticks: [u32; 2],
    /// What interrupts may take in the midst of a call.
    pub spare_cycles: u32,
    /// Of what a damaged line does.
    pub seed: u64,
}

/// A controller, its plant and the line to it.
#[derive(Debug)]
struct End {
    controller: Controller,
    plant: Box<dyn Plant>,
    line: InProcess,
    wrong: Vec<Wrong>,
    position_m: Vec<f32>,
    force_n: Vec<f32>,
    /// What its sensors showed and its actuators got in the last tick in which none was stuck, and what came over the
    /// line last.
    shown_m: Vec<f32>,
    given_n: Vec<f32>,
    packet: Vec<u8>,
    measured: Vec<Word>,
    /// Counter of what came over the line in the last tick and was no damaged packet and none that came before.
    heard: Option<u16>,
    has_sent: bool,
}

impl End {
    fn receive(&mut self, tick: u64, random: &mut Random) {
        let Self { controller, line, packet, wrong, heard, .. } = self;
        *heard = None;
        let line_fault = wrong.iter().find_map(|wrong| match wrong.fault {
            Fault::Line(Line::Silent(silent_ticks)) if wrong.ticks >= silent_ticks => None,
            Fault::Line(Line::Damaged { every }) if !wrong.ticks.is_multiple_of(every) => None,
            Fault::Line(line) => Some(line),
            _ => None,
        });
        line.receive(tick, &mut |bytes| match line_fault {
            Some(Line::Silent(_)) => {}
            Some(Line::Damaged { .. }) => controller.receive(&damaged(bytes, random)),
            Some(Line::Repeats) => controller.receive(packet),
            Some(Line::Doubles) | None => {
                let channel = controller.dimsart().listening_channel(0);
                *heard = Packet::from_bytes(bytes, channel).ok().map(|packet| packet.counter);
                bytes.clone_into(packet);
                controller.receive(bytes);
                if line_fault.is_some() {
                    controller.receive(bytes);
                }
            }
        });
    }

    /// What the controller is given of the sensors.
    fn measure(&mut self) -> Vec<Word> {
        self.plant.sense(&mut self.position_m);
        let mut shown_m = self.position_m.clone();
        let (mut is_stuck, mut words) = (false, shown_m.len());
        for Wrong { fault, axis, ticks } in &self.wrong {
            match fault {
                Fault::Sensor(shows) => {
                    if let Some((shown_m, then_m)) = shown_m.get_mut(*axis).zip(self.shown_m.get(*axis)) {
                        #[expect(clippy::cast_precision_loss, reason = "a few thousand at most")]
                        let ticks = (ticks + 1) as f32;
                        *shown_m = match shows {
                            Shows::This(shown_m) => *shown_m,
                            Shows::More(by_m) => *shown_m + by_m,
                            Shows::Stuck => *then_m,
                            Shows::Drift(by_m) => *shown_m + by_m * ticks,
                        };
                        is_stuck |= *shows == Shows::Stuck;
                    }
                }
                Fault::ShortFrame => words = words.saturating_sub(1),
                Fault::LongFrame => words += 1,
                _ => {}
            }
        }
        let mut measured: Vec<Word> = shown_m.iter().map(|shown_m| Word::from(*shown_m)).collect();
        measured.resize(words, Word(0));
        if !is_stuck {
            self.shown_m = shown_m;
        }
        measured
    }

    fn tick(&mut self) {
        self.measured = self.measure();
        self.force_n = self.controller.tick(&self.measured, &self.wrong);
        if self.stuck_axes().next().is_none() {
            self.given_n.clone_from(&self.force_n);
        }
    }

    /// Axes whose actuator is stuck.
    fn stuck_axes(&self) -> impl Iterator<Item = usize> + '_ {
        let stuck = self.wrong.iter().filter(|wrong| wrong.fault == Fault::ActuatorStuck);
        stuck.map(|wrong| wrong.axis)
    }

    fn advance(&mut self, start_s: f64, period_s: f64) {
        let mut force_n = self.force_n.clone();
        for axis in self.stuck_axes() {
            if let Some((force_n, given_n)) = force_n.get_mut(axis).zip(self.given_n.get(axis)) {
                *force_n = *given_n;
            }
        }
        self.wrong.iter_mut().for_each(|wrong| wrong.ticks += 1);
        self.plant.advance(start_s, period_s, &force_n);
    }
}

/// Master and slave, stepped as a [`Rig`](crate::rig::Rig) steps its stations. Sides are 0 for the master and 1 for the
/// slave.
#[derive(Debug)]
pub struct Pair {
    ends: [End; 2],
    period_s: f64,
    tick: u32,
    /// What a damaged line does.
    pub(crate) random: Random,
}

impl Pair {
    /// Both sides before their first tick, armed.
    ///
    /// # Errors
    /// [`PairError`], where the parts do not fit.
    pub fn new(parts: Parts<'_>) -> Result<Self, PairError> {
        let Parts { dof, sample_period_s, scheme, plants, delay_ticks, spare_cycles, seed } = parts;
        let end = |side: Side, plant, delay_ticks| {
            let parameters = InProcessParameters { delay_ticks, ..InProcessParameters::default() };
            let device = device(side.name(), dof, sample_period_s)?;
            let zeros = vec![0.0; dof];
            Ok::<_, PairError>(End {
                controller: Controller::new(device, scheme, side, spare_cycles)?,
                plant,
                line: InProcess::new(parameters, 0),
                wrong: Vec::new(),
                position_m: zeros.clone(),
                force_n: zeros.clone(),
                shown_m: zeros.clone(),
                given_n: zeros,
                packet: Vec::new(),
                measured: Vec::new(),
                heard: None,
                has_sent: false,
            })
        };
        let ([master, slave], [to_master, to_slave]) = (plants, delay_ticks);
        let ends = [end(Side::Master, master, to_master)?, end(Side::Slave, slave, to_slave)?];
        Ok(Self { ends, period_s: sample_period_s, tick: 0, random: Random::new(seed) })
    }

    /// Both sides as they are shipped, and the ticks of their experiment.
    ///
    /// # Errors
    /// [`PairError`], where the shipped experiment cannot be made.
    pub fn shipped(spare_cycles: u32, seed: u64) -> Result<(Self, u32), PairError> {
        let scenario = Scenario::default();
        let mut experiment = Experiment::new(&scenario)?;
        let end_s = experiment.phases().end_s;
        let mut plants = experiment.rig_mut().stations_mut().iter_mut().map(|station| {
            let none: Box<dyn Plant> = Box::new(AxisWise::new(Vec::new()));
            std::mem::replace(&mut station.plant, none)
        });
        let plants = [(); 2].map(|()| plants.next().unwrap_or_else(|| Box::new(AxisWise::new(Vec::new()))));
        let pair = Self::new(Parts {
            dof: scenario.dof,
            sample_period_s: scenario.sample_period_s,
            scheme: &SchemeText::read(&scenario.master.scheme)?.text,
            plants,
            delay_ticks: [scenario.link.backward_delay_ticks, scenario.link.forward_delay_ticks],
            spare_cycles,
            seed,
        })?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand ticks")]
        let end_tick = (end_s / scenario.sample_period_s) as u32;
        Ok((pair, end_tick))
    }

    /// Ticks so far.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.tick
    }

    /// Forces of the last tick, N, of the master and of the slave.
    #[must_use]
    pub fn force_n(&self) -> [&[f32]; 2] {
        self.ends.each_ref().map(|end| end.force_n.as_slice())
    }

    /// The controllers of a side, and of the other one.
    pub fn of(&mut self, side: usize) -> [&mut Controller; 2] {
        let [master, slave] = self.ends.each_mut().map(|end| &mut end.controller);
        if side == 0 { [master, slave] } else { [slave, master] }
    }

    /// What is wrong at each side.
    #[must_use]
    pub fn wrong(&self) -> [&[Wrong]; 2] {
        self.ends.each_ref().map(|end| end.wrong.as_slice())
    }

    /// What each side's controller was given of its sensors in the last tick.
    #[must_use]
    pub fn measured(&self) -> [&[Word]; 2] {
        self.ends.each_ref().map(|end| end.measured.as_slice())
    }

    /// Counter of the packet that came over the line to each side in the last tick, if one did that was neither damaged
    /// nor there before.
    #[must_use]
    pub fn heard(&self) -> [Option<u16>; 2] {
        self.ends.each_ref().map(|end| end.heard)
    }

    /// Whether each side sent a packet in the last tick.
    #[must_use]
    pub fn has_sent(&self) -> [bool; 2] {
        self.ends.each_ref().map(|end| end.has_sent)
    }

    /// Begins a fault at a side, beside those that last.
    pub fn begin(&mut self, side: usize, fault: Fault, axis: usize) {
        self.change(side, |wrong| wrong.push(Wrong { fault, axis, ticks: 0 }));
    }

    /// Ends those of the faults at a side that are over.
    pub fn end(&mut self, side: usize, is_over: impl Fn(&Wrong) -> bool) {
        self.change(side, |wrong| wrong.retain(|wrong| !is_over(wrong)));
    }

    fn change(&mut self, side: usize, change: impl FnOnce(&mut Vec<Wrong>)) {
        if let Some(end) = self.ends.get_mut(side) {
            change(&mut end.wrong);
            end.controller.suffer(&end.wrong);
        }
    }

    /// A tick of both sides, and what moves in it.
    pub fn step(&mut self) {
        let tick = u64::from(self.tick);
        for is_master in [true, false] {
            let [master, slave] = &mut self.ends;
            let (own, other) = if is_master { (master, slave) } else { (slave, master) };
            own.receive(tick, &mut self.random);
            own.tick();
            let packet = own.controller.outgoing();
            own.has_sent = packet.is_some();
            if let Some(packet) = packet {
                other.line.send(tick, &packet.to_bytes());
            }
        }
        let start_s = f64::from(self.tick) * self.period_s;
        self.ends.iter_mut().for_each(|end| end.advance(start_s, self.period_s));
        self.tick += 1;
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
