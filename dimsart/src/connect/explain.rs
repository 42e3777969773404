//! States and refusals of a device as texts.

use std::io::{Read, Write};

use dimsart_core::{
    CommandError, DriveFault, Explanation, Finding, FrameError, ModuleFault, TickResult, Vocabulary,
};
use dimsart_link::protocol::NotCommandedReason;

use super::description::Description;
use super::{ConnectError, Device};

type Text = Result<String, ConnectError>;

impl<S: Read + Write> Device<S> {
    /// Whether the scheme commands the device, and if not, the first reason.
    pub(super) fn state_text(&mut self, blocked: Option<NotCommandedReason>) -> Text {
        Ok(match blocked {
            None => "the scheme runs and commands the device".to_owned(),
            Some(blocked) => format!("the device is NOT commanded: {}", self.blocked_text(blocked)?),
        })
    }

    pub(super) fn blocked_text(&mut self, blocked: NotCommandedReason) -> Text {
        Ok(match blocked {
            NotCommandedReason::Mismatch(finding) => self.finding_text(finding)?,
            NotCommandedReason::Tick(TickResult::Idle) => {
                "the scheme is stopped; run `check` to start it".to_owned()
            }
            NotCommandedReason::Tick(TickResult::MeasurementRefused(error)) => {
                format!("invalid measurement: {}", self.know(|known| frame_text(known, error))?)
            }
            NotCommandedReason::Tick(TickResult::CommandRefused(error)) => {
                format!("invalid command from the scheme: {}", self.know(|known| frame_text(known, error))?)
            }
            NotCommandedReason::Tick(TickResult::Disarmed) => {
                "the scheme runs and no client holds the lease; run `arm`".to_owned()
            }
            NotCommandedReason::Tick(TickResult::LinkLost { link } | TickResult::LinkDown { link }) => {
                format!("link {link}: {}", blocked.reason())
            }
            NotCommandedReason::Tick(TickResult::DriveFailed(DriveFault::NoResponse { axis })) => {
                format!("axis {axis}: {}", blocked.reason())
            }
            NotCommandedReason::Tick(TickResult::ModuleFailed(module)) => {
                let name = self.know(|known| known.module_name(module).to_string())?;
                format!("{name}: {}", blocked.reason())
            }
            _ => blocked.reason().to_string(),
        })
    }

    /// Explains why a module was isolated.
    pub(super) fn module_fault_text(&mut self, fault: ModuleFault) -> Text {
        self.know(|known| Explanation::for_module_fault(known, fault).to_string())
    }

    pub(super) fn finding_text(&mut self, finding: Finding) -> Text {
        self.know(|known| Explanation::for_finding(known, finding).to_string())
    }

    /// Explains why a command was refused.
    pub(super) fn refusal_text(&mut self, error: CommandError) -> Text {
        let hint =
            if let CommandError::HasFaults { .. } = error { "; run `faults` to list them" } else { "" };
        self.know(|known| format!("{}{hint}", Explanation::for_refusal(known, error)))
    }
}

fn frame_text(known: &Description, error: FrameError) -> String {
    match error {
        FrameError::NotFinite { signal, word } => format!(
            "word {word} of {} is NaN or infinite; use `watch` to find the module that writes it",
            known.signal_name(signal)
        ),
        FrameError::Implausible { signal, word, bits } => format!(
            "word {word} of {} is {}: outside the sensor's range, or too large a change in one tick; check the sensor \
             and its cable",
            known.signal_name(signal),
            f32::from_bits(bits)
        ),
        FrameError::Length { .. } => format!("{error}; correct the device descriptor of the image's board"),
    }
}
