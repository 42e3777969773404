//! Types matching check: reports all faults of a scheme.

use heapless::Vec;

use crate::data_base::bit;
use crate::device::DeviceDescriptor;
use crate::limits::MAX_FINDINGS;
use crate::module::{Direction, Stage, TypeMismatch};
use crate::scheme::finding::{Endpoint, Finding};
use crate::scheme::wiring::{ActiveModule, Call, Port, Wiring, module_bit};
use crate::signal::{DataType, TypeRef, Unit, UnitRelation};

/// Report of a matching check: faults and remarks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CheckReport {
    findings: Vec<Finding, MAX_FINDINGS>,
    faults: usize,
    unlisted: usize,
    /// Whether to stop at the first fault.
    ends_with_fault: bool,
}

impl CheckReport {
    /// Creates a report that stops at the first fault.
    pub(crate) fn of_first_fault() -> Self {
        Self { ends_with_fault: true, ..Self::default() }
    }

    fn is_over(&self) -> bool {
        self.ends_with_fault && self.faults > 0
    }

    /// Returns the findings, faults first.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Returns the number of faults, listed or not.
    #[must_use]
    pub fn faults(&self) -> usize {
        self.faults
    }

    /// Returns the number of findings beyond [`MAX_FINDINGS`], which are not listed.
    #[must_use]
    pub fn unlisted(&self) -> usize {
        self.unlisted
    }

    /// Returns whether the scheme has no fault and may run.
    #[must_use]
    pub fn has_no_fault(&self) -> bool {
        self.faults == 0
    }

    fn add(&mut self, finding: Finding) {
        let listed = self.findings.len();
        let place = if finding.is_fault() { self.faults.min(listed) } else { listed };
        self.faults += usize::from(finding.is_fault());
        if self.findings.is_full() {
            self.unlisted += 1;
            if place == listed {
                return;
            }
            // A fault replaces a remark.
            self.findings.pop();
        }
        let _ = self.findings.insert(place, finding);
    }
}

/// One use of a signal: module or frame, position in the tick, and whether a delay is declared.
#[derive(Debug, Clone, Copy)]
struct Use {
    party: Endpoint,
    place: usize,
    direction: Direction,
    is_delayed: bool,
}

/// A scheme to be checked.
pub(crate) struct MatchingCheck<'a> {
    pub(crate) device: &'a DeviceDescriptor,
    pub(crate) wiring: &'a Wiring,
}

