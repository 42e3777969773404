//! Device descriptor, limits of inputs and outputs, and tick timing.

pub(crate) mod counter;
pub(crate) mod descriptor;
pub(crate) mod input_limits;
pub(crate) mod output_limits;
pub(crate) mod plausibility;
pub(crate) mod timing;

pub(crate) use counter::Counter;
pub(crate) use descriptor::{DeviceDescriptor, LimitedWord, Served};
pub(crate) use input_limits::SafeValue;
pub(crate) use plausibility::Plausibility;
