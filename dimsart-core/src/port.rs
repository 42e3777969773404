//! Ports: the signals a module reads and writes, declared when it is plugged in.

use heapless::Vec;

use crate::data_type::{DataType, TypeRef};
use crate::device::DeviceDescriptor;
use crate::handle::{Input, Memory, Output, Signal};
use crate::limits::MAX_PORTS;
use crate::matching::Difference;
use crate::storage::Block;
use crate::unit_tie::{UnitRelation, UnitTie};

/// What a port is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// Reads a signal.
    Read,
    /// Writes a signal.
    Write,
    /// Holds so many words of the module's own memory.
    Memory(usize),
}

/// When in the tick a port is used.
///
/// A module that sits on both sides of a controller, such as a wave transformer, has two stages: the
/// early one runs at its place in the plug-in order, the late one as soon as everything it reads has
/// been written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// In [`Module::compute`](crate::Module::compute).
    Early,
    /// In [`Module::compute_late`](crate::Module::compute_late).
    Late,
}

/// The sending or the receiving end of a link. Only one module can have it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkEnd {
    pub(crate) link: u8,
    pub(crate) channel: u16,
    is_sending: bool,
}

impl LinkEnd {
    /// Whether it is the same end of the same link, whatever the channel.
    pub(crate) fn is_same(self, other: Self) -> bool {
        (self.link, self.is_sending) == (other.link, other.is_sending)
    }

    /// Whether it is the receiving end of a link.
    pub(crate) fn listens_to(self, link: usize) -> bool {
        !self.is_sending && usize::from(self.link) == link
    }
}

/// A port as its module declares it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PortSpec {
    /// Name, unique in the module; `PORT_<name>` is the command that binds it to another type.
    pub name: &'static str,
    /// Type it is bound to unless a command says otherwise; none for memory.
    pub data_type: Option<(&'static DataType, TypeRef)>,
    /// Reads, writes or holds memory.
    pub direction: Direction,
    /// Stage that uses it.
    pub stage: Stage,
    /// Declares that data one tick old is what this port wants (read) or gives (write).
    pub is_delayed: bool,
    /// How the data type differs from what the module's handle can take; none if it fits.
    pub misfit: Option<Difference>,
    /// Whether it can be bound to a signal of another unit.
    pub takes_any_unit: bool,
    /// What its unit follows from, if that of another port.
    pub tie: Option<UnitTie>,
}

/// Takes a module's port declarations; see [`Module::activate`](crate::Module::activate).
///
/// The engine visits twice: first to learn what the module needs, then, when all of it could be
/// had, to hand out the handles.
#[derive(Debug)]
pub struct Ports<'a> {
    device: &'a DeviceDescriptor,
    visit: Visit<'a>,
    count: usize,
    link_end: Option<LinkEnd>,
}

/// Ports as a module declares them.
pub(crate) type PortSpecs = Vec<PortSpec, MAX_PORTS>;

