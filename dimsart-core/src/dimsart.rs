//! One controller: engine, frame and safety stage, and the order of a tick.

use crate::data_base::{Frame, StorageError};
use crate::device::DeviceDescriptor;
use crate::engine::Kinds;
use crate::engine::{Engine, Observer};
use crate::memory::ProvidedMemory;
use crate::packet::mailbox::is_newer;
use crate::packet::{LinkPort, Packet, PacketError, Silence};
use crate::safety::{DriveFault, Reason, Safety, Tick};
use crate::scheme::{Command, CommandError};
use crate::signal::{TypeRef, Word};

/// A whole DIMSART, for one device.
///
/// Its creator provides its [memory](crate::ControllerMemory), and so chooses what it has room for.
#[derive(Debug)]
pub struct Dimsart {
    frame: Frame,
    safety: Safety,
    are_commands_late: bool,
    drive_fault: Option<DriveFault>,
    first_packet: FirstPacket,
    engine: Engine,
}

/// The first packet of a link. The device does not move before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FirstPacket {
    /// Every link has had its own, or none is needed.
    Unneeded,
    Awaited {
        link: u8,
    },
    /// It came in the last tick: modules begin with the next.
    Came {
        link: u8,
    },
}

impl Dimsart {
    /// A controller in this memory, for a device and the kinds of modules that it can have, with the device's types in the Data Base and no module
    /// plugged in.
    ///
    /// # Errors
    /// [`StorageError`] when the device's types do not fit into the Data Base.
    pub fn new(
        memory: impl Into<ProvidedMemory>,
        device: DeviceDescriptor,
        kinds: Kinds,
    ) -> Result<Self, StorageError> {
        let mut dimsart = Self::unconnected(memory);
        dimsart.connect(device, kinds)?;
        Ok(dimsart)
    }

    /// A controller in this memory that has no device yet; its ticks are [`Tick::Idle`].
    #[must_use]
    #[inline]
    pub fn unconnected(memory: impl Into<ProvidedMemory>) -> Self {
        Self {
            frame: Frame::unconnected(),
            safety: Safety::new(),
            are_commands_late: false,
            drive_fault: None,
            first_packet: FirstPacket::Unneeded,
            engine: Engine::unconnected(memory.into()),
        }
    }

    /// Ends it and gives its memory back, for another one.
    #[must_use]
    pub fn release(self) -> ProvidedMemory {
        self.engine.release()
    }

    /// Restarts for a device and the kinds of modules that it can have, with the device's types in the Data Base and no module
    /// plugged in.
    ///
    /// # Errors
    /// [`StorageError`] when the device's types do not fit into the Data Base; the controller is
    /// [unconnected](Self::unconnected) then.
    pub fn connect(&mut self, device: DeviceDescriptor, kinds: Kinds) -> Result<(), StorageError> {
        self.first_packet = FirstPacket::Unneeded;
        self.safety.connect(&device);
        self.engine.connect(device, kinds);
        let (device, data_base) = self.engine.device_and_data_base();
        let connected = self.frame.connect(data_base, device);
        connected.inspect_err(|_| self.engine.disconnect())
    }

    /// Allows motion from the next tick on, or forbids it: the device gets its safe value then. It is allowed at first.
    ///
    /// When it is allowed, modules begin as after a start, from where the device is: what they made up while nothing
    /// moved is forgotten. What comes over links and what is recorded [goes on](crate::Module::OUTLASTS_ARMING). To be called
    /// before each tick: after a link's first packet motion starts with the next call.
    pub fn allow_motion(&mut self, is_allowed: bool) {
        let has_joined = matches!(self.first_packet, FirstPacket::Came { .. });
        if has_joined {
            self.first_packet = FirstPacket::Unneeded;
        }
        if is_allowed && (has_joined || self.safety.forbids_motion()) {
            self.engine.begin_motion();
        }
        self.safety.allow_motion(is_allowed);
    }

    /// Says whether what the scheme is commanded by from outside is too old, from the next tick on: the device gets its
    /// safe value then, until a reset if it was moved before. For whoever has a watchdog, such as a
    /// [`Coupling`](crate::Coupling).
    pub fn hold_back(&mut self, are_commands_late: bool) {
        self.are_commands_late = are_commands_late;
    }

