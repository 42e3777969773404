//! Controller: engine, frame and safety stage, and the order of a tick.

use crate::data_base::{Frame, StorageError};
use crate::device::DeviceDescriptor;
use crate::engine::ModuleKinds;
use crate::engine::{Engine, Observer};
use crate::memory::ProvidedMemory;
use crate::packet::mailbox::is_newer;
use crate::packet::{LinkPort, LinkTimeout, Packet, PacketError};
use crate::safety::{DriveFault, Safety, SafetyReason, TickResult};
use crate::scheme::{Command, CommandError};
use crate::signal::{TypeRef, Word};

/// A complete controller for one device.
///
/// The caller provides its [memory](crate::ControllerMemory), which sets its capacity.
#[derive(Debug)]
pub struct Dimsart {
    frame: Frame,
    safety: Safety,
    are_commands_late: bool,
    drive_fault: Option<DriveFault>,
    first_packet: FirstPacket,
    engine: Engine,
}

/// State of the wait for a link's first packet. The device does not move before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FirstPacket {
    /// Every link has received its first packet, or needs none.
    NotRequired,
    Awaited {
        link: u8,
    },
    /// Received in the last tick: modules begin in the next tick.
    Received {
        link: u8,
    },
}

impl Dimsart {
    /// Creates a controller in this memory for a device and the available module kinds. The device's types
    /// are in the Data Base, no module is plugged in.
    ///
    /// # Errors
    /// [`StorageError`] when the device's types do not fit into the Data Base.
    pub fn new(
        memory: impl Into<ProvidedMemory>,
        device: DeviceDescriptor,
        kinds: ModuleKinds,
    ) -> Result<Self, StorageError> {
        let mut dimsart = Self::without_device(memory);
        dimsart.connect(device, kinds)?;
        Ok(dimsart)
    }

    /// Creates a controller without a device; its ticks are [`TickResult::Idle`].
    #[must_use]
    #[inline]
    pub fn without_device(memory: impl Into<ProvidedMemory>) -> Self {
        Self {
            frame: Frame::unconnected(),
            safety: Safety::new(),
            are_commands_late: false,
            drive_fault: None,
            first_packet: FirstPacket::NotRequired,
            engine: Engine::unconnected(memory.into()),
        }
    }

    /// Closes the controller and returns its memory.
    #[must_use]
    pub fn release(self) -> ProvidedMemory {
        self.engine.release()
    }

    /// Restarts for a device and the available module kinds. The device's types are in the Data Base, no
    /// module is plugged in.
    ///
    /// # Errors
    /// [`StorageError`] when the device's types do not fit into the Data Base; the controller is then
    /// [unconnected](Self::without_device).
    pub fn connect(&mut self, device: DeviceDescriptor, kinds: ModuleKinds) -> Result<(), StorageError> {
        self.first_packet = FirstPacket::NotRequired;
        self.safety.connect(&device);
        self.engine.connect(device, kinds);
        let (device, data_base) = self.engine.device_and_data_base();
        let connected = self.frame.connect(data_base, device);
        connected.inspect_err(|_| self.engine.disconnect())
    }

    /// Allows motion from the next tick on, or forbids it, so that the device gets its safe value. It is
    /// allowed at first.
    ///
    /// When motion is allowed again, modules reset to their initial state and start at the device's current
    /// position, except those with [`KEEPS_STATE_ON_ARMING`](crate::Module::KEEPS_STATE_ON_ARMING), such as links and
    /// recorders. Call it before each tick: after a link's first packet, motion starts with the next call.
    pub fn set_motion_allowed(&mut self, is_allowed: bool) {
        let has_joined = matches!(self.first_packet, FirstPacket::Received { .. });
        if has_joined {
            self.first_packet = FirstPacket::NotRequired;
        }
        if is_allowed && (has_joined || self.safety.forbids_motion()) {
            self.engine.begin_motion();
        }
        self.safety.set_motion_allowed(is_allowed);
    }

