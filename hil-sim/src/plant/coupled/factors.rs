//! Solves `M x = b` for the moving axes.
#![expect(clippy::indexing_slicing, reason = "matrices of a fixed size")]

use nalgebra::{Cholesky, Const, SVector};

use super::{AxisValues, Matrix};
use dimsart_core::limits::MAX_DOF;

/// Factorised mass matrix of the moving axes.
#[derive(Debug)]
pub(super) struct Factors {
    /// `None` if the matrix is not positive definite, such as with NaN.
    cholesky: Option<Cholesky<f64, Const<MAX_DOF>>>,
    is_held: [bool; MAX_DOF],
}

impl Factors {
    pub(super) fn of(mass: &Matrix, is_held: [bool; MAX_DOF]) -> Self {
        let mut free = *mass;
        for (axis, _) in is_held.iter().enumerate().filter(|(_, held)| **held) {
            free.row_mut(axis).fill(0.0);
            free.column_mut(axis).fill(0.0);
            free[(axis, axis)] = 1.0;
        }
        Self { cholesky: Cholesky::new(free), is_held }
    }

    /// Returns `x` of `M x = b`: 0 for held axes, NaN if the matrix is not positive definite.
    pub(super) fn solve(&self, right: &AxisValues) -> AxisValues {
        let Some(cholesky) = &self.cholesky else { return [f64::NAN; MAX_DOF] };
        let mut solution = SVector::from(*right);
        for (entry, _) in solution.iter_mut().zip(self.is_held).filter(|(_, held)| *held) {
            *entry = 0.0;
        }
        cholesky.solve_mut(&mut solution);
        solution.into()
    }

    /// `wᵀ M⁻¹ w`: mobility along `w`.
    pub(super) fn mobility(&self, direction: &AxisValues) -> f64 {
        super::dot(direction, &self.solve(direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::coupled::times;

    #[test]
    fn a_solution_solves_and_held_axes_are_left_out() {
        let rows = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.7], [-0.5, 0.7, 2.0]];
        let mut matrix = Matrix::zeros();
        for (row, values) in rows.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                matrix[(row, column)] = *value;
            }
        }
        let mut right = [0.0; MAX_DOF];
        right[..3].copy_from_slice(&[1.0, -2.0, 0.3]);
        for held in [3, 1] {
            let is_held = core::array::from_fn(|axis| axis >= 3 || axis == held);
            let solution = Factors::of(&matrix, is_held).solve(&right);
            let back = times(&matrix, &solution);
            for axis in 0..3 {
                let (actual, expected) =
                    if axis == held { (solution[axis], 0.0) } else { (back[axis], right[axis]) };
                assert!((actual - expected).abs() < 1e-15, "{axis}: {actual} instead of {expected}");
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_solution() {
        let solution = Factors::of(&Matrix::from_element(f64::NAN), [false; MAX_DOF]).solve(&[1.0; MAX_DOF]);
        assert!(solution.iter().all(|entry| entry.is_nan()));
    }
}
