//! Least squares over the windows of an experiment, with confidence intervals.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::windows::{Windows, count};
use super::{Estimate, IdentifyError, Quantity};

/// Maximum variance inflation; above, columns are not separable.
const MAX_INFLATION: f64 = 1e3;
/// Maximum unexplained share of the force.
const MAX_UNEXPLAINED: f64 = 0.1;
/// Maximum noise share of a column.
const MAX_NOISE: f64 = 0.3;
/// Relative eigenvalue below which a combination of columns is unknown.
const UNKNOWN: f64 = 1e-9;
/// Maximum share of an unknown combination in a known quantity.
const MAX_SHARE: f64 = 1e-3;
/// Maximum counted correlation between the errors of consecutive windows.
const MAX_CORRELATION: f64 = 0.9;

/// The columns of all windows.
pub(super) struct Columns {
    matrix: DMatrix<f64>,
    /// Orthonormal basis of the columns.
    basis: DMatrix<f64>,
}

impl Columns {
    /// # Errors
    /// [`IdentifyError::NotExcited`].
    pub(super) fn of(windows: &Windows<'_>) -> Result<Self, IdentifyError> {
        let columns = windows.list.first().map_or(0, |window| window.columns.len());
        let values = windows.list.iter().flat_map(|window| window.columns.iter().copied());
        let matrix = DMatrix::from_row_iterator(windows.list.len(), columns, values);
        let mut scaled = matrix.clone();
        for mut column in scaled.column_iter_mut() {
            column /= column.norm().max(f64::MIN_POSITIVE);
        }
        let decomposed = scaled.svd(true, false);
        let smallest = decomposed.singular_values.max() * 1e-9;
        let basis = decomposed.u.ok_or(IdentifyError::NotExcited)?;
        let known = decomposed.singular_values.iter().enumerate().filter(|(_, value)| **value > smallest);
        let known: Vec<usize> = known.map(|(place, _)| place).collect();
        Ok(Self { matrix, basis: basis.select_columns(&known) })
    }

    /// Returns the residual sum of squares of these forces.
    pub(super) fn unexplained(&self, forces: &[f64]) -> f64 {
        let forces = DVector::from_column_slice(forces);
        (&forces - &self.basis * self.basis.tr_mul(&forces)).norm_squared()
    }
}

/// Returns an estimate of each quantity and the RMS unexplained share of the force. Delay, with the estimate `delay`,
/// is the last quantity; `slope` is the derivative of the forces by it.
///
/// Position noise lengthens a column and biases its estimate towards 0, so its expected square is subtracted (W. A.
/// Fuller, "Measurement Error Models", Wiley 1987, chapter 2).
///
/// # Errors
/// [`IdentifyError::NotExcited`], [`IdentifyError::Unexplained`].
pub(super) fn solve(
    quantities: &[Quantity],
    windows: &Windows<'_>,
    columns: &Columns,
    forces: &[f64],
    (delay, slope): (f64, &[f64]),
) -> Result<(Vec<Estimate>, f64), IdentifyError> {
    let rows = forces.len();
    let forces = DVector::from_column_slice(forces);
    let mut matrix = columns.matrix.clone();
    let lateness = quantities.len() - 1;
    matrix.set_column(lateness, &DVector::from_column_slice(slope));
    // Zero columns are detected below.
    let scales: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    for (mut column, scale) in matrix.column_iter_mut().zip(&scales) {
        column /= *scale;
    }
    let plain = matrix.tr_mul(&matrix);
    let noise: Vec<f64> =
        windows.noise.iter().zip(&scales).map(|(of, scale)| count(rows) * of / (scale * scale)).collect();
    let mut normal = plain.clone();
    for (place, noise) in noise.iter().enumerate() {
        if let Some(entry) = normal.get_mut((place, place)) {
            *entry -= noise.min(MAX_NOISE);
        }
    }
    let SymmetricEigen { eigenvectors, eigenvalues } = normal.symmetric_eigen();
    let smallest = UNKNOWN * eigenvalues.max();
    let inverse_of = |value: f64| if value > smallest { 1.0 / value } else { 0.0 };
    let inverse =
        &eigenvectors * DMatrix::from_diagonal(&eigenvalues.map(inverse_of)) * eigenvectors.transpose();
    let unknown = eigenvectors.column_iter().zip(&eigenvalues).filter(|(_, value)| **value <= smallest);
    let unknown: Vec<_> = unknown.map(|(combination, _)| combination).collect();
    let solution = &inverse * matrix.tr_mul(&forces);
    let residual = &forces - &matrix * &solution;
    let unexplained = residual.norm() / forces.norm().max(f64::MIN_POSITIVE);
    if unexplained > MAX_UNEXPLAINED {
        return Err(IdentifyError::Unexplained { unexplained });
    }
    // Errors correlated between consecutive windows average out less.
    let product = |(one, other): (usize, usize)| Some(residual.get(one)? * residual.get(other)?);
    let together: f64 = windows.neighbours().filter_map(product).sum();
    let correlation = (together / residual.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, MAX_CORRELATION);
    let variance = residual.norm_squared() / count(rows - scales.len());
    let variance = variance * (1.0 + correlation) / (1.0 - correlation);
    let spread = &inverse * &plain * &inverse;
    let estimate = |(place, quantity): (usize, &Quantity)| {
        let (inflation, scale) = (*spread.get((place, place))?, scales.get(place)?);
        let is_told = (0.0..MAX_INFLATION).contains(&inflation)
            && inflation > 0.0
            && unknown
                .iter()
                .all(|combination| combination.get(place).is_none_or(|share| share.abs() < MAX_SHARE))
            && noise.get(place).is_none_or(|noise| *noise < MAX_NOISE);
        let half_width = 1.96 * libm::sqrt(variance * inflation) / scale;
        let value = solution.get(place)? / scale;
        let value = if *quantity == Quantity::Lateness { delay + value } else { value };
        Some(Estimate { quantity: *quantity, value: is_told.then_some((value, half_width)) })
    };
    let estimates = quantities.iter().enumerate().filter_map(estimate).collect();
    Ok((estimates, unexplained))
}