    /// Sets whether external commands are too old, from the next tick on: the device then gets its safe
    /// value, until a reset if it was commanded before. For a watchdog such as a
    /// [`Coupling`](crate::Coupling).
    pub fn set_commands_stale(&mut self, are_commands_late: bool) {
        self.are_commands_late = are_commands_late;
    }

    /// Sets the fault of the device's drive, if any, from the next tick on: the device then gets its safe
    /// value, until a reset if it was commanded before.
    pub fn set_drive_fault(&mut self, fault: Option<DriveFault>) {
        self.drive_fault = fault;
    }

    /// Runs one tick: device to Data Base, every module, Data Base through the [safety stage](Safety) to the
    /// device.
    ///
    /// Firmware and simulator both call it; the order is defined only here. `measured` and `commanded` contain the
    /// words of the descriptor's types, in order. Afterwards `commanded` always contains finite numbers.
    pub fn tick(&mut self, measured: &[Word], commanded: &mut [Word]) -> TickResult {
        self.tick_observed(measured, commanded, &mut ())
    }

    /// As [`tick`](Self::tick), with an observer that makes each call of a module.
    #[inline]
    pub fn tick_observed(
        &mut self,
        measured: &[Word],
        commanded: &mut [Word],
        observer: &mut impl Observer,
    ) -> TickResult {
        let computed = self.compute(measured, observer);
        let is_refused = matches!(computed, Err(TickResult::MeasurementRefused(_)));
        let fault = self.drive_fault;
        let tick = self.safety.decide(computed, fault, &self.engine, &self.frame, measured, commanded);
        if is_refused && !self.safety.state().is_fault() {
            // Without motion, the device may be moved by hand or switched on late.
            self.frame.begin_anew();
        }
        tick
    }

    /// Measures and runs the modules. An error is the reason why they do not command the device.
    #[inline]
    fn compute(&mut self, measured: &[Word], observer: &mut impl Observer) -> Result<(), TickResult> {
        if let Err(error) = self.frame.write(self.engine.data_base_mut(), measured) {
            self.engine.data_base().links().iter().for_each(LinkPort::miss_tick);
            return Err(TickResult::MeasurementRefused(error));
        }
        if !self.engine.is_running() {
            return Err(TickResult::Idle);
        }
        let is_limited = self.safety.reason() != SafetyReason::None;
        if is_limited {
            self.show_given();
        }
        self.engine.data_base_mut().set_limited(is_limited);
        self.engine.step_observed(observer);
        // Read in every tick, because it is valid only for this tick.
        let silent_link = self.silent_link();
        if let Some((link, LinkTimeout::Lost)) = silent_link {
            return Err(TickResult::LinkLost { link });
        }
        // The drive fault may be the cause of a module's fault.
        if let Some(fault) = self.drive_fault {
            return Err(TickResult::DriveFailed(fault));
        }
        if let Some(module) = self.engine.lost_device() {
            return Err(TickResult::ModuleFailed(module));
        }
        if self.are_commands_late {
            return Err(TickResult::CommandsLate);
        }
        match (silent_link, self.first_packet) {
            (None, FirstPacket::NotRequired) => Ok(()),
            (None, FirstPacket::Awaited { link } | FirstPacket::Received { link }) => {
                Err(self.wait(link, FirstPacket::Received { link }))
            }
            (Some((link, _)), _) => Err(self.wait(link, FirstPacket::Awaited { link })),
        }
    }

    /// Handles a tick before or with a link's first packet.
    #[cold]
    fn wait(&mut self, link: u8, first_packet: FirstPacket) -> TickResult {
        self.first_packet = first_packet;
        TickResult::LinkDown { link }
    }

