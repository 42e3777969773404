//! How a module declares its ports and memory; see [`Module::ports`](crate::Module::ports).

use core::mem::take;

use crate::data_type::{DataType, TypeRef};
use crate::device::DeviceDescriptor;
use crate::handle::{Input, Memory, Output, Signal};
use crate::port::{Difference, Direction, LinkEnd, PortSpec, PortSpecs, Stage};
use crate::storage::Block;
use crate::unit_tie::{UnitRelation, UnitTie};

/// Takes a module's declarations and gives the handles for them.
///
/// A port is used in the early stage, reads what was written before it in the tick, and fits signals of its type's unit,
/// unless [`late`](Self::late), [`delayed`](Self::delayed) or [`any_unit`](Self::any_unit) stands before it:
/// `declare.late().input("FORCE", types::FORCE)`.
#[derive(Debug)]
pub struct Declare<'a> {
    device: &'a DeviceDescriptor,
    specs: &'a mut PortSpecs,
    count: u8,
    next: Next,
    link_end: Option<LinkEnd>,
}

/// What was said of the port that is declared next.
#[derive(Debug, Default)]
struct Next {
    is_late: bool,
    is_delayed: bool,
    takes_any_unit: bool,
    signal: Option<TypeRef>,
}

impl<'a> Declare<'a> {
    /// Collects what is declared into `specs`: they are large, and would be copied.
    pub(crate) fn new(device: &'a DeviceDescriptor, specs: &'a mut PortSpecs) -> Self {
        Self { device, specs, count: 0, next: Next::default(), link_end: None }
    }

    /// The device the module is plugged in for.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        self.device
    }

    /// The next port is used in the late stage.
    pub fn late(&mut self) -> &mut Self {
        self.next.is_late = true;
        self
    }

    /// Data one tick old is what the next port wants (read) or gives (write).
    pub fn delayed(&mut self) -> &mut Self {
        self.next.is_delayed = true;
        self
    }

    /// The next port takes a signal of any unit: for a module that moves values and does not look at them. What it
    /// makes of them is [tied](Self::tie) to it.
    pub fn any_unit(&mut self) -> &mut Self {
        self.next.takes_any_unit = true;
        self
    }

    /// The next port uses this signal unless a command binds it to another one: one that a command named, such as the
    /// content of a comm channel.
    pub fn of_signal(&mut self, signal: TypeRef) -> &mut Self {
        self.next.signal = Some(signal);
        self
    }

    /// Reads a signal.
    pub fn input<S: Signal>(&mut self, name: &'static str, data_type: &'static DataType) -> Input<S> {
        Input::new(self.signal::<S>(name, data_type, Direction::Read))
    }

    /// Writes a signal.
    pub fn output<S: Signal>(&mut self, name: &'static str, data_type: &'static DataType) -> Output<S> {
        Output::new(self.signal::<S>(name, data_type, Direction::Write))
    }

    /// Takes `words` words of memory of the module's own, all zero at first.
    pub fn memory(&mut self, name: &'static str, words: usize) -> Memory {
        let block = self.add(PortSpec {
            name,
            data_type: None,
            direction: Direction::Memory(words),
            stage: Stage::Early,
            is_delayed: false,
            misfit: None,
            takes_any_unit: false,
            tie: None,
        });
        Memory { block }
    }

    /// Ties the unit of `port` to that of `other`, both declared before, `other` first: a sum has the unit
    /// of what is added. The matching check holds the signals they are bound to against it, and those of
    /// ports tied to `other` in the same way against each other. A name no port has ties nothing.
    pub fn tie(&mut self, port: &'static str, relation: UnitRelation, other: &'static str) {
        let place = |name| self.specs.iter().position(|spec: &PortSpec| spec.name == name);
        let (Some(place), Some(other)) = (place(port), place(other)) else { return };
        if let (Some(spec), Ok(port)) = (self.specs.get_mut(place), u8::try_from(other)) {
            spec.tie = Some(UnitTie { relation, port });
        }
    }

    /// Says which link and channel the module sends over. A second one that sends over the link is a fault.
    pub fn sends_over(&mut self, link: u32, channel: u32) {
        self.take_link_end(link, channel, true);
    }

    /// Says which link and channel the module listens to. A second one that listens to the link is a fault.
    pub fn listens_to(&mut self, link: u32, channel: u32) {
        self.take_link_end(link, channel, false);
    }

    pub(crate) fn link_end(&self) -> Option<LinkEnd> {
        self.link_end
    }

    /// Whether all that was declared is among the specs: there were no more than
    /// [`MAX_PORTS`](crate::limits::MAX_PORTS).
    pub(crate) fn has_all(&self) -> bool {
        usize::from(self.count) == self.specs.len()
    }

    fn take_link_end(&mut self, link: u32, channel: u32, is_sending: bool) {
        let numbers = u8::try_from(link).ok().zip(u16::try_from(channel).ok());
        self.link_end = numbers.map(|(link, channel)| LinkEnd { link, channel, is_sending });
    }

    #[inline(always)]
    fn signal<S: Signal>(
        &mut self,
        name: &'static str,
        data_type: &'static DataType,
        direction: Direction,
    ) -> Block {
        let misfit = if S::FORMAT != data_type.format {
            Some(Difference::Format)
        } else {
            (!S::takes(data_type.shape)).then_some(Difference::Shape)
        };
        self.add_signal(name, data_type, direction, misfit)
    }

    /// Not generic: a call and no more for each line of a module's declarations.
    #[inline(never)]
    fn add_signal(
        &mut self,
        name: &'static str,
        data_type: &'static DataType,
        direction: Direction,
        misfit: Option<Difference>,
    ) -> Block {
        let Next { is_late, is_delayed, takes_any_unit, signal } = take(&mut self.next);
        self.add(PortSpec {
            name,
            data_type: Some((data_type, signal.unwrap_or(data_type.first()))),
            direction,
            stage: if is_late { Stage::Late } else { Stage::Early },
            is_delayed,
            misfit,
            takes_any_unit,
            tie: None,
        })
    }

    /// The handle says for now which port it is of.
    #[inline(never)]
    fn add(&mut self, spec: PortSpec) -> Block {
        let port = Block::of_port(self.count);
        self.count = self.count.saturating_add(1);
        let _ = self.specs.push(spec);
        port
    }
}