    /// Says why the bridge of the device's drive is off, if it has a drive and that is wrong, from the next tick on: the device
    /// gets its safe value then, until a reset if it was moved before.
    pub fn drive_fault(&mut self, fault: Option<DriveFault>) {
        self.drive_fault = fault;
    }

    /// One tick: device to Data Base, every module, Data Base to device by way of the [safety stage](Safety).
    ///
    /// This is the only place that knows the order; firmware and simulator both call it.
    /// `measured` and `commanded` are laid out as the descriptor's types say; whatever happens,
    /// `commanded` holds finite numbers afterwards.
    pub fn tick(&mut self, measured: &[Word], commanded: &mut [Word]) -> Tick {
        self.tick_observed(measured, commanded, &mut ())
    }

    /// As [`tick`](Self::tick), while an observer looks on: it makes each call of a module.
    #[inline]
    pub fn tick_observed(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        observer: &mut impl Observer,
    ) -> Tick {
        let computed = self.compute(measured, observer);
        let is_refused = matches!(computed, Err(Tick::MeasurementRefused(_)));
        let fault = self.drive_fault;
        let tick = self.safety.decide(computed, fault, &self.engine, &self.frame, measured, commanded);
        if is_refused && !self.safety.state().is_fault() {
            // Nothing moves: it may be moved by hand meanwhile, or be switched on late.
            self.frame.begin_anew();
        }
        tick
    }

    /// Measurement and modules. An error says why they command nothing.
    #[inline]
    fn compute(&mut self, measured: &[Word], observer: &mut impl Observer) -> Result<(), Tick> {
        if let Err(error) = self.frame.write(self.engine.data_base_mut(), measured) {
            self.engine.data_base().links().iter().for_each(LinkPort::miss_tick);
            return Err(Tick::MeasurementRefused(error));
        }
        if !self.engine.is_running() {
            return Err(Tick::Idle);
        }
        let is_limited = self.safety.reason() != Reason::None;
        if is_limited {
            self.show_given();
        }
        self.engine.data_base_mut().set_limited(is_limited);
        self.engine.step_observed(observer);
        // Asked in every tick: what a receiver says of this one is not to be told of a later one.
        let silent_link = self.silent_link();
        if let Some((link, Silence::Lost)) = silent_link {
            return Err(Tick::LinkLost { link });
        }
        // A module may fail because of it.
        if let Some(fault) = self.drive_fault {
            return Err(Tick::DriveFailed(fault));
        }
        if let Some(module) = self.engine.lost_device() {
            return Err(Tick::ModuleFailed(module));
        }
        if self.are_commands_late {
            return Err(Tick::CommandsLate);
        }
        match (silent_link, self.first_packet) {
            (None, FirstPacket::Unneeded) => Ok(()),
            (None, FirstPacket::Awaited { link } | FirstPacket::Came { link }) => {
                Err(self.wait(link, FirstPacket::Came { link }))
            }
            (Some((link, _)), _) => Err(self.wait(link, FirstPacket::Awaited { link })),
        }
    }

    /// A tick without a link's first packet, or the one that brings it.
    #[cold]
    fn wait(&mut self, link: u8, first_packet: FirstPacket) -> Tick {
        self.first_packet = first_packet;
        Tick::LinkDown { link }
    }

    /// A link that its receiving module has just called lost or down.
    fn silent_link(&self) -> Option<(u8, Silence)> {
        let links = self.engine.data_base().links();
        let link = links.iter().position(|port| port.silence.get() != Silence::None)?;
        let silence = links.get(link)?.silence.get();
        links.iter().for_each(|port| port.silence.set(Silence::None));
        u8::try_from(link).ok().map(|link| (link, silence))
    }

