//! Joints that moteus drives turn, behind their CAN FD bus.
//!
//! ```text
//!   torques of the tick ─▶ MoteusJoint ─frames─▶ CanBus ─▶ MoteusDrive ─torque─▶ Joint
//!          readings ◀───── MoteusJoint ◀─replies─ CanBus ◀─ MoteusDrive ◀─motion─ Joint
//! ```
//! All frames of a tick wait from its beginning on, and the bus decides when each drive gets its own. The drive answers,
//! obeys, and holds what it was commanded until the next frame, or its timeout. `MoteusJoint` is the very code that
//! runs on a board. Before the first tick every drive was asked once.

mod parameters;

use super::MoteusDrive;
use super::joint::{Joint, JointState};
use crate::bus::can::{CanBus, CanFrame, CanParameters, Format, Identifier};
use crate::bus::time::{ns_seconds, seconds_ns};
use drive::{MoteusAddress, MoteusFrame, MoteusJoint, MoteusReading};

pub use parameters::{Absence, FoundFault, MoteusParameters};

/// Frames that wait in a node at most: each drive's of a tick.
const QUEUE_FRAMES: usize = 8;
/// Shortest part of a period that a joint is moved by: what is shorter is lost in rounding, `s`.
const SHORTEST_S: f64 = 1e-9;

impl MoteusParameters {
    /// The bus with its drives, each at rest with its joint. `seed` decides on bit errors.
    #[must_use]
    pub fn build(&self, joints: Vec<Joint>, seed: u64) -> MoteusBus {
        let parameters = CanParameters {
            bits_per_s: self.bits_per_s,
            data_bits_per_s: self.data_bits_per_s,
            bit_error_rate: self.bit_error_rate,
            rejoins: 0,
            queue_frames: QUEUE_FRAMES,
        };
        let mut bus = CanBus::new(parameters, seed);
        let host = bus.add("controller", &[]);
        let mut axes = Vec::new();
        for (id, joint) in self.ids.iter().zip(joints) {
            let Some(address) = MoteusAddress::new(self.host, *id) else { continue };
            bus.accept(host, Identifier::Extended(address.reply_id()));
            let node = bus.add(&format!("drive {id}"), &[Identifier::Extended(address.command_id())]);
            let mut control = MoteusJoint::new(address, self.timeout_s, self.missing_ticks);
            let mut drive = MoteusDrive::new(*id, self.most_torque_nm);
            let JointState { position, velocity, .. } = joint.state();
            drive.set_state(position, velocity);
            let asked = drive.receive(address.command_id(), MoteusFrame::query().bytes());
            // It is this drive's, and sound.
            let _ = asked.map(|(id, reply)| control.receive(id, &reply));
            let reading = control.read();
            axes.push(Axis { node, drive, joint, control, reading, is_on: false, done_s: 0.0 });
        }
        MoteusBus { parameters: self.clone(), bus, host, axes, now_ns: 0 }
    }
}

/// The drives of a device on their bus, and what each of them turns.
#[derive(Debug)]
pub struct MoteusBus {
    parameters: MoteusParameters,
    bus: CanBus,
    /// The controller's node.
    host: usize,
    axes: Vec<Axis>,
    /// On the bus, which knows no time that begins anew.
    now_ns: u64,
}

#[derive(Debug)]
struct Axis {
    node: usize,
    drive: MoteusDrive,
    joint: Joint,
    /// The controller's side.
    control: MoteusJoint,
    reading: MoteusReading,
    is_on: bool,
    /// Of the present period, how far the joint has moved.
    done_s: f64,
}

impl MoteusBus {
    /// The joint of an axis.
    #[must_use]
    pub fn joint(&self, axis: usize) -> Option<&Joint> {
        self.axes.get(axis).map(|axis| &axis.joint)
    }

    /// What the controller reads of an axis now.
    #[must_use]
    pub fn reading(&self, axis: usize) -> Option<&MoteusReading> {
        self.axes.get(axis).map(|axis| &axis.reading)
    }

    /// The bus itself.
    #[must_use]
    pub fn bus(&self) -> &CanBus {
        &self.bus
    }

    /// Whether an axis is commanded from the next period on, or off.
    pub fn switch(&mut self, axis: usize, is_on: bool) {
        if let Some(axis) = self.axes.get_mut(axis) {
            axis.is_on = is_on;
        }
    }

