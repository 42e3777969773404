//! Declaration of a module's ports and memory; see [`Module::ports`](crate::Module::ports).

use core::mem::take;

use crate::data_base::{Block, Input, Memory, Output, Signal};
use crate::device::DeviceDescriptor;
use crate::module::binding::ModuleBindings;
use crate::module::port::{Direction, LinkEnd, PortSpec, PortSpecs, Stage, TypeMismatch};
use crate::online::{Program, Programs};
use crate::signal::{DataType, TypeRef, UnitConstraint, UnitRelation};

/// Collects a module's declarations and returns the handles.
///
/// By default a port is used in the early stage, reads values written before it in the tick, and accepts
/// signals of its type's unit. [`late`](Self::late), [`delayed`](Self::delayed) and
/// [`any_unit`](Self::any_unit) change this for the next port: `declare.late().input("FORCE", types::FORCE)`.
#[derive(Debug)]
pub struct Declarations<'a> {
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

/// Options of the port that is declared next.
#[derive(Debug, Default)]
struct Next {
    is_late: bool,
    is_delayed: bool,
    accepts_any_unit: bool,
    accepts_any_type: bool,
    signal: Option<TypeRef>,
}

impl<'a> Declarations<'a> {
    /// Creates a collector that writes into `specs`. `bound` has the signals that commands have bound to
    /// ports.
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

    /// Returns the device for which the module is plugged in.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        self.device
    }

    /// The next port is used in the late stage.
    pub fn late(&mut self) -> &mut Self {
        self.next.is_late = true;
        self
    }

    /// The next port reads or writes data that are one tick old. A module with such an input must be plugged
    /// in before the writer, or the matching check refuses the scheme.
    pub fn delayed(&mut self) -> &mut Self {
        self.next.is_delayed = true;
        self
    }

    /// The next port accepts a signal of any unit, for a module that copies values. [Tie](Self::constrain_unit) the
    /// outputs to it.
    pub fn any_unit(&mut self) -> &mut Self {
        self.next.accepts_any_unit = true;
        self
    }

    /// The next port accepts a signal of any unit, format and shape, for a module that copies words.
    /// [Tie](Self::constrain_unit) the outputs to it. Its handle is [`Untyped`](crate::Untyped); with another handle it
    /// accepts any unit only.
    pub fn any_type(&mut self) -> &mut Self {
        self.next.accepts_any_type = true;
        self
    }

    /// The next port has this default signal instead of the first of its type, for example the content of a
    /// comm channel.
    pub fn default_signal(&mut self, signal: TypeRef) -> &mut Self {
        self.next.signal = Some(signal);
        self
    }

    /// Declares an input.
    pub fn input<S: Signal>(&mut self, name: &'static str, data_type: &'static DataType) -> Input<S> {
        Input::new(self.signal::<S>(name, data_type, Direction::Read))
    }

    /// Declares an output.
    pub fn output<S: Signal>(&mut self, name: &'static str, data_type: &'static DataType) -> Output<S> {
        Output::new(self.signal::<S>(name, data_type, Direction::Write))
    }

    /// Declares `words` words of the module's own memory, all zero at first.
    pub fn memory(&mut self, name: &'static str, words: usize) -> Memory {
        // Options do not carry over to the port after this one.
        self.next = Next::default();
        let block = self.add(PortSpec {
            name,
            data_type: None,
            direction: Direction::Memory(words),
            stage: Stage::Early,
            is_delayed: false,
            mismatch: None,
            accepts_any_unit: false,
            accepts_any_type: false,
            unit_constraint: None,
        });
        Memory { block }
    }

    /// Returns the number of words of the signal bound to a declared port; 0 for an unknown name.
    #[must_use]
    pub fn signal_words(&self, port: &str) -> usize {
        let spec = self.specs.iter().find(|spec| spec.name == port);
        let Some((default, _)) = spec.and_then(|spec| spec.data_type) else { return 0 };
        let bound = self.bound.signal(port).and_then(|signal| self.device.data_type(signal.id));
        bound.unwrap_or(default).shape.words(self.device.dof())
    }

    /// Ties the unit of `port` to the unit of `other`, both declared before, `other` first: for example a sum to
    /// its terms. [`UnitRelation::SameType`] also ties format and shape. The matching check compares the signals of
    /// both ports, and the signals of ports with the same tie. An unknown name has no effect.
    pub fn constrain_unit(&mut self, port: &'static str, relation: UnitRelation, other: &'static str) {
        let place = |name| self.specs.iter().position(|spec: &PortSpec| spec.name == name);
        let (Some(place), Some(other)) = (place(port), place(other)) else { return };
        if let (Some(spec), Ok(port)) = (self.specs.get_mut(place), u8::try_from(other)) {
            spec.unit_constraint = Some(UnitConstraint { relation, port });
        }
    }

    /// Declares that the module sends over a link and channel. A second sender on the link is a fault.
    pub fn sends_on(&mut self, link: u32, channel: u32) {
        self.take_link_end(link, channel, true);
    }

    /// Declares that the module receives from a link and channel. A second receiver on the link is a fault.
    pub fn receives_from(&mut self, link: u32, channel: u32) {
        self.take_link_end(link, channel, false);
    }

    /// Declares the number of words of the module's packets. With more than
    /// [`MAX_PACKET_WORDS`](crate::limits::MAX_PACKET_WORDS) it is not plugged in.
    pub fn set_packet_words(&mut self, words: usize) {
        self.packet_words = words;
    }

    /// Declares whether the axis of a parameter exists. If not, the module is not plugged in.
    pub fn requires_axis(&mut self, is_there: bool) {
        self.has_axis = is_there;
    }

    /// Returns the program of this number; 0 means no program. If the program does not exist, the module is not
    /// plugged in.
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

    /// Returns whether all declarations fit into [`MAX_PORTS`](crate::limits::MAX_PORTS).
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
            Some(TypeMismatch::Format)
        } else {
            (!S::takes(data_type.shape)).then_some(TypeMismatch::Shape)
        };
        if S::FORMAT.is_some() && take(&mut self.next.accepts_any_type) {
            self.next.accepts_any_unit = true;
        }
        self.add_signal(name, data_type, direction, mismatch)
    }

    /// Not generic, so that each declaration compiles to one call.
    #[inline(never)]
    fn add_signal(
        &mut self,
        name: &'static str,
        data_type: &'static DataType,
        direction: Direction,
        mismatch: Option<TypeMismatch>,
    ) -> Block {
        let Next { is_late, is_delayed, accepts_any_unit, accepts_any_type, signal } = take(&mut self.next);
        self.add(PortSpec {
            name,
            data_type: Some((data_type, signal.unwrap_or(data_type.first()))),
            direction,
            stage: if is_late { Stage::Late } else { Stage::Early },
            is_delayed,
            mismatch,
            accepts_any_unit,
            accepts_any_type,
            unit_constraint: None,
        })
    }

    /// The handle stores the port number until it is wired.
    #[inline(never)]
    fn add(&mut self, spec: PortSpec) -> Block {
        let port = Block::of_port(self.count);
        self.count = self.count.saturating_add(1);
        let _ = self.specs.push(spec);
        port
    }
}
