//! Joints with drives on a CAN bus.
//!
//! ```text
//!   torques of the tick ─▶ MoteusJoint, Cia402Joint ─frames─▶ CanBus ─▶ MoteusDrive, Cia402Drive ─torque─▶ Joint
//!          readings ◀───── MoteusJoint, Cia402Joint ◀─frames─ CanBus ◀─ MoteusDrive, Cia402Drive ◀─motion─ Joint
//! ```
//! All frames of a tick are queued at its start, followed by SYNC; the bus schedules them. A drive replies, executes,
//! and holds its command until the next frame or its timeout. The controller side is the code of a board. Every drive
//! is queried or set up before the first tick.

mod cia402;
mod common;
mod moteus;

use super::joint::{Joint, JointState};
use crate::bus::can::{CanBus, CanFrame, Format, INTERFRAME_BITS, Identifier};
use crate::bus::time::{bits_to_ns, ns_to_seconds, seconds_to_ns};
use common::{BusParameters, DriveNode};
use drive::{Cia402Frame, Cia402Host, DriveReading};

pub use cia402::Cia402Parameters;
pub use common::{Absence, InjectedFault};
pub use moteus::MoteusParameters;

/// Maximum frames in a node's queue: those of every drive in a tick.
const QUEUE_FRAMES: usize = 8;
/// Minimum time step of a joint, limited by rounding, `s`.
const SHORTEST_S: f64 = 1e-9;

/// The drives of a device on their bus, with their joints.
#[derive(Debug)]
pub struct DriveBus {
    wires: BusParameters,
    bus: CanBus,
    /// Node of the controller.
    host: usize,
    axes: Vec<Axis>,
    /// Frames to all drives.
    sync: Option<Cia402Host>,
    /// Bus time, which never restarts.
    now_ns: u64,
}

#[derive(Debug)]
struct Axis {
    node: usize,
    drive: Box<dyn DriveNode>,
    joint: Joint,
    reading: DriveReading,
    is_on: bool,
    /// Time of the present period up to which the joint has moved.
    done_s: f64,
}

impl DriveBus {
    fn new(
        wires: BusParameters,
        drives: impl Iterator<Item = (Box<dyn DriveNode>, Joint)>,
        sync: Option<Cia402Host>,
        seed: u64,
    ) -> Self {
        let mut bus = CanBus::new(wires.can, seed);
        let host = bus.add("controller", &[]);
        let mut axes = Vec::new();
        for (place, (mut drive, joint)) in drives.enumerate() {
            let (by_drive, by_host) = drive.identifiers();
            let node = bus.add(&format!("drive {place}"), &by_drive);
            by_host.into_iter().for_each(|identifier| bus.accept(host, identifier));
            let JointState { position, velocity, .. } = joint.state();
            drive.set_state(position, velocity);
            drive.prepare();
            let reading = drive.read();
            axes.push(Axis { node, drive, joint, reading, is_on: false, done_s: 0.0 });
        }
        Self { wires, bus, host, axes, sync, now_ns: 0 }
    }

    /// Returns the joint of an axis.
    #[must_use]
    pub fn joint(&self, axis: usize) -> Option<&Joint> {
        self.axes.get(axis).map(|axis| &axis.joint)
    }

    /// Returns all joints, by axis.
    pub(crate) fn joints_mut(&mut self) -> impl Iterator<Item = &mut Joint> {
        self.axes.iter_mut().map(|axis| &mut axis.joint)
    }

    /// Returns the controller's readings of an axis.
    #[must_use]
    pub fn reading(&self, axis: usize) -> Option<&DriveReading> {
        self.axes.get(axis).map(|axis| &axis.reading)
    }

    /// Returns the bus.
    #[must_use]
    pub fn bus(&self) -> &CanBus {
        &self.bus
    }

    /// Sets whether an axis is commanded or off from the next period on.
    pub fn set_enabled(&mut self, axis: usize, is_on: bool) {
        if let Some(axis) = self.axes.get_mut(axis) {
            axis.is_on = is_on;
        }
    }

