//! Removes points that are close to a straight line.
//!
//! Each point since the last kept point restricts the slopes that pass it within the tolerance. When the slope to the next
//! point is outside their intersection, the point before it is kept and the slopes restart. One pass; the distance of every
//! point from the line is at most the tolerance (Sklansky and Gonzalez, 1980).

use super::decimate::Point;

/// Returns the points that a line needs to pass all `points`, in order of time, within `tolerance`, in the unit of their
/// values. Keeps the first and the last point.
pub(super) fn simplify(points: &[Point], tolerance: f64) -> Vec<Point> {
    let Some(first) = points.first() else { return Vec::new() };
    let mut kept = vec![*first];
    let (mut anchor, mut before) = (*first, *first);
    let mut allowed = Slopes::ANY;
    for point in points.iter().skip(1) {
        if !allowed.hold((point.1 - anchor.1) / (point.0 - anchor.0)) {
            kept.push(before);
            anchor = before;
            allowed = Slopes::ANY;
        }
        allowed = allowed.passing(anchor, *point, tolerance);
        before = *point;
    }
    kept.push(before);
    kept.dedup();
    kept
}

/// Permitted slopes from the last kept point.
#[derive(Clone, Copy)]
struct Slopes {
    least: f64,
    most: f64,
}

impl Slopes {
    const ANY: Self = Self { least: f64::NEG_INFINITY, most: f64::INFINITY };

    fn hold(self, slope: f64) -> bool {
        self.least <= slope && slope <= self.most
    }

    /// Returns the slopes from `anchor` that pass `point` within `tolerance`.
    fn passing(self, anchor: Point, point: Point, tolerance: f64) -> Self {
        let slope_to = |value: f64| (value - anchor.1) / (point.0 - anchor.0);
        Self {
            least: self.least.max(slope_to(point.1 - tolerance)),
            most: self.most.min(slope_to(point.1 + tolerance)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the value at `time_s` of the line through `points`.
    fn line(points: &[Point], time_s: f64) -> f64 {
        let next = points.iter().position(|point| point.0 >= time_s).unwrap().max(1);
        let (a, b) = (points[next - 1], points[next]);
        a.1 + (b.1 - a.1) * (time_s - a.0) / (b.0 - a.0)
    }

    #[test]
    fn a_straight_line_needs_its_ends_and_a_corner_stays() {
        let ramp: Vec<Point> = (0..=100).map(|k| (f64::from(k), f64::from((k - 60).max(0)))).collect();
        assert_eq!(simplify(&ramp, 1e-9), [(0.0, 0.0), (60.0, 0.0), (100.0, 40.0)]);
        assert_eq!(simplify(&ramp[..1], 1e-9), ramp[..1]);
        assert_eq!(simplify(&[], 1e-9), []);
    }

    proptest! {
        #[test]
        fn no_point_is_further_off_than_the_tolerance(values in prop::collection::vec(-1.0..1.0_f64, 2..200)) {
            let mut level = 0.0;
            let walk: Vec<Point> = values.iter().zip(0..).map(|(step, k)| {
                level += step;
                (f64::from(k) * 1e-3, level)
            }).collect();
            let kept = simplify(&walk, 0.5);
            prop_assert_eq!((kept.first(), kept.last()), (walk.first(), walk.last()));
            for (time_s, value) in walk {
                prop_assert!((line(&kept, time_s) - value).abs() < 0.5 + 1e-9);
            }
        }
    }
}
