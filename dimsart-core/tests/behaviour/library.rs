//! What no outside implementation shows of the library's modules: limits, take-over, parameters that change on the way.

mod filters;
mod joint_control;
mod robots;
