//! Symmetric matrices, a row and a column per axis, and the solution of `M x = b`.

use super::Axes;
use dimsart_core::limits::MAX_DOF;

/// A square matrix; rows and columns past the last axis are 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Matrix([Axes; MAX_DOF]);

impl Matrix {
    /// The entry at `row` and `column`; 0 outside.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.0.get(row).and_then(|row| row.get(column)).copied().unwrap_or_default()
    }

    /// Adds to one entry.
    pub(in crate::plant) fn add(&mut self, row: usize, column: usize, value: f64) {
        if let Some(entry) = self.0.get_mut(row).and_then(|row| row.get_mut(column)) {
            *entry += value;
        }
    }

    /// The product with a vector.
    pub(super) fn times(&self, vector: &Axes) -> Axes {
        let mut product = [0.0; MAX_DOF];
        for (value, row) in product.iter_mut().zip(&self.0) {
            *value = super::dot(row, vector);
        }
        product
    }
}

/// `M = L D Lᵀ`, without the rows and columns of the axes that are held.
#[derive(Debug)]
pub(super) struct Factors {
    /// `L`: 1 on its diagonal, which is not stored.
    lower: Matrix,
    /// `D`.
    pivots: Axes,
    is_held: [bool; MAX_DOF],
}

impl Factors {
    /// Of a matrix that is positive definite.
    pub(super) fn of(matrix: &Matrix, is_held: [bool; MAX_DOF]) -> Self {
        let mut factors = Self { lower: Matrix::default(), pivots: [1.0; MAX_DOF], is_held };
        for row in factors.free() {
            for column in factors.free().take_while(|&column| column <= row) {
                let known: f64 = (factors.lower.row(row).iter())
                    .zip(factors.lower.row(column))
                    .zip(&factors.pivots)
                    .take(column)
                    .map(|((one, other), pivot)| one * other * pivot)
                    .sum();
                let rest = matrix.at(row, column) - known;
                let pivot = factors.pivots.get_mut(column);
                match pivot {
                    Some(pivot) if row == column => *pivot = rest,
                    Some(pivot) => {
                        let entry = rest / *pivot;
                        factors.lower.add(row, column, entry);
                    }
                    None => {}
                }
            }
        }
        factors
    }

    /// The `x` of `M x = b`; 0 for axes that are held.
    pub(super) fn solve(&self, right: &Axes) -> Axes {
        let mut solution = [0.0; MAX_DOF];
        for row in self.free() {
            let known = super::dot(self.lower.row(row), &solution);
            put(&mut solution, row, right.get(row).copied().unwrap_or_default() - known);
        }
        for (entry, pivot) in solution.iter_mut().zip(&self.pivots) {
            *entry /= pivot;
        }
        for column in self.free().rev() {
            let solved = solution.get(column).copied().unwrap_or_default();
            for (entry, factor) in solution.iter_mut().zip(self.lower.row(column)).take(column) {
                *entry -= factor * solved;
            }
        }
        solution
    }

    /// `wᵀ M⁻¹ w`: how readily `w` moves.
    pub(super) fn mobility(&self, direction: &Axes) -> f64 {
        super::dot(direction, &self.solve(direction))
    }

    fn free(&self) -> impl DoubleEndedIterator<Item = usize> + use<> {
        let is_held = self.is_held;
        (0..MAX_DOF).filter(move |&axis| !is_held.get(axis).copied().unwrap_or(true))
    }
}

impl Matrix {
    fn row(&self, row: usize) -> &Axes {
        self.0.get(row).unwrap_or(&[0.0; MAX_DOF])
    }
}

fn put(values: &mut Axes, axis: usize, value: f64) {
    if let Some(entry) = values.get_mut(axis) {
        *entry = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_solves_and_held_axes_are_left_out() {
        let rows = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.7], [-0.5, 0.7, 2.0]];
        let mut matrix = Matrix::default();
        for (row, values) in rows.iter().enumerate() {
            for (column, value) in values.iter().enumerate() {
                matrix.add(row, column, *value);
            }
        }
        let mut right = [0.0; MAX_DOF];
        right[..3].copy_from_slice(&[1.0, -2.0, 0.3]);
        for held in [3, 1] {
            let is_held = core::array::from_fn(|axis| axis >= 3 || axis == held);
            let solution = Factors::of(&matrix, is_held).solve(&right);
            let back = matrix.times(&solution);
            for axis in 0..3 {
                let (seen, wanted) =
                    if axis == held { (solution[axis], 0.0) } else { (back[axis], right[axis]) };
                assert!((seen - wanted).abs() < 1e-15, "{axis}: {seen} instead of {wanted}");
            }
        }
    }
}
