//! The machine of a device: plant, environment, and delayed commands.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use dimsart_core::limits::MAX_DOF;

use super::axis::{Axis, AxisState};
use super::body::Body;
use crate::motion::LATE_S;
use crate::plant::{JointMotorParameters, JointParameters, Repetition};

/// Maximum delay of a command, ticks.
pub(super) const MAX_WAITING: usize = 5;

/// A device with one or more controllers.
#[derive(Debug)]
pub(super) struct Machine {
    body: Body,
    axes: Vec<Axis>,
    /// Delay of commands: whole ticks, and a fraction of a tick.
    delay: (usize, f64),
    repetition: Repetition,
    /// Active and pending commands, newest last.
    waiting: VecDeque<Vec<f64>>,
    positions: Arc<Positions>,
    /// Time of the next release of a hand, `s`, if known.
    next_let_go_s: f64,
    /// Number of controllers, and of those that have commanded in this tick.
    controllers: usize,
    commanded: usize,
}

/// Positions of the axes of a machine.
#[derive(Debug, Default)]
pub(super) struct Positions([AtomicU64; MAX_DOF]);

impl Positions {
    /// Returns the position of an axis; NaN for a nonexistent axis.
    pub(super) fn of(&self, axis: usize) -> f64 {
        self.0.get(axis).map_or(f64::NAN, |bits| f64::from_bits(bits.load(Ordering::Relaxed)))
    }

    fn show(&self, body: &Body, axes: usize) {
        for (axis, bits) in self.0.iter().enumerate().take(axes) {
            bits.store(body.position(axis).to_bits(), Ordering::Relaxed);
        }
    }
}

impl Machine {
    /// Creates the machine at rest with its number of controllers.
    pub(super) fn new(body: Body, axes: Vec<Axis>, delay_ticks: f64, controllers: usize) -> Self {
        let mut waiting = VecDeque::with_capacity(MAX_WAITING);
        waiting.resize(MAX_WAITING, vec![0.0; axes.len()]);
        let repetition = Repetition::ONCE;
        let positions = Arc::<Positions>::default();
        positions.show(&body, axes.len());
        let (next_let_go_s, commanded) = (0.0, 0);
        let whole_ticks = libm::floor(delay_ticks);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3")]
        let delay = (whole_ticks as usize, delay_ticks - whole_ticks);
        Self { body, axes, delay, repetition, waiting, positions, next_let_go_s, controllers, commanded }
    }

    pub(super) fn body(&self) -> &Body {
        &self.body
    }

    pub(super) fn positions(&self) -> Arc<Positions> {
        Arc::clone(&self.positions)
    }

    pub(super) fn body_mut(&mut self) -> &mut Body {
        &mut self.body
    }

    pub(super) fn repetition(&self) -> Repetition {
        self.repetition
    }

    pub(super) fn repeat(&mut self, repetition: Repetition) {
        self.axes.iter_mut().for_each(|axis| axis.still = None);
        self.repetition = repetition;
    }

    /// Sets the intended position of a hand; `None` returns it to the experiment.
    pub(super) fn hold_hand(&mut self, axis: usize, position: Option<f64>) {
        if let Some(axis) = self.axes.get_mut(axis) {
            (axis.held_hand, axis.still) = (position, None);
        }
    }

    pub(super) fn axis(&self, axis: usize) -> Option<&Axis> {
        self.axes.get(axis)
    }

    pub(super) fn state(&self, axis: usize) -> AxisState {
        self.body.state(axis)
    }

    /// Whether the actuator of an axis holds its force for a period: no delay and no motor.
    pub(super) fn holds_force(&self, axis: usize) -> bool {
        let plant = self.axis(axis).and_then(|axis| axis.section.plant.as_ref());
        let is_ideal = |plant: &JointParameters| matches!(plant.motor, JointMotorParameters::Ideal {});
        self.body.holds_commands() && !self.is_late() && plant.is_none_or(is_ideal)
    }

    /// Whether commands are delayed.
    fn is_late(&self) -> bool {
        self.delay.0 > 0 || self.delay.1 > 0.0
    }

    /// Releases hands whose time has come.
    fn let_go(&mut self, time_s: f64) {
        if time_s < self.next_let_go_s {
            return;
        }
        self.next_let_go_s = f64::INFINITY;
        for (place, axis) in self.axes.iter_mut().enumerate().filter(|(_, axis)| !axis.has_let_go) {
            if time_s >= axis.let_go_s - LATE_S {
                (axis.has_let_go, axis.still) = (true, None);
                if let Some(free) = axis.section.without_hand_stiffness().joint() {
                    self.body.hold(place, free.load.stiffness, free.load.rest_position);
                }
            } else {
                self.next_let_go_s = self.next_let_go_s.min(axis.let_go_s - LATE_S);
            }
        }
    }

    /// Whether an axis is in contact with a wall or stop.
    pub(super) fn is_touching(&self, axis: usize) -> bool {
        let wall = self.axis(axis).and_then(|axis| axis.section.active_wall());
        let is_at_wall =
            |wall: &crate::rig_file::AxisWall| wall.penetration_depth(self.body.position(axis)) > 0.0;
        self.body.is_at_stop(axis) || wall.is_some_and(is_at_wall)
    }

    /// Sets whether the actuators of axes are commanded or off.
    pub(super) fn set_enabled(&mut self, axes: &[usize], is_on: bool) {
        axes.iter().for_each(|axis| self.body.set_enabled(*axis, is_on));
    }

    /// Stores the commands of a controller; advances from `start_s` for `period_s` when all controllers have
    /// commanded.
    pub(super) fn take(&mut self, start_s: f64, period_s: f64, commands: impl Iterator<Item = (usize, f64)>) {
        if self.commanded == 0 && self.is_late() {
            self.waiting.rotate_left(1);
        }
        if let Some(newest) = self.waiting.back_mut() {
            for (axis, command) in commands {
                if let Some(of_axis) = newest.get_mut(axis) {
                    *of_axis = command;
                }
            }
        }
        self.commanded += 1;
        if self.commanded >= self.controllers {
            self.commanded = 0;
            self.advance(start_s, period_s);
        }
    }

    fn advance(&mut self, start_s: f64, period_s: f64) {
        self.let_go(start_s);
        let (ticks, share) = self.delay;
        let change_s = share * period_s;
        let Self { body, axes, waiting, repetition, positions, .. } = self;
        let held = |ticks: usize| {
            let place = waiting.len().checked_sub(ticks + 1);
            place.and_then(|place| waiting.get(place)).map(Vec::as_slice).unwrap_or_default()
        };
        body.advance(start_s, change_s, held(ticks + 1), axes, *repetition);
        body.advance(start_s + change_s, period_s - change_s, held(ticks), axes, *repetition);
        positions.show(body, axes.len());
    }
}
