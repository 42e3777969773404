#![allow(missing_docs, clippy::missing_errors_doc)]
//! Stand-in until the joint is there.
use super::parameter::{ParameterError, not_negative, positive};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct JointParameters {
    pub load: Load,
}
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Load {
    pub inertia: f64,
    pub damping: f64,
    pub start_position: f64,
}
impl JointParameters {
    pub fn check(&self) -> Result<(), ParameterError> {
        positive("inertia", self.load.inertia)?;
        not_negative("damping", self.load.damping)
    }
    pub fn build(&self) -> Result<Joint, ParameterError> {
        self.check()?;
        Ok(Joint {
            load: self.load.clone(),
            state: JointState { position: self.load.start_position, ..JointState::default() },
        })
    }
}
#[derive(Debug)]
pub struct Joint {
    load: Load,
    state: JointState,
}
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointState {
    pub position: f64,
    pub velocity: f64,
    pub motor_position: f64,
    pub motor_velocity: f64,
    pub force: f64,
    pub current_a: f64,
    pub voltage_v: f64,
    pub winding_c: f64,
}
impl Joint {
    pub fn advance(&mut self, start_s: f64, period_s: f64, command: f64, load: &dyn Fn(f64) -> f64) {
        let h = period_s / 100.0;
        for n in 0..100 {
            let f = command + load(start_s + f64::from(n) * h) - self.load.damping * self.state.velocity;
            let a = f / self.load.inertia;
            self.state.position += h * (self.state.velocity + 0.5 * h * a);
            self.state.velocity += h * a;
        }
        self.state.force = command;
        self.state.motor_position = self.state.position;
        self.state.motor_velocity = self.state.velocity;
    }
    pub fn state(&self) -> JointState {
        self.state
    }
}
