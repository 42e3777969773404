//! One side of a pair: a controller, its plant and the line to it.

use dimsart_core::{Packet, Word};

use super::controller::Controller;
use super::fault::{Fault, Line, Shows, Wrong};
use hil_sim::bus::Random;
use hil_sim::link::{InProcess, InProcessParameters, Link as _};
use hil_sim::plant::Plant;

/// Most bits of a packet that are damaged: so few are found for sure.
const WRONG_BITS: u32 = 4;

/// A controller, its plant and the line to it.
#[derive(Debug)]
pub(crate) struct End {
    pub(crate) controller: Controller,
    pub(crate) plant: Box<dyn Plant>,
    pub(crate) line: InProcess,
    pub(crate) wrong: Vec<Wrong>,
    position_m: Vec<f32>,
    pub(crate) force_n: Vec<f32>,
    /// What its sensors showed and its actuators got in the last tick in which none was stuck, and what came over the
    /// line last.
    shown_m: Vec<f32>,
    given_n: Vec<f32>,
    packet: Vec<u8>,
    pub(crate) measured: Vec<Word>,
    /// Counter of what came over the line in the last tick and was no damaged packet and none that came before.
    pub(crate) heard: Option<u16>,
    pub(crate) has_sent: bool,
}

impl End {
    pub(crate) fn new(controller: Controller, plant: Box<dyn Plant>, delay_ticks: u32, dof: usize) -> Self {
        let parameters = InProcessParameters { delay_ticks, ..InProcessParameters::default() };
        let zeros = vec![0.0; dof];
        Self {
            controller,
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
        }
    }

    pub(crate) fn receive(&mut self, tick: u64, random: &mut Random) {
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
                let channel = controller.dimsart().receive_channel(0);
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
        for Wrong { fault, axis, ticks, .. } in &self.wrong {
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

    pub(crate) fn tick(&mut self) {
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

    pub(crate) fn advance(&mut self, start_s: f64, period_s: f64) {
        let mut force_n = self.force_n.clone();
        for axis in self.stuck_axes() {
            if let Some((force_n, given_n)) = force_n.get_mut(axis).zip(self.given_n.get(axis)) {
                *force_n = *given_n;
            }
        }
        self.wrong.iter_mut().for_each(|wrong| wrong.ticks += 1);
        if self.wrong.iter().any(|wrong| wrong.ticks >= wrong.end_ticks) {
            self.wrong.retain(|wrong| wrong.ticks < wrong.end_ticks);
            self.controller.suffer(&self.wrong);
        }
        self.plant.advance(start_s, period_s, &force_n);
    }
}

/// The bytes with 1 to [`WRONG_BITS`] wrong bits.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    let most = u32::try_from(8 * bytes.len()).unwrap_or(u32::MAX).saturating_sub(1);
    for _ in 0..=random.uniform_integer(WRONG_BITS - 1) {
        let bit = usize::try_from(random.uniform_integer(most)).unwrap_or_default();
        if let Some(byte) = damaged.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
    }
    damaged
}
