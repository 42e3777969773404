//! Obstacle that a press meets.

use crate::rig_file::{AxisSection, AxisSpring, AxisWall, WallSide};

/// Obstacle of an axis: a spring-damper behind a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    /// Position of the surface, `m`.
    pub surface_m: f64,
    /// `N/m`, > 0.
    pub stiffness_n_per_m: f64,
    /// `N s/m`.
    pub damping_n_s_per_m: f64,
}

impl Obstacle {
    /// Returns the obstacle of an axis in the direction of a force; `None` without stiffness.
    pub(super) fn of(section: &AxisSection, force_n: f64) -> Option<Self> {
        if let Some(AxisSpring { rest_position, stiffness, damping }) = section.active_spring().cloned() {
            let obstacle =
                Self { surface_m: rest_position, stiffness_n_per_m: stiffness, damping_n_s_per_m: damping };
            return (stiffness > 0.0).then_some(obstacle);
        }
        let wall = section.active_wall()?;
        let is_in_the_way = match wall.solid {
            WallSide::Above => force_n >= 0.0,
            WallSide::Below => force_n < 0.0,
        };
        let AxisWall { position, damping, .. } = *wall;
        let obstacle =
            Self { surface_m: position, stiffness_n_per_m: wall.stiffness(), damping_n_s_per_m: damping };
        is_in_the_way.then_some(obstacle)
    }
}
