//! Least squares over the equations of an experiment, with what each parameter is known to.

use nalgebra::{DMatrix, DVector};

use super::windows::{Equation, count};
use super::{Estimate, IdentifyError, Quantity};

/// Variance inflation beyond which two columns are the same.
const MOST_INFLATION: f64 = 1e3;
/// Share of the force that may stay unexplained.
const MOST_UNEXPLAINED: f64 = 0.1;

/// An estimate of each quantity, which are the first columns, and the share of the force that stays unexplained, RMS.
///
/// # Errors
/// [`IdentifyError::NotExcited`], [`IdentifyError::Unexplained`].
pub(super) fn solve(
    quantities: &[Quantity],
    equations: &[Equation],
) -> Result<(Vec<Estimate>, f64), IdentifyError> {
    let (rows, columns) = (equations.len(), equations.first().map_or(0, |(row, _)| row.len()));
    let values = equations.iter().flat_map(|(row, _)| row.iter().copied());
    let mut matrix = DMatrix::from_row_iterator(rows, columns, values);
    let forces = DVector::from_iterator(rows, equations.iter().map(|(_, force)| *force));
    // A column that is 0 stays so, and is found below.
    let scales: Vec<f64> = matrix.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    for (mut column, scale) in matrix.column_iter_mut().zip(&scales) {
        column /= *scale;
    }
    let decomposed = matrix.clone().svd(true, true);
    let smallest = decomposed.singular_values.max() * 1e-9;
    let (Ok(solution), Ok(inverse)) =
        (decomposed.solve(&forces, smallest), matrix.clone().pseudo_inverse(smallest))
    else {
        return Err(IdentifyError::NotExcited);
    };
    let residual = &forces - &matrix * &solution;
    let unexplained = residual.norm() / forces.norm().max(f64::MIN_POSITIVE);
    if unexplained > MOST_UNEXPLAINED {
        return Err(IdentifyError::Unexplained { unexplained });
    }
    let variance = residual.norm_squared() / count(rows - columns);
    // With columns of length 1, what the others add to the variance of a parameter.
    let inflations: Vec<f64> = inverse.row_iter().map(|row| row.norm_squared()).collect();
    // A direction that is cut off the pseudo-inverse has no variance in it, and is no better known.
    let is_known = |place: usize| match &decomposed.v_t {
        Some(directions) => {
            decomposed.singular_values.iter().zip(directions.row_iter()).all(|(value, direction)| {
                *value > smallest || direction.get(place).is_none_or(|part| part.abs() < 1e-6)
            })
        }
        None => false,
    };
    let estimate = |(place, quantity): (usize, &Quantity)| {
        let (inflation, scale) = (inflations.get(place)?, scales.get(place)?);
        let is_told = *inflation < MOST_INFLATION && is_known(place);
        let half_width = 1.96 * libm::sqrt(variance * inflation) / scale;
        let value = is_told.then_some((solution.get(place)? / scale, half_width));
        Some(Estimate { quantity: *quantity, value })
    };
    let estimates = quantities.iter().enumerate().filter_map(estimate).collect();
    Ok((estimates, unexplained))
}
