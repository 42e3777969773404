//! Zero contour of a figure on a grid, by marching squares with linear interpolation.

/// A segment of the contour: start and end, in grid steps to the right and up from the first point.
pub type ContourSegment = [(f64, f64); 2];

/// Returns the segments for values by row and column; none next to a point without a value.
#[must_use]
pub fn contour(figures: &[Vec<f64>]) -> Vec<ContourSegment> {
    let mut pieces = Vec::new();
    for (row, (low, high)) in figures.iter().zip(figures.iter().skip(1)).enumerate() {
        for (column, (low, high)) in low.windows(2).zip(high.windows(2)).enumerate() {
            let (&[a, b], &[d, c]) = (low, high) else { continue };
            #[expect(clippy::cast_precision_loss, reason = "few points")]
            let (x, y) = (column as f64, row as f64);
            // Edges around the square: start and end corner.
            let edges = [(a, b, (0.0, 0.0), (1.0, 0.0)), (b, c, (1.0, 0.0), (0.0, 1.0))];
            let back = [(c, d, (1.0, 1.0), (-1.0, 0.0)), (d, a, (0.0, 1.0), (0.0, -1.0))];
            let crossings = edges.into_iter().chain(back).filter_map(|(from, to, at, way)| {
                let share = from / (from - to);
                ((from < 0.0) != (to < 0.0) && from.is_finite() && to.is_finite())
                    .then_some((x + at.0 + share * way.0, y + at.1 + share * way.1))
            });
            let crossings: Vec<(f64, f64)> = crossings.collect();
            pieces.extend(crossings.chunks_exact(2).filter_map(|pair| ContourSegment::try_from(pair).ok()));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_has_its_radius_and_is_closed() {
        let figures: Vec<Vec<f64>> = (0..21)
            .map(|y| (0..21).map(|x| f64::hypot(f64::from(x) - 10.0, f64::from(y) - 10.0) - 7.3).collect())
            .collect();
        let pieces = contour(&figures);
        let length: f64 = pieces.iter().map(|[from, to]| f64::hypot(to.0 - from.0, to.1 - from.1)).sum();
        assert!((length / (std::f64::consts::TAU * 7.3) - 1.0).abs() < 0.01, "{length}");
        for (x, y) in pieces.into_iter().flatten() {
            assert!((f64::hypot(x - 10.0, y - 10.0) - 7.3).abs() < 0.02, "{x} {y}");
        }
    }

    #[test]
    fn a_point_without_a_figure_has_no_border() {
        assert!(contour(&[vec![-1.0, f64::NAN], vec![-1.0, -1.0]]).is_empty());
        assert_eq!(contour(&[vec![-1.0, 1.0], vec![-1.0, 3.0]]), [[(0.5, 0.0), (0.25, 1.0)]]);
    }
}