#[derive(Debug)]
enum Visit<'a> {
    Declare(&'a mut PortSpecs),
    Connect(&'a [Block]),
}

impl<'a> Ports<'a> {
    /// A visit that only collects what is declared, into `specs`: they are large, and would be copied.
    pub(crate) fn declare(device: &'a DeviceDescriptor, specs: &'a mut PortSpecs) -> Self {
        Self { device, visit: Visit::Declare(specs), count: 0, link_end: None }
    }

    pub(crate) fn connect(device: &'a DeviceDescriptor, blocks: &'a [Block]) -> Self {
        Self { device, visit: Visit::Connect(blocks), count: 0, link_end: None }
    }

    /// The device the module is plugged in for.
    #[must_use]
    pub fn device(&self) -> &DeviceDescriptor {
        self.device
    }

    /// Whether no more was declared than [`MAX_PORTS`].
    pub(crate) fn has_all(&self) -> bool {
        self.count <= MAX_PORTS
    }

    /// Reads a signal.
    pub fn input<S: Signal>(
        &mut self,
        port: &mut Input<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Input::new(self.signal::<S>(name, data_type, Direction::Read, Stage::Early, false));
    }

    /// Writes a signal.
    pub fn output<S: Signal>(
        &mut self,
        port: &mut Output<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Output::new(self.signal::<S>(name, data_type, Direction::Write, Stage::Early, false));
    }

    /// Reads a signal of any unit, unless bound elsewhere of `data_type`: for a module that moves values
    /// and does not look at them. What it makes of them is [tied](Self::tie) to it.
    pub fn any_input<S: Signal>(
        &mut self,
        port: &mut Input<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        let spec = Self::spec::<S>(name, data_type, data_type.first(), Direction::Read, Stage::Early, false);
        *port = Input::new(self.add(PortSpec { takes_any_unit: true, ..spec }));
    }

    /// Writes a signal of any unit, unless bound elsewhere of `data_type`.
    pub fn any_output<S: Signal>(
        &mut self,
        port: &mut Output<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        let spec = Self::spec::<S>(name, data_type, data_type.first(), Direction::Write, Stage::Early, false);
        *port = Output::new(self.add(PortSpec { takes_any_unit: true, ..spec }));
    }

    /// Reads a signal as the last tick left it.
    pub fn delayed_input<S: Signal>(
        &mut self,
        port: &mut Input<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Input::new(self.signal::<S>(name, data_type, Direction::Read, Stage::Early, true));
    }

    /// Reads a signal in the late stage.
    pub fn late_input<S: Signal>(
        &mut self,
        port: &mut Input<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Input::new(self.signal::<S>(name, data_type, Direction::Read, Stage::Late, false));
    }

    /// Writes a signal in the late stage.
    pub fn late_output<S: Signal>(
        &mut self,
        port: &mut Output<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Output::new(self.signal::<S>(name, data_type, Direction::Write, Stage::Late, false));
    }

    /// Writes a signal in the late stage that readers are meant to see in the next tick.
    pub fn delayed_output<S: Signal>(
        &mut self,
        port: &mut Output<S>,
        name: &'static str,
        data_type: &'static DataType,
    ) {
        *port = Output::new(self.signal::<S>(name, data_type, Direction::Write, Stage::Late, true));
    }

    /// Reads a signal that a command named, such as the content of a comm channel. A number that no
    /// type has leaves the port unconnected.
    pub fn named_input<S: Signal>(&mut self, port: &mut Input<S>, name: &'static str, signal: TypeRef) {
        if let Some(data_type) = self.device.data_type(signal.id) {
            let spec = Self::spec::<S>(name, data_type, signal, Direction::Read, Stage::Early, false);
            *port = Input::new(self.add(spec));
        }
    }

    /// Writes a signal that a command named.
    pub fn named_output<S: Signal>(&mut self, port: &mut Output<S>, name: &'static str, signal: TypeRef) {
        if let Some(data_type) = self.device.data_type(signal.id) {
            let spec = Self::spec::<S>(name, data_type, signal, Direction::Write, Stage::Early, false);
            *port = Output::new(self.add(spec));
        }
    }

    /// Ties the unit of `port` to that of `other`, both declared before, `other` first: a sum has the unit
    /// of what is added. The matching check holds the signals they are bound to against it, and those of
    /// ports tied to `other` in the same way against each other. A name no port has ties nothing.
    pub fn tie(&mut self, port: &'static str, relation: UnitRelation, other: &'static str) {
        let Visit::Declare(specs) = &mut self.visit else { return };
        let place = |name| specs.iter().position(|spec: &PortSpec| spec.name == name);
        let (Some(place), Some(other)) = (place(port), place(other)) else { return };
        if let (Some(spec), Ok(port)) = (specs.get_mut(place), u8::try_from(other)) {
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

    fn take_link_end(&mut self, link: u32, channel: u32, is_sending: bool) {
        let numbers = u8::try_from(link).ok().zip(u16::try_from(channel).ok());
        self.link_end = numbers.map(|(link, channel)| LinkEnd { link, channel, is_sending });
    }

    pub(crate) fn link_end(&self) -> Option<LinkEnd> {
        self.link_end
    }

    /// Takes `words` words of memory of the module's own, all zero at first.
    pub fn memory(&mut self, memory: &mut Memory, name: &'static str, words: usize) {
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
        *memory = Memory { block };
    }

    fn signal<S: Signal>(
        &mut self,
        name: &'static str,
        data_type: &'static DataType,
        direction: Direction,
        stage: Stage,
        is_delayed: bool,
    ) -> Block {
        self.add(Self::spec::<S>(name, data_type, data_type.first(), direction, stage, is_delayed))
    }

    fn spec<S: Signal>(
        name: &'static str,
        data_type: &'static DataType,
        signal: TypeRef,
        direction: Direction,
        stage: Stage,
        is_delayed: bool,
    ) -> PortSpec {
        let misfit = if S::FORMAT != data_type.format {
            Some(Difference::Format)
        } else {
            (!S::takes(data_type.shape)).then_some(Difference::Shape)
        };
        let data_type = Some((data_type, signal));
        PortSpec { name, data_type, direction, stage, is_delayed, misfit, takes_any_unit: false, tie: None }
    }

    fn add(&mut self, spec: PortSpec) -> Block {
        let index = self.count;
        self.count += 1;
        match &mut self.visit {
            Visit::Connect(blocks) => blocks.get(index).copied().unwrap_or(Block::FREE),
            Visit::Declare(specs) => {
                let _ = specs.push(spec);
                Block::FREE
            }
        }
    }
}