    /// Runs one tick from `start_s` for `period_s`: frames with the torques `command`, `N m`, replies, and motion
    /// with the external load `outside` of an axis at a time.
    pub fn advance(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: impl Fn(usize) -> f64,
        outside: &dyn Fn(usize, f64) -> f64,
    ) {
        let begin_ns = self.now_ns;
        let end_ns = begin_ns + seconds_to_ns(period_s);
        let reply_ns = seconds_to_ns(self.wires.reply_delay_s).max(1);
        self.find_faults(start_s, period_s);
        self.send(start_s, begin_ns, command);
        // Replies have this delay, so no observation in a step is late for the bus.
        let mut look_ns = begin_ns;
        while look_ns < end_ns {
            look_ns = (look_ns + reply_ns).min(end_ns);
            for (arrival_ns, place, frame) in self.arrivals(look_ns) {
                let is_absent = self.wires.is_absent(Some(place), start_s);
                let Some(axis) = self.axes.get_mut(place) else { continue };
                let push = |time_s: f64| outside(place, time_s);
                axis.move_on(start_s, ns_to_seconds(arrival_ns.saturating_sub(begin_ns)), &push);
                if is_absent {
                    continue;
                }
                axis.drive.obey(&frame);
                // A dropped frame counts as missing.
                self.bus.submit(axis.node, arrival_ns + reply_ns, axis.drive.sent());
            }
        }
        for (place, axis) in self.axes.iter_mut().enumerate() {
            axis.move_on(start_s, period_s, &|time_s| outside(place, time_s));
            axis.done_s = 0.0;
            let sent = axis.drive.sent();
            if !self.wires.is_absent(Some(place), start_s) {
                self.bus.submit(axis.node, end_ns, sent);
            }
        }
        let Self { bus, host, axes, wires, .. } = self;
        let is_absent = wires.is_absent(None, start_s);
        bus.receive(*host, end_ns, |_, frame| {
            for axis in axes.iter_mut().filter(|_| !is_absent) {
                axis.drive.hear(frame);
            }
        });
        axes.iter_mut().for_each(|axis| axis.reading = axis.drive.read());
        self.now_ns = end_ns;
    }

    fn find_faults(&mut self, start_s: f64, period_s: f64) {
        // Tolerance of half a tick for rounding.
        let is_now = |at_s: f64| (start_s - 0.5 * period_s..start_s + 0.5 * period_s).contains(&at_s);
        for fault in self.wires.fault.iter().filter(|fault| is_now(fault.at_s)) {
            if let Some(axis) = self.axes.get_mut(fault.axis) {
                axis.drive.raise_fault(fault.number);
            }
        }
    }

    fn send(&mut self, start_s: f64, begin_ns: u64, command: impl Fn(usize) -> f64) {
        if self.wires.is_absent(None, start_s) {
            return;
        }
        for (place, axis) in self.axes.iter_mut().enumerate() {
            #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
            let torque_nm = axis.is_on.then(|| command(place) as f32);
            // Lost if the bus is too slow.
            let _ =
                axis.drive.command(torque_nm).map(|frame| self.bus.submit(self.host, begin_ns, vec![frame]));
        }
        let Some(sync) = &mut self.sync else { return };
        // After the longest frames of the drives.
        let bits =
            CanFrame::max_wire_bits(Identifier::Standard(0), Format::Classic, 4).sum() + INTERFRAME_BITS;
        let wait_ns = bits_to_ns(bits, self.wires.can.bits_per_s) * self.axes.len() as u64;
        let (sync, heartbeat) = sync.frames();
        let frames = [Some(sync), heartbeat].into_iter().flatten().filter_map(|frame| classic(&frame));
        self.bus.submit(self.host, begin_ns + wait_ns, frames.collect());
    }

    /// Delivers frames to drives by `now_ns`, in order.
    fn arrivals(&mut self, now_ns: u64) -> Vec<(u64, usize, CanFrame)> {
        let mut arrivals = Vec::new();
        for (place, axis) in self.axes.iter().enumerate() {
            self.bus.receive(axis.node, now_ns, |arrival_ns, frame| {
                arrivals.push((arrival_ns, place, frame.clone()));
            });
        }
        arrivals.sort_by_key(|(arrival_ns, ..)| *arrival_ns);
        arrivals
    }
}

impl Axis {
    /// Moves the joint to `until_s` of the period with the drive's torque, which may time out.
    fn move_on(&mut self, start_s: f64, until_s: f64, outside: &dyn Fn(f64) -> f64) {
        while until_s - self.done_s > SHORTEST_S {
            let rest_s = until_s - self.done_s;
            let step_s = self
                .drive
                .time_to_timeout_s()
                .map_or(rest_s, |time_to_timeout_s| time_to_timeout_s.max(SHORTEST_S).min(rest_s));
            self.joint.advance(start_s + self.done_s, step_s, self.drive.torque_nm(), outside);
            self.done_s += step_s;
            let JointState { position, velocity, .. } = self.joint.state();
            self.drive.set_state(position, velocity);
            self.drive.advance(step_s);
        }
    }
}

fn classic(frame: &Cia402Frame) -> Option<CanFrame> {
    CanFrame::new(Identifier::Standard(frame.id()), Format::Classic, frame.bytes())
}
