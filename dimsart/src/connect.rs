//! A client of a controller at the other end of a serial port or socket.
//!
//! ```text
//! Port  opens the line   RequestLine  sends, retries, times out   Device  reads names, sends commands, reports
//! ```
//! Names, ranges, choices and units come from the device and are read on first use. Help texts and unit symbols come from
//! this program. The answer to each command contains the resulting state and the first reason why the device does not move.

mod capture;
mod command;
mod commands;
mod configuration;
mod data_types;
mod description;
mod device;
mod error;
mod events;
mod explain;
mod faults;
mod in_process;
mod key;
mod law;
mod lease;
mod line;
mod live;
mod measured;
mod motor;
mod presence;
mod recorder;
mod renewal;
mod scheme;
mod show;
mod signals;
mod stored_schemes;
mod streams;
mod tap;
mod transaction;
mod unsolicited;

pub use capture::{Capture, Captured};
pub(crate) use command::ALL_DESTINATIONS;
pub use command::CommandOutcome;
pub use configuration::ConfigurationReplacement;
pub use data_types::{DataTypeReport, SignalForm};
pub use description::{DisplayValue, Identity};
pub(crate) use description::{WordText, range_text};
pub use device::Device;
pub use error::ConnectError;
pub use events::{EventReport, Events};
pub use faults::{Check, Faults, FindingReport, FirstFaultReport, ReasonReport};
pub use in_process::InProcess;
pub use key::KeyReport;
pub use law::{LawReport, Laws, RemovedLaw};
pub use lease::LiveReport;
pub use line::{LineError, RequestLine, Timeouts};
pub use live::SignalPoll;
pub use measured::{CycleCounts, CycleStatistics};
pub use motor::MotorState;
pub use presence::Presence;
pub use recorder::{RecorderRow, RecorderRows};
pub use scheme::SendOutcome;
pub use show::{InstanceReport, ModuleKindReport, Overview, ParameterReport, PortReport, StatusReport};
pub use signals::SignalReport;
pub use stored_schemes::{StoredSchemesReport, TickTimingReport};
pub(crate) use tap::value_of;
pub use tap::{SubscribedSignal, Subscription, SubscriptionRow};
