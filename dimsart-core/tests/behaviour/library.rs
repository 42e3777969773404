//! Properties of the library's modules without an external reference: limits, take-over, changes of
//! parameters.

mod energy;
mod filters;
mod joint_control;
mod limits;
mod logic;
mod robots;
mod trajectories;
