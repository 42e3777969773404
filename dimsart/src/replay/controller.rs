//! A replayed controller.

use std::collections::VecDeque;

use dimsart_core::{Command, ModuleKinds, Word};
use dimsart_link::protocol::{Request, decode_request};

use super::device::DeviceDescription;
use super::divergence::Divergence;
use super::layout::Layout;
use super::{ReplayError, ReplayOutcome};
use crate::report::{InputsMessage, PacketMessage};
use dimsart_core::limits::MAX_LINKS;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::{SchemeText, load_for};

/// A controller from its start, with the inputs of its next ticks.
pub(super) struct ReplayedController {
    dimsart: Box<SimulatedDimsart>,
    /// Inputs of ticks that are not yet replayed.
    waiting: VecDeque<InputsMessage>,
    measured: Vec<Word>,
    commanded: Vec<Word>,
    row: Vec<f64>,
    message: Vec<u8>,
    replayed: ReplayOutcome,
}

impl ReplayedController {
    pub(super) fn new(
        name: &str,
        device_json: Option<&String>,
        scheme: Option<&String>,
        kinds: ModuleKinds,
    ) -> Result<Self, ReplayError> {
        let controller = || name.to_owned();
        let lacking = |what| ReplayError::MissingData { controller: controller(), what };
        let json = device_json.ok_or_else(|| lacking("the device"))?;
        let text = scheme.ok_or_else(|| lacking("the scheme"))?.clone();
        let facts: DeviceDescription = serde_json::from_str(json)
            .map_err(|source| ReplayError::Device { controller: controller(), source })?;
        let device = facts
            .descriptor()
            .map_err(|error| ReplayError::Descriptor { controller: controller(), error })?;
        let dimsart = SimulatedDimsart::new(device, kinds);
        let dimsart = dimsart.map_err(|error| ReplayError::Storage { controller: controller(), error })?;
        let mut dimsart = Box::new(dimsart);
        let scheme = SchemeText { name: format!("{name}.scheme"), text };
        let loaded = load_for(&scheme, name, &[name], &[], &mut dimsart);
        if !loaded.is_valid() {
            let problems = loaded.problems().collect::<Vec<_>>().join("\n  ");
            return Err(ReplayError::Scheme { controller: controller(), problems });
        }
        let commanded = vec![Word(0); dimsart.frame().input_words()];
        let replayed = ReplayOutcome {
            name: controller(),
            ticks: 0,
            commands: 0,
            words: 0,
            differing_rows: 0,
            divergence: None,
        };
        let (waiting, measured) = (VecDeque::new(), Vec::new());
        Ok(Self { dimsart, waiting, measured, commanded, row: Vec::new(), message: Vec::new(), replayed })
    }

    /// Adds the inputs of a tick.
    pub(super) fn expect(&mut self, inputs: InputsMessage) {
        self.waiting.push_back(inputs);
    }

    /// Runs all ticks up to this one, and compares the Data Base with the recording.
    pub(super) fn compare(
        &mut self,
        tick: u64,
        time_s: f64,
        recorded: &[u8],
        layout: &Layout,
    ) -> Result<(), ReplayError> {
        self.run(tick)?;
        layout.fill(&self.dimsart, recorded, &mut self.row, &mut self.message);
        self.replayed.words += layout.words() as u64;
        if self.message != recorded {
            self.replayed.differing_rows += 1;
            if self.replayed.divergence.is_none() {
                let others = layout.others(recorded, &self.row);
                let tick = self.replayed.ticks.saturating_sub(1);
                self.replayed.divergence = Divergence::first(&self.dimsart, tick, time_s, others);
            }
        }
        Ok(())
    }

    /// Runs the remaining ticks, for which no signals are recorded.
    pub(super) fn finish(mut self) -> Result<ReplayOutcome, ReplayError> {
        self.run(u64::MAX)?;
        Ok(self.replayed)
    }

    fn run(&mut self, until: u64) -> Result<(), ReplayError> {
        while self.waiting.front().is_some_and(|inputs| inputs.tick <= until) {
            let Some(inputs) = self.waiting.pop_front() else { break };
            self.tick(&inputs)?;
        }
        Ok(())
    }

    fn tick(&mut self, inputs: &InputsMessage) -> Result<(), ReplayError> {
        for command in &inputs.commands {
            self.command(&command.request).map_err(|reason| ReplayError::Command {
                controller: self.replayed.name.clone(),
                time_s: inputs.time_s,
                reason,
            })?;
            self.replayed.commands += 1;
        }
        self.dimsart.set_motion_allowed(inputs.is_motion_allowed);
        for PacketMessage { link, bytes } in &inputs.packets {
            // A refused command was refused in the recording, too.
            let _ = self.dimsart.receive(usize::from(*link), bytes);
        }
        self.measured.clear();
        self.measured.extend(inputs.measured.iter().copied().map(Word));
        self.dimsart.tick(&self.measured, &mut self.commanded);
        (0..MAX_LINKS).for_each(|link| drop(self.dimsart.take_outgoing(link)));
        self.replayed.ticks += 1;
        Ok(())
    }

    fn command(&mut self, request: &[u8]) -> Result<(), String> {
        let command: Command = match decode_request(request) {
            Ok((_, Request::Command(command))) => command,
            _ => return Err("unknown command".to_owned()),
        };
        self.dimsart.command(command).map_err(|error| error.to_string())
    }
}
