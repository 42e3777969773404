//! Linear least-squares fit.

/// `cost = offset + slope n`.
pub(super) struct Line {
    pub(super) slope: f64,
    pub(super) offset: f64,
    /// Maximum residual.
    pub(super) residual: f64,
}

impl Line {
    pub(super) fn fit(points: &[(u8, f64)]) -> Self {
        let points = points.iter().map(|(x, y)| (f64::from(*x), *y));
        let count = points.clone().map(|_| 1.0).sum::<f64>();
        let mean_x = points.clone().map(|(x, _)| x).sum::<f64>() / count;
        let mean_y = points.clone().map(|(_, y)| y).sum::<f64>() / count;
        let covariance: f64 = points.clone().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
        let variance: f64 = points.clone().map(|(x, _)| (x - mean_x).powi(2)).sum();
        let slope = covariance / variance;
        let offset = mean_y - slope * mean_x;
        let residual = points.map(|(x, y)| (y - offset - slope * x).abs()).fold(0.0, f64::max);
        Self { slope, offset, residual }
    }
}

#[cfg(test)]
mod tests {
    use super::Line;

    #[test]
    fn finds_a_line_and_what_is_off_it() {
        let line = Line::fit(&[(1, 5.0), (2, 7.0), (3, 9.0)]);
        assert!((line.slope - 2.0).abs() < 1e-12 && (line.offset - 3.0).abs() < 1e-12);
        assert!(line.residual < 1e-12);
        assert!((Line::fit(&[(0, 0.0), (1, 3.0), (2, 0.0)]).residual - 2.0).abs() < 1e-12);
    }
}
