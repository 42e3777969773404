//! Both sides of a scheme as boards run them, with faults in them: calls are timed, and a client holds each side's lease.
//!
//! Three modules that can fail pass the scheme's signals on, in three places of it. They change no bit while they do not
//! fail.

mod controller;
mod end;
mod failing;
mod fault;

use dimsart_core::{DescriptorError, Word};
use dimsart_link::protocol::Refusal;

pub(crate) use controller::{CLIENT, Controller, LIMITS, SENSOR_LIMITS};
pub(crate) use fault::{Fault, Line, Shows, Writes, Wrong};

use end::End;
use hil_sim::bus::Random;
use hil_sim::experiment::{Experiment, ExperimentError};
use hil_sim::link::Link;
use hil_sim::plant::{Joints, Plant};
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::device;
use hil_sim::schemes::{SchemeFileError, SchemeText};

/// Why there is no pair, or it does not move.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PairError {
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
pub(crate) struct Parts<'a> {
    /// Axes of each device.
    pub(crate) dof: usize,
    /// Of both controllers.
    pub(crate) sample_period_s: f64,
    /// The shipped scheme, with other values perhaps.
    pub(crate) scheme: &'a str,
    /// What the controllers move.
    pub(crate) plants: [Box<dyn Plant>; 2],
    /// Of the lines to them.
    pub(crate) delay_ticks: [u32; 2],
    /// What interrupts may take in the midst of a call.
    pub(crate) spare_cycles: u32,
    /// Of what a damaged line does.
    pub(crate) seed: u64,
}

/// Master and slave, stepped as a [`Rig`](hil_sim::rig::Rig) steps its stations. Sides are 0 for the master and 1 for the
/// slave.
#[derive(Debug)]
pub(crate) struct Pair {
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
    pub(crate) fn new(parts: Parts<'_>) -> Result<Self, PairError> {
        let Parts { dof, sample_period_s, scheme, plants, delay_ticks, spare_cycles, seed } = parts;
        let end = |side: &'static str, plant, delay_ticks| {
            let device = device(side, dof, sample_period_s)?;
            let controller = Controller::new(device, scheme, side, spare_cycles)?;
            Ok::<_, PairError>(End::new(controller, plant, delay_ticks, dof))
        };
        let ([master, slave], [to_master, to_slave]) = (plants, delay_ticks);
        let ends = [end("master", master, to_master)?, end("slave", slave, to_slave)?];
        Ok(Self { ends, period_s: sample_period_s, tick: 0, random: Random::new(seed) })
    }

    /// Both sides as they are shipped, and the ticks of their experiment.
    ///
    /// # Errors
    /// [`PairError`], where the shipped experiment cannot be made.
    pub(crate) fn shipped(spare_cycles: u32, seed: u64) -> Result<(Self, u32), PairError> {
        let file = RigFile::from_shipped("bilateral", &[]).unwrap();
        let mut experiment = Experiment::new(&file)?;
        let end_s = experiment.duration_s();
        let mut plants = experiment.rig_mut().stations_mut().iter_mut().map(|station| {
            let none: Box<dyn Plant> = Box::<Joints>::default();
            std::mem::replace(&mut station.plant, none)
        });
        let plants = [(); 2].map(|()| plants.next().unwrap_or_else(|| Box::<Joints>::default()));
        let pair = Self::new(Parts {
            dof: file.devices[0].axes.len(),
            sample_period_s: file.sample_period_s,
            scheme: &SchemeText::read(&file.controllers[0].scheme)?.text,
            plants,
            delay_ticks: [1, 0].map(|link: usize| file.links[link].carrier.delay_ticks),
            spare_cycles,
            seed,
        })?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few thousand ticks")]
        let end_tick = (end_s / file.sample_period_s) as u32;
        Ok((pair, end_tick))
    }

    /// Ticks so far.
    pub(crate) fn ticks(&self) -> u32 {
        self.tick
    }

    /// Forces of the last tick, N, of the master and of the slave.
    pub(crate) fn force_n(&self) -> [&[f32]; 2] {
        self.ends.each_ref().map(|end| end.force_n.as_slice())
    }

    /// The controllers of a side, and of the other one.
    pub(crate) fn of(&mut self, side: usize) -> [&mut Controller; 2] {
        let [master, slave] = self.ends.each_mut().map(|end| &mut end.controller);
        if side == 0 { [master, slave] } else { [slave, master] }
    }

    /// What is wrong at each side.
    pub(crate) fn wrong(&self) -> [&[Wrong]; 2] {
        self.ends.each_ref().map(|end| end.wrong.as_slice())
    }

    /// What each side's controller was given of its sensors in the last tick.
    pub(crate) fn measured(&self) -> [&[Word]; 2] {
        self.ends.each_ref().map(|end| end.measured.as_slice())
    }

    /// Counter of the packet that came over the line to each side in the last tick, if one did that was neither damaged
    /// nor there before.
    pub(crate) fn heard(&self) -> [Option<u16>; 2] {
        self.ends.each_ref().map(|end| end.heard)
    }

    /// Whether each side sent a packet in the last tick.
    pub(crate) fn has_sent(&self) -> [bool; 2] {
        self.ends.each_ref().map(|end| end.has_sent)
    }

    /// Begins a fault at a side for so many ticks, beside those that last.
    pub(crate) fn begin(&mut self, side: usize, fault: Fault, axis: usize, end_ticks: u32) {
        if let Some(end) = self.ends.get_mut(side) {
            end.wrong.push(Wrong { fault, axis, ticks: 0, end_ticks });
            end.controller.suffer(&end.wrong);
        }
    }

    /// Ends all faults at a side.
    pub(crate) fn end(&mut self, side: usize) {
        if let Some(end) = self.ends.get_mut(side) {
            end.wrong.clear();
            end.controller.suffer(&end.wrong);
        }
    }

    /// A tick of both sides, and what moves in it.
    pub(crate) fn step(&mut self) {
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
