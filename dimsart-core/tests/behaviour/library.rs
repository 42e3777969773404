//! What no outside implementation shows of the library's modules: limits, take-over, parameters that change on the way.

mod energy;
mod filters;
mod joint_control;
mod limits;
mod logic;
mod robots;
mod trajectories;
