//! Decimates a long signal to the resolution of a picture, keeping all extremes.
//!
//! M4 aggregation (Jugel et al., VLDB 2014): keeps the first, smallest, largest and last point of each pixel column, in time
//! order. The drawn line is the same as with all points.

use std::ops::Range;

/// One point of a picture: time, `s`, and value in the unit of its axis.
pub(super) type Point = (f64, f64);

/// The points of one pixel column.
#[derive(Clone, Copy)]
struct Bucket {
    number: f64,
    first: Point,
    smallest: Point,
    largest: Point,
    last: Point,
}

impl Bucket {
    fn new(number: f64, point: Point) -> Self {
        Self { number, first: point, smallest: point, largest: point, last: point }
    }

    fn add(&mut self, point: Point) {
        if point.1 < self.smallest.1 {
            self.smallest = point;
        }
        if point.1 > self.largest.1 {
            self.largest = point;
        }
        self.last = point;
    }

    fn flush_into(self, segment: &mut Vec<Point>) {
        let (early, late) = if self.smallest.0 <= self.largest.0 {
            (self.smallest, self.largest)
        } else {
            (self.largest, self.smallest)
        };
        for point in [self.first, early, late, self.last] {
            if segment.last() != Some(&point) {
                segment.push(point);
            }
        }
    }
}

/// Returns continuous segments of the signal over `time_s`, with at most four points in each of `columns` pixel columns. NaN
/// and infinite values separate segments.
pub(crate) fn decimate(
    points: impl Iterator<Item = Point>,
    time_s: &Range<f64>,
    columns: u32,
) -> Vec<Vec<Point>> {
    let columns_per_s = f64::from(columns) / (time_s.end - time_s.start);
    let mut segments = Vec::new();
    let mut segment = Vec::new();
    let mut open: Option<Bucket> = None;
    for point in points {
        if !(point.0.is_finite() && point.1.is_finite()) {
            if let Some(bucket) = open.take() {
                bucket.flush_into(&mut segment);
                segments.push(std::mem::take(&mut segment));
            }
            continue;
        }
        let number = ((point.0 - time_s.start) * columns_per_s).floor();
        match &mut open {
            Some(bucket) if bucket.number.total_cmp(&number).is_eq() => bucket.add(point),
            _ => {
                if let Some(bucket) = open.replace(Bucket::new(number, point)) {
                    bucket.flush_into(&mut segment);
                }
            }
        }
    }
    if let Some(bucket) = open {
        bucket.flush_into(&mut segment);
        segments.push(segment);
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(count: u32) -> impl Iterator<Item = f64> {
        (0..count).map(|tick| f64::from(tick) * 1e-3)
    }

    #[test]
    fn a_spike_of_one_sample_survives_in_a_million() {
        for spike_tick in [0_u32, 123_457, 999_999] {
            let points =
                seconds(1_000_000).zip(0..).map(|(t, tick)| (t, if tick == spike_tick { -7.5 } else { 1.0 }));
            let segments = decimate(points, &(0.0..1000.0), 1100);
            assert_eq!(segments.len(), 1);
            assert!(segments[0].len() <= 4 * 1100);
            let spike_time_s = f64::from(spike_tick) * 1e-3;
            assert!(segments[0].contains(&(spike_time_s, -7.5)), "spike at tick {spike_tick} is gone");
        }
    }

    #[test]
    fn time_never_runs_backwards_and_the_ends_stay() {
        let signal: Vec<Point> = seconds(50_000).map(|t| (t, (40.0 * t).sin() * t)).collect();
        let segments = decimate(signal.iter().copied(), &(0.0..50.0), 300);
        assert!(segments[0].is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(segments[0].first(), signal.first());
        assert_eq!(segments[0].last(), signal.last());
    }

    #[test]
    fn a_short_signal_stays_as_it_is() {
        let signal: Vec<Point> = seconds(100).map(|t| (t, t * t)).collect();
        assert_eq!(decimate(signal.iter().copied(), &(0.0..0.1), 1000), vec![signal]);
    }

    #[test]
    fn a_hole_in_the_signal_breaks_the_line() {
        let values = [1.0, 2.0, f64::NAN, f64::INFINITY, 3.0];
        let segments = decimate((0..5).map(f64::from).zip(values), &(0.0..5.0), 50);
        assert_eq!(segments, vec![vec![(0.0, 1.0), (1.0, 2.0)], vec![(4.0, 3.0)]]);
    }
}
