//! The lines of a page to a controller.

use crate::connect::{ConnectError, Device};
use hil_sim::link::Stream;

/// A controller at the other end of a line, of whatever kind.
pub(super) type PageDevice = Device<Box<dyn Stream>>;

/// Makes a line to the controller.
pub type OpenLine = Box<dyn Fn() -> Result<Box<dyn Stream>, ConnectError> + Send + Sync>;

/// Holds a reference of a simulated device: its name, the axis, and where; or lets it go.
pub type Hand = Box<dyn Fn(String, usize, Option<f32>) -> Result<(), String> + Send>;