    /// One tick from `start_s` for `period_s`: frames with the torques `command`, `N m`, replies, and motion under the load
    /// `outside` of an axis at a time.
    pub fn advance(
        &mut self,
        start_s: f64,
        period_s: f64,
        command: impl Fn(usize) -> f64,
        outside: &dyn Fn(usize, f64) -> f64,
    ) {
        let begin_ns = self.now_ns;
        let end_ns = begin_ns + seconds_ns(period_s);
        let reply_ns = seconds_ns(self.parameters.reply_delay_s).max(1);
        self.find_faults(start_s, period_s);
        self.send(start_s, begin_ns, command);
        // A reply waits that long: none of what is seen in a step is late for the bus.
        let mut look_ns = begin_ns;
        while look_ns < end_ns {
            look_ns = (look_ns + reply_ns).min(end_ns);
            for (arrival_ns, place, frame) in self.arrivals(look_ns) {
                let is_absent = self.parameters.is_absent(Some(place), start_s);
                let Some(axis) = self.axes.get_mut(place) else { continue };
                let push = |time_s: f64| outside(place, time_s);
                axis.move_on(start_s, ns_seconds(arrival_ns.saturating_sub(begin_ns)), &push);
                if is_absent {
                    continue;
                }
                let answer = axis.drive.receive(raw(frame.identifier), frame.data());
                let answer =
                    answer.and_then(|(id, data)| CanFrame::new(Identifier::Extended(id), Format::Fd, &data));
                // One that finds no room is one more that is missing.
                let _ = answer.map(|answer| self.bus.submit(axis.node, arrival_ns + reply_ns, vec![answer]));
            }
        }
        for (place, axis) in self.axes.iter_mut().enumerate() {
            axis.move_on(start_s, period_s, &|time_s| outside(place, time_s));
            axis.done_s = 0.0;
        }
        let Self { bus, host, axes, parameters, .. } = self;
        let is_absent = parameters.is_absent(None, start_s);
        bus.receive(*host, end_ns, |_, frame| {
            for axis in axes.iter_mut().filter(|_| !is_absent) {
                // What says nothing is a reply that is missing.
                let _ = axis.control.receive(raw(frame.identifier), frame.data());
            }
        });
        axes.iter_mut().for_each(|axis| axis.reading = axis.control.read());
        self.now_ns = end_ns;
    }

    fn find_faults(&mut self, start_s: f64, period_s: f64) {
        // Half a tick to either side, whatever the rounding.
        let is_now = |at_s: f64| (start_s - 0.5 * period_s..start_s + 0.5 * period_s).contains(&at_s);
        for fault in self.parameters.fault.iter().filter(|fault| is_now(fault.at_s)) {
            if let Some(axis) = self.axes.get_mut(fault.axis) {
                axis.drive.raise_fault(fault.number);
            }
        }
    }

    fn send(&mut self, start_s: f64, begin_ns: u64, command: impl Fn(usize) -> f64) {
        if self.parameters.is_absent(None, start_s) {
            return;
        }
        for (place, axis) in self.axes.iter_mut().enumerate() {
            #[expect(clippy::cast_possible_truncation, reason = "the controller's number is an f32")]
            let torque_nm = axis.is_on.then(|| command(place) as f32);
            let frame = axis.control.frame(torque_nm);
            let identifier = Identifier::Extended(axis.control.address().command_id());
            let frame = CanFrame::new(identifier, Format::Fd, frame.bytes());
            // On a bus that is too slow it is lost.
            let _ = frame.map(|frame| self.bus.submit(self.host, begin_ns, vec![frame]));
        }
    }

    /// What has come to drives by `now_ns`, in order.
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
    /// Moves the joint to `until_s` of the period under the drive's torque, which may time out on the way.
    fn move_on(&mut self, start_s: f64, until_s: f64, outside: &dyn Fn(f64) -> f64) {
        while until_s - self.done_s > SHORTEST_S {
            let rest_s = until_s - self.done_s;
            let step_s = self.drive.left_s().map_or(rest_s, |left_s| left_s.max(SHORTEST_S).min(rest_s));
            self.joint.advance(start_s + self.done_s, step_s, self.drive.torque_nm(), outside);
            self.done_s += step_s;
            let JointState { position, velocity, .. } = self.joint.state();
            self.drive.set_state(position, velocity);
            self.drive.advance(step_s);
        }
    }
}

fn raw(identifier: Identifier) -> u32 {
    match identifier {
        Identifier::Standard(base) => base.into(),
        Identifier::Extended(all) => all,
    }
}
