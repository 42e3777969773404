//! Lines of a page to a controller.

use crate::connect::{ConnectError, Device};
use hil_sim::link::Stream;
use hil_sim::response::Held;

/// A controller at the other end of any line.
pub(super) type PageDevice = Device<Box<dyn Stream>>;

/// Opens a line to the controller.
pub type OpenLine = Box<dyn Fn() -> Result<Box<dyn Stream>, ConnectError> + Send + Sync>;

/// Holds, excites or releases a reference of a simulated device, given by signal and axis.
pub type ReferenceOverrideFn = Box<dyn Fn(String, usize, Held) -> Result<(), String> + Send>;