impl MatchingCheck<'_> {
    /// Checks the scheme into an empty report. `signals` lists the signals of the Data Base with their slots;
    /// `signal_in` finds the signal of a slot.
    pub(crate) fn check(
        &self,
        signals: impl Iterator<Item = (u8, TypeRef)> + Clone,
        signal_in: impl Fn(u8) -> Option<TypeRef>,
        report: &mut CheckReport,
    ) {
        self.check_bindings(&signal_in, report);
        self.check_coordinates(&signal_in, report);
        self.check_ties(&signal_in, report);
        self.check_links(report);
        self.check_rates(&signal_in, report);
        self.check_late_stages(report);
        if report.is_over() {
            return;
        }
        let suspects = self.suspects(signals.clone());
        for (slot, signal) in signals.clone().filter(|(slot, _)| suspects & bit(*slot) != 0) {
            self.check_signal(slot, signal, report);
            if report.is_over() {
                return;
            }
        }
    }

    /// Returns the slots of suspect signals, one bit each: those not written exactly once in a tick and read
    /// afterwards. One pass over all ports: most signals pass.
    fn suspects(&self, signals: impl Iterator<Item = (u8, TypeRef)> + Clone) -> u64 {
        let of_frame = |types: &[&DataType]| {
            let is_frame_s = |signal: TypeRef| types.iter().any(|data_type| data_type.first() == signal);
            let slots = signals.clone().filter(|(_, signal)| is_frame_s(*signal)).map(|(slot, _)| bit(slot));
            slots.fold(0, |slots, slot| slots | slot)
        };
        let (mut written, mut suspects) = (of_frame(self.device.outputs), 0);
        for call in self.wiring.calls() {
            let (mut reads, mut writes) = (0, 0);
            for port in self.ports_of(call) {
                let slot = bit(port.slot);
                if port.is_written() {
                    suspects |= writes & slot;
                    writes |= slot;
                } else {
                    // Includes slots of memories, which hold no signal.
                    reads |= slot;
                    suspects |= if port.is_delayed() { slot } else { 0 };
                }
            }
            suspects |= (reads & !written) | (writes & written);
            written |= writes;
        }
        suspects | (of_frame(self.device.inputs) & !written)
    }

    fn check_bindings(&self, signal_in: &impl Fn(u8) -> Option<TypeRef>, report: &mut CheckReport) {
        for plugged in self.wiring.modules() {
            for (port, found) in (0..).zip(self.wiring.ports(plugged)) {
                let Some(difference) = found.difference() else { continue };
                if let Some(signal) = signal_in(found.slot) {
                    report.add(Finding::Mismatch {
                        module: plugged.module,
                        port,
                        signal,
                        mismatch: difference,
                    });
                }
            }
        }
    }

    /// Checks that the coordinates of a module are all Cartesian or all joint coordinates.
    fn check_coordinates(&self, signal_in: &impl Fn(u8) -> Option<TypeRef>, report: &mut CheckReport) {
        for plugged in self.wiring.modules() {
            let mut first = None;
            for (port, found) in (0..).zip(self.wiring.ports(plugged)) {
                let takes_coordinate = found.takes_coordinate() && found.difference().is_none();
                let Some(signal) = signal_in(found.slot).filter(|_| takes_coordinate) else { continue };
                let Some(data_type) = self.device.data_type(signal.id) else { continue };
                let is_joint_s = data_type.unit.cartesian().is_some();
                if data_type.unit != Unit::Any && *first.get_or_insert(is_joint_s) != is_joint_s {
                    let difference = TypeMismatch::Coordinates;
                    report.add(Finding::Mismatch {
                        module: plugged.module,
                        port,
                        signal,
                        mismatch: difference,
                    });
                }
            }
        }
    }

    fn check_ties(&self, signal_in: &impl Fn(u8) -> Option<TypeRef>, report: &mut CheckReport) {
        for plugged in self.wiring.modules() {
            let ports = self.wiring.ports(plugged);
            for (index, port) in ports.iter().enumerate() {
                let Some((tie, signal)) = port.tie().zip(signal_in(port.slot)) else { continue };
                // Ports tied alike to a port of any unit must agree with each other.
                let wrong = (0..).zip(ports).take(index).find_map(|(number, other)| {
                    let relation = match other.tie() {
                        _ if number == tie.port => tie.relation,
                        found if found == Some(tie) && tie.relation == UnitRelation::SameType => tie.relation,
                        found if found == Some(tie) => UnitRelation::Same,
                        _ => return None,
                    };
                    let other_signal = signal_in(other.slot)?;
                    (!self.admits(relation, signal, other_signal)).then_some((number, other_signal, relation))
                });
                if let (Some((other_port, other_signal, relation)), Ok(port)) = (wrong, u8::try_from(index)) {
                    let module = plugged.module;
                    report.add(Finding::UnitsDiffer {
                        module,
                        port,
                        signal,
                        other_port,
                        other_signal,
                        relation,
                    });
                }
            }
        }
    }

    fn check_links(&self, report: &mut CheckReport) {
        let modules = self.wiring.modules();
        for (place, second) in modules.iter().enumerate() {
            let Some(end) = second.link_end else { continue };
            let has_it = |first: &&ActiveModule| first.link_end.is_some_and(|other| other.is_same(end));
            if let Some(first) = modules.iter().take(place).find(has_it) {
                let (first, second) = (first.module, second.module);
                report.add(Finding::DuplicateLinkEnd { link: end.link, first, second });
            }
        }
    }

    fn check_rates(&self, signal_in: &impl Fn(u8) -> Option<TypeRef>, report: &mut CheckReport) {
        for plugged in self.wiring.modules().iter().filter(|plugged| plugged.rate.is_slow()) {
            for port in self.wiring.ports(plugged).iter().filter(|port| port.is_written()) {
                if let Some(signal) = signal_in(port.slot) {
                    let (writer, every_ticks) = (plugged.module, plugged.rate.every_ticks);
                    report.add(Finding::SlowWriter { signal, writer, every_ticks });
                }
            }
        }
    }

    /// A late stage needs values of this tick from the modules between its module's two stages.
    fn check_late_stages(&self, report: &mut CheckReport) {
        let modules = self.wiring.modules();
        for (order, late) in (0..).zip(modules) {
            let waits = |port: &Port| port.stage() == Stage::Late && !port.is_written();
            if !self.wiring.ports(late).iter().any(waits) {
                continue;
            }
            for (other, writer) in (0..).zip(modules) {
                let is_between = late.needs & module_bit(other) != 0 && writer.needs & module_bit(order) != 0;
                if is_between && !late.rate.every_ticks.is_multiple_of(writer.rate.every_ticks) {
                    let (reader, every_ticks) = (late.module, writer.rate.every_ticks);
                    report.add(Finding::LateStageRate { reader, writer: writer.module, every_ticks });
                }
            }
        }
    }

    /// Returns whether two signals satisfy a relation; true for unknown types.
    fn admits(&self, relation: UnitRelation, signal: TypeRef, other: TypeRef) -> bool {
        let found = self.device.data_type(signal.id).zip(self.device.data_type(other.id));
        found.is_none_or(|(found, other)| {
            let is_alike = found.format == other.format && found.shape == other.shape;
            relation.accepts(found.unit, other.unit) && (is_alike || relation != UnitRelation::SameType)
        })
    }

    fn check_signal(&self, slot: u8, signal: TypeRef, report: &mut CheckReport) {
        let mut writer: Option<Use> = None;
        self.visit_uses(slot, signal, &mut |found| match writer {
            _ if found.direction != Direction::Write => {}
            None => writer = Some(found),
            Some(first) => {
                report.add(Finding::MultipleWriters { signal, first: first.party, second: found.party });
            }
        });
        self.visit_uses(slot, signal, &mut |reader| match writer {
            None => report.add(Finding::NoWriter { signal, reader: reader.party }),
            Some(writer) if reader.direction == Direction::Read && reader.place <= writer.place => {
                let is_declared = reader.is_delayed || writer.is_delayed;
                let (writer, reader) = (writer.party, reader.party);
                report.add(Finding::Delay { signal, writer, reader, is_declared });
            }
            Some(writer) if reader.direction == Direction::Read && reader.is_delayed => {
                // A measurement may be of the previous tick.
                if let (Endpoint::Module(writer), Endpoint::Module(reader)) = (writer.party, reader.party) {
                    report.add(Finding::MissingDelay { signal, writer, reader });
                }
            }
            Some(_) => {}
        });
    }

    /// Visits the uses of a signal in the order of the tick.
    #[inline(never)]
    fn visit_uses(&self, slot: u8, signal: TypeRef, visit: &mut dyn FnMut(Use)) {
        let is_mine = |types: &[&DataType]| types.iter().any(|data_type| data_type.first() == signal);
        let frame = |direction, place| Use { party: Endpoint::Frame, place, direction, is_delayed: false };
        if is_mine(self.device.outputs) {
            visit(frame(Direction::Write, 0));
        }
        for (place, call) in (1..).zip(self.wiring.calls()) {
            let Some(plugged) = self.wiring.called(call) else { continue };
            for port in self.ports_of(call).filter(|port| port.slot == slot) {
                let (party, direction) = (Endpoint::Module(plugged.module), port.direction());
                visit(Use { party, place, direction, is_delayed: port.is_delayed() });
            }
        }
        if is_mine(self.device.inputs) {
            visit(frame(Direction::Read, usize::MAX));
        }
    }

    /// Returns the ports that a call uses.
    fn ports_of(&self, call: &Call) -> impl Iterator<Item = &Port> {
        let ports = self.wiring.called(call).map_or(&[][..], |plugged| self.wiring.ports(plugged));
        let stage = call.stage;
        ports.iter().filter(move |port| port.stage() == stage)
    }
}
