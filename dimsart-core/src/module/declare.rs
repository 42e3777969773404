//! How a module declares its ports and memory; see [`Module::ports`](crate::Module::ports).

use core::mem::take;

use crate::data_base::{Block, Input, Memory, Output, Signal};
use crate::device::DeviceDescriptor;
use crate::module::binding::ModuleBindings;
use crate::module::port::{Difference, Direction, LinkEnd, PortSpec, PortSpecs, Stage};
use crate::online::{Program, Programs};
use crate::signal::{DataType, TypeRef, UnitRelation, UnitTie};

/// Takes a module's declarations and gives the handles for them.
///
/// A port is used in the early stage, reads what was written before it in the tick, and fits signals of its type's
/// unit, unless [`late`](Self::late), [`delayed`](Self::delayed) or [`any_unit`](Self::any_unit) stands before it:
/// `declare.late().input("FORCE", types::FORCE)`.
#[derive(Debug)]
pub struct Declare<'a> {
    device: &'a DeviceDescriptor,
    programs: &'a Programs,
    specs: &'a mut PortSpecs,
    count: u8,
    bound: ModuleBindings<'a>,
    next: Next,
    link_end: Option<LinkEnd>,
    packet_words: usize,
    has_axis: bool,
    has_program: bool,
}

/// What was said of the port that is declared next.
#[derive(Debug, Default)]
struct Next {
    is_late: bool,
    is_delayed: bool,
    takes_any_unit: bool,
    takes_any_type: bool,
    signal: Option<TypeRef>,
}

impl<'a> Declare<'a> {
    /// Collects what is declared into `specs`: they are large, and would be copied. `bound` says to which signal a
    /// command has bound a port.
    pub(crate) fn new(
        device: &'a DeviceDescriptor,
        programs: &'a Programs,
        bound: ModuleBindings<'a>,
        specs: &'a mut PortSpecs,
    ) -> Self {
        Self {
            device,
            programs,
            specs,
            count: 0,
            bound,
            next: Next::default(),
            link_end: None,
            packet_words: 0,
            has_axis: true,
            has_program: true,
        }
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

    /// Data one tick old is what the next port wants (read) or gives (write). A module that reads so is plugged in before
    /// the one that writes, or the matching check refuses the scheme.
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

    /// The next port takes a signal of any unit, format and shape: for a module that passes words on. What it makes of
    /// them is [tied](Self::tie) to it. Its handle is [`Untyped`](crate::Untyped); one of another kind takes any unit
    /// only.
    pub fn any_type(&mut self) -> &mut Self {
        self.next.takes_any_type = true;
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
        // What was said of the next port is not of the one behind this.
        self.next = Next::default();
        let block = self.add(PortSpec {
            name,
            data_type: None,
            direction: Direction::Memory(words),
            stage: Stage::Early,
            is_delayed: false,
            mismatch: None,
            takes_any_unit: false,
            takes_any_type: false,
            tie: None,
        });
        Memory { block }
    }

    /// Words of the signal that a port is bound to, which was declared before; 0 for a name no port has.
    #[must_use]
    pub fn words_of(&self, port: &str) -> usize {
        let spec = self.specs.iter().find(|spec| spec.name == port);
        let Some((default, _)) = spec.and_then(|spec| spec.data_type) else { return 0 };
        let bound = self.bound.signal(port).and_then(|signal| self.device.data_type(signal.id));
        bound.unwrap_or(default).shape.words(self.device.dof())
    }

    /// Ties the unit of `port` to that of `other`, both declared before, `other` first: a sum has the unit
    /// of what is added. [`UnitRelation::Alike`] ties format and shape, too. The matching check holds the signals they
    /// are bound to against it, and those of ports tied to `other` in the same way against each other. A name no port
    /// has ties nothing.
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

    /// Says how many words the packets of the module have. With more than
    /// [`MAX_PACKET_WORDS`](crate::limits::MAX_PACKET_WORDS) it is not plugged in.
    pub fn packs(&mut self, words: usize) {
        self.packet_words = words;
    }

    /// Says whether the device has the axis that a parameter names. Without it the module is not plugged in.
    pub fn needs_axis(&mut self, is_there: bool) {
        self.has_axis = is_there;
    }

    /// The program of this number; none has number 0. Without another one the module is not plugged in.
    pub fn program(&mut self, number: u32) -> Option<Program<'a>> {
        let found = self.programs.get(number);
        self.has_program = number == 0 || found.is_some();
        found
    }

    pub(crate) fn has_program(&self) -> bool {
        self.has_program
    }

    pub(crate) fn has_axis(&self) -> bool {
        self.has_axis
    }

    pub(crate) fn packet_words(&self) -> usize {
        self.packet_words
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
        let mismatch = if S::FORMAT.is_some_and(|format| format != data_type.format) {
            Some(Difference::Format)
        } else {
            (!S::takes(data_type.shape)).then_some(Difference::Shape)
        };
        if S::FORMAT.is_some() && take(&mut self.next.takes_any_type) {
            self.next.takes_any_unit = true;
        }
        self.add_signal(name, data_type, direction, mismatch)
    }

    /// Not generic: a call and no more for each line of a module's declarations.
    #[inline(never)]
    fn add_signal(
        &mut self,
        name: &'static str,
        data_type: &'static DataType,
        direction: Direction,
        mismatch: Option<Difference>,
    ) -> Block {
        let Next { is_late, is_delayed, takes_any_unit, takes_any_type, signal } = take(&mut self.next);
        self.add(PortSpec {
            name,
            data_type: Some((data_type, signal.unwrap_or(data_type.first()))),
            direction,
            stage: if is_late { Stage::Late } else { Stage::Early },
            is_delayed,
            mismatch,
            takes_any_unit,
            takes_any_type,
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
