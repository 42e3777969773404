//! The two-sided loop of one axis over a line with packet loss controlled by the test.

use std::sync::{Arc, Mutex};

use dimsart_core::{Command, TickResult, types};
use hil_sim::link::{InProcess, InProcessParameters, Link};
use hil_sim::plant::{ExternalForce, Joints};
use hil_sim::rig::{Rig, SimulatedDimsart, Station, StationLink};

use crate::loops::{MASTER, Met, SLAVE, TICK_S, axis, delays, rig, signal};

/// Ticks without a packet after which a link is lost.
pub(crate) const TIMEOUT_TICKS: u64 = 20;

/// Loses the packets of the ticks selected by `loses`, and records arrivals.
struct LossyLink<F> {
    line: InProcess,
    loses: F,
    arrivals: Arc<Mutex<Option<u64>>>,
}

impl<F> std::fmt::Debug for LossyLink<F> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LossyLink").finish_non_exhaustive()
    }
}

impl<F: FnMut(u64) -> bool + Send> Link for LossyLink<F> {
    fn send(&mut self, now: u64, bytes: &[u8]) {
        if !(self.loses)(now) {
            self.line.send(now, bytes);
        }
    }

    fn receive(&mut self, now: u64, deliver: &mut dyn FnMut(&[u8])) {
        let arrivals = &self.arrivals;
        self.line.receive(now, &mut |bytes| {
            *arrivals.lock().unwrap() = Some(now);
            deliver(bytes);
        });
    }
}

/// A side's state, and the state expected from the line.
pub(crate) struct Watched {
    arrivals: Arc<Mutex<Option<u64>>>,
    /// Tick in which the link became lost, from the line's arrivals.
    lost_at: Option<u64>,
}

/// Two stations and the lines between them.
pub(crate) struct Loop {
    pub(crate) rig: Rig,
    /// By the receiving station.
    pub(crate) sides: [Watched; 2],
}

impl Loop {
    /// Implicit form, 10 ticks each way. `loses` is called for every packet, by receiving station.
    pub(crate) fn new<F: FnMut(u64) -> bool + Send + 'static>(
        settings: &str,
        hand: Option<ExternalForce>,
        loses: [F; 2],
    ) -> Self {
        let settings = format!("wave.form=implicit {} {settings}", delays(10, 10));
        let (master, slave) = (axis(0.1, 8.0, Met::Nothing, hand), axis(0.5, 8.0, Met::Nothing, None));
        let mut shipped = rig(&settings, master, slave);
        let mut rig = Rig::new(TICK_S);
        for station in shipped.stations_mut() {
            let dimsart =
                std::mem::replace(&mut station.dimsart, Box::new(SimulatedDimsart::without_device()));
            let plant = std::mem::replace(&mut station.plant, Box::new(Joints::new(Vec::new())));
            rig.add(Station::new(&station.name, dimsart, plant));
        }
        let sides = loses.map(|loses| (loses, Arc::new(Mutex::new(None))));
        let watched = |arrivals: &Arc<_>| Watched { arrivals: Arc::clone(arrivals), lost_at: None };
        let watched = [watched(&sides[MASTER].1), watched(&sides[SLAVE].1)];
        for ((loses, arrivals), [from, to]) in sides.into_iter().zip([[SLAVE, MASTER], [MASTER, SLAVE]]) {
            let line = InProcess::new(InProcessParameters::default(), 0);
            let [from, to] = [from, to].map(|station| StationLink { station, link: 0 });
            rig.connect(from, to, Box::new(LossyLink { line, loses, arrivals }));
        }
        Self { rig, sides: watched }
    }

    /// Runs a tick of both sides and checks that each link is lost exactly after [`TIMEOUT_TICKS`] without an
    /// arrival; returns the lost ones.
    pub(crate) fn tick(&mut self, what: &str) -> [bool; 2] {
        self.rig.tick();
        let now = self.rig.ticks();
        for (station, side) in self.rig.stations().iter().zip(&mut self.sides) {
            let last = *side.arrivals.lock().unwrap();
            let is_silent = last.is_some_and(|last| now - last >= TIMEOUT_TICKS);
            if is_silent && side.lost_at.is_none() {
                side.lost_at = Some(now);
            }
            let expected =
                if side.lost_at.is_some() { TickResult::LinkLost { link: 0 } } else { TickResult::Ran };
            assert_eq!(
                station.last_tick, expected,
                "{what}: {}, tick {now}, last arrival {last:?}",
                station.name
            );
        }
        self.sides.each_ref().map(|side| side.lost_at.is_some())
    }

    /// Resets both sides.
    pub(crate) fn reset(&mut self) {
        for (station, side) in self.rig.stations_mut().iter_mut().zip(&mut self.sides) {
            station.dimsart.command(Command::Reset).unwrap();
            *side.arrivals.lock().unwrap() = None;
            side.lost_at = None;
        }
    }

    /// Returns the positions of the devices, `m`.
    pub(crate) fn positions_m(&self) -> [f64; 2] {
        [MASTER, SLAVE].map(|side| signal(&self.rig, side, types::POSITION))
    }
}