    /// Takes a command, between two ticks. [`Command::Reset`] ends a [fault](crate::DriveState::Fault), too.
    ///
    /// # Errors
    /// As [`Engine::command`]; and [`CommandError::FaultReaction`] for a reset while the device is on its way to its
    /// safe value.
    pub fn command(&mut self, command: Command) -> Result<(), CommandError> {
        if matches!(command, Command::Reset) {
            if self.safety.reacts_to_fault() {
                return Err(CommandError::FaultReaction);
            }
            self.safety.reset();
            self.frame.begin_anew();
            // It has modules begin.
            self.first_packet = FirstPacket::Unneeded;
        }
        self.engine.command(command)?;
        if self.engine.is_taking_over() {
            self.show_given();
        }
        Ok(())
    }

    /// Modules take over from what the device got, and integrals track it: it may be less than the scheme commanded.
    #[cold]
    #[inline(never)]
    fn show_given(&mut self) {
        self.frame.show(self.engine.data_base_mut(), self.safety.given());
    }

    /// The channel that is listened to on a link, 0 to 2047; 0 while nobody listens.
    #[must_use]
    pub fn listening_channel(&self, link: usize) -> u16 {
        self.engine.listening_channel(link)
    }

    /// Puts bytes that came in over link `link` where the next tick finds them.
    ///
    /// Of several packets between two ticks the newest is kept.
    ///
    /// # Errors
    /// [`PacketError`] when the bytes are no packet of the [channel](Self::listening_channel) that is listened to;
    /// what waits already stays.
    pub fn receive(&mut self, link: usize, bytes: &[u8]) -> Result<(), PacketError> {
        self.deliver(link, &Packet::from_bytes(bytes, self.listening_channel(link)))
    }

    /// As [`receive`](Self::receive), for a caller that has read the packet already, or tried to.
    ///
    /// # Errors
    /// The [`PacketError`] that is delivered, which is counted; or that there is no such link.
    pub fn deliver(&mut self, link: usize, packet: &Result<Packet, PacketError>) -> Result<(), PacketError> {
        let port = self.engine.data_base().links().get(link).ok_or(PacketError::NoLink)?;
        let count = || port.superseded.set(port.superseded.get().wrapping_add(1));
        let packet = packet.as_ref().map_err(|error| *error).inspect_err(|_| {
            count();
            port.is_damaged.set(true);
        })?;
        if port.received.is_full() {
            count();
            if !is_newer(packet.counter, port.received.counter()) {
                return Ok(());
            }
        }
        port.received.put(packet);
        Ok(())
    }

    /// Overwrites a signal, word by word as far as both go: for the copy of a controller that runs elsewhere
    /// and is looked at here.
    pub fn overwrite(&mut self, slot: u8, words: impl IntoIterator<Item = u32>) {
        self.engine.data_base_mut().overwrite(slot, words);
    }

    /// The words of these signals as the last tick left them, one behind the other. A signal that is not in the Data Base
    /// has as many words as its type has, not-a-number each.
    pub fn signals<'a>(&'a self, signals: &'a [TypeRef]) -> impl Iterator<Item = Word> + 'a {
        let (data_base, device) = (self.engine.data_base(), self.engine.device());
        signals.iter().flat_map(move |signal| {
            let slot = data_base.slot(*signal);
            let words = slot.map_or(&[][..], |slot| data_base.words(slot));
            let data_type = device.data_type(signal.id).filter(|_| slot.is_none());
            let lacking = data_type.map_or(0, |found| found.shape.words(device.dof()));
            let lacking = core::iter::repeat_n(f32::NAN.to_bits(), lacking);
            words.iter().copied().chain(lacking).map(Word)
        })
    }

    /// Takes the packet that the last tick left for link `link`, if any.
    #[must_use]
    pub fn outgoing(&mut self, link: usize) -> Option<Packet> {
        self.engine.data_base().links().get(link)?.outgoing.take()
    }

    /// Ticks in which a frame was refused, since the device was connected.
    #[must_use]
    pub fn refused_ticks(&self) -> u32 {
        self.safety.refused_ticks()
    }

    /// The safety stage: why the device does not get what the scheme commands, and how often.
    #[must_use]
    pub fn safety(&self) -> &Safety {
        &self.safety
    }

    /// The engine, to look at.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine, to ask for what needs a moment of its attention, such as a parameter's value.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The frame: how many words go in and out.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }
}