    /// Returns a link that its receiving module has reported as lost or down in this tick.
    fn silent_link(&self) -> Option<(u8, LinkTimeout)> {
        let links = self.engine.data_base().links();
        let link = links.iter().position(|port| port.timeout.get() != LinkTimeout::None)?;
        let silence = links.get(link)?.timeout.get();
        links.iter().for_each(|port| port.timeout.set(LinkTimeout::None));
        u8::try_from(link).ok().map(|link| (link, silence))
    }

    /// Executes a command, between two ticks. [`Command::Reset`] also ends a
    /// [fault](crate::DriveState::Fault).
    ///
    /// # Errors
    /// As [`Engine::command`]; also [`CommandError::StillStopping`] for a reset while the device is moving to
    /// its safe value.
    pub fn command(&mut self, command: Command) -> Result<(), CommandError> {
        if matches!(command, Command::Reset) {
            if self.safety.reacts_to_fault() {
                return Err(CommandError::StillStopping);
            }
            self.safety.reset();
            self.frame.begin_anew();
            // A reset initialises all modules.
            self.first_packet = FirstPacket::NotRequired;
        }
        self.engine.command(command)?;
        if self.engine.is_taking_over() {
            self.show_given();
        }
        Ok(())
    }

    /// Writes the values the device got into the Data Base, so that modules take over from them and
    /// integrators track them.
    #[cold]
    #[inline(never)]
    fn show_given(&mut self) {
        self.frame.show(self.engine.data_base_mut(), self.safety.given());
    }

    /// Returns the channel that a module receives on a link, 0 to 2047; 0 without a receiver.
    #[must_use]
    pub fn receive_channel(&self, link: usize) -> u16 {
        self.engine.receive_channel(link)
    }

    /// Stores bytes received over link `link` for the next tick.
    ///
    /// Of several packets between two ticks the newest is kept.
    ///
    /// # Errors
    /// [`PacketError`] when the bytes are not a packet of the [channel](Self::receive_channel); a packet
    /// that was stored before is kept.
    pub fn receive(&mut self, link: usize, bytes: &[u8]) -> Result<(), PacketError> {
        self.receive_parsed(link, &Packet::from_bytes(bytes, self.receive_channel(link)))
    }

    /// As [`receive`](Self::receive), for a caller that has already parsed the packet.
    ///
    /// # Errors
    /// The given [`PacketError`], which is counted; or [`PacketError::NoLink`].
    pub fn receive_parsed(
        &mut self,
        link: usize,
        packet: &Result<Packet, PacketError>,
    ) -> Result<(), PacketError> {
        let port = self.engine.data_base().links().get(link).ok_or(PacketError::NoLink)?;
        let count = || port.superseded.set(port.superseded.get().wrapping_add(1));
        let packet = packet.as_ref().map_err(|error| *error).inspect_err(|_| {
            count();
            port.has_refused.set(true);
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

    /// Overwrites the words of a signal, for a copy of a remote controller that is only displayed.
    pub fn overwrite(&mut self, slot: u8, words: impl IntoIterator<Item = u32>) {
        self.engine.data_base_mut().overwrite(slot, words);
    }

    /// Returns the words of these signals after the last tick, concatenated. A signal that is not in the Data
    /// Base yields NaN for each word of its type.
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

    /// Takes the packet that the last tick has produced for link `link`, if any.
    #[must_use]
    pub fn take_outgoing(&mut self, link: usize) -> Option<Packet> {
        self.engine.data_base().links().get(link)?.outgoing.take()
    }

    /// Returns the number of ticks with a refused frame since the device was connected.
    #[must_use]
    pub fn refused_ticks(&self) -> u32 {
        self.safety.refused_ticks()
    }

    /// Returns the safety stage: why and how often the device does not get the scheme's commands.
    #[must_use]
    pub fn safety(&self) -> &Safety {
        &self.safety
    }

    /// Returns the engine, for reading.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Returns the engine mutably, for queries that need it, such as a parameter's value.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// Returns the frame: number of words in and out.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }
}
