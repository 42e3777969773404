//! Message of the inputs of a controller for one tick.

use serde::{Deserialize, Serialize};

use hil_sim::recording::TickInputs;
use hil_sim::rig::Inputs;

/// ROS 2 message definition.
pub(crate) const DEFINITION: &str = "\
uint64 tick # number of the tick
float64 time_s # its time
bool is_motion_allowed # whether the device may move in this tick
Command[] commands # carried out before it, in order
Packet[] packets # that came in over links before it, in order
uint32[] measured # words of the frame from the device, as in memory
================================================================================
MSG: dimsart/Command
uint8[] request # as it came over the command line, without its frame
================================================================================
MSG: dimsart/Packet
uint8 link
uint8[] bytes
";

/// Name of the schema.
pub(super) const SCHEMA: &str = "dimsart/msg/Inputs";

/// Topic suffix after the controller's topic.
pub(crate) const TOPIC: &str = "/inputs";

/// Encoded inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputsMessage {
    pub(crate) tick: u64,
    pub(crate) time_s: f64,
    pub(crate) is_motion_allowed: bool,
    pub(crate) commands: Vec<CommandMessage>,
    pub(crate) packets: Vec<PacketMessage>,
    pub(crate) measured: Vec<u32>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CommandMessage {
    pub(crate) request: Vec<u8>,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PacketMessage {
    pub(crate) link: u8,
    pub(crate) bytes: Vec<u8>,
}

impl From<TickInputs> for InputsMessage {
    fn from(TickInputs { tick, time_s, inputs, .. }: TickInputs) -> Self {
        let Inputs { commands, is_motion_allowed, packets, measured } = inputs;
        let packets = packets.into_iter().map(|(link, bytes)| PacketMessage {
            // A controller has fewer.
            link: u8::try_from(link).unwrap_or(u8::MAX),
            bytes,
        });
        Self {
            tick,
            time_s,
            is_motion_allowed,
            commands: commands.into_iter().map(|request| CommandMessage { request }).collect(),
            packets: packets.collect(),
            measured: measured.into_iter().map(|word| word.0).collect(),
        }
    }
}
