//! The steps of a tier, told as they begin, and how long each took.

use std::time::{Duration, Instant};

use crate::shell::Outcome;
use crate::table::table;

/// What was done of a tier.
pub(crate) struct Steps {
    start: Instant,
    done: Vec<(&'static str, Duration)>,
}

impl Steps {
    /// Runs a tier; shows the times of its steps at the end, however it ended.
    pub(crate) fn run(tier: impl FnOnce(&mut Self) -> Outcome) -> Outcome {
        let mut steps = Self { start: Instant::now(), done: Vec::new() };
        let outcome = tier(&mut steps);
        println!("{}", steps.text());
        outcome
    }

    /// Runs one step; an error comes with its name.
    pub(crate) fn step<T>(
        &mut self,
        name: &'static str,
        work: impl FnOnce() -> Result<T, String>,
    ) -> Result<T, String> {
        let (result, time) = self.timed(name, work);
        self.done.push((name, time));
        result
    }

    /// Runs two steps at the same time: what one leaves of the machine is the other's.
    pub(crate) fn both<A: Send, B>(
        &mut self,
        (name, work): (&'static str, impl FnOnce() -> Result<A, String> + Send),
        (other_name, other_work): (&'static str, impl FnOnce() -> Result<B, String>),
    ) -> Result<(A, B), String> {
        let ((result, time), (other, other_time)) = std::thread::scope(|scope| {
            let this = &*self;
            let first = scope.spawn(move || this.timed(name, work));
            let other = self.timed(other_name, other_work);
            let lost = |_| (Err(format!("{name} was lost")), Duration::ZERO);
            (first.join().unwrap_or_else(lost), other)
        });
        self.done.extend([(name, time), (other_name, other_time)]);
        Ok((result?, other?))
    }

    fn timed<T>(
        &self,
        name: &str,
        work: impl FnOnce() -> Result<T, String>,
    ) -> (Result<T, String>, Duration) {
        println!("=== {name} (after {} s)", self.start.elapsed().as_secs());
        let start = Instant::now();
        let result = work();
        (result.map_err(|error| format!("{name}: {error}")), start.elapsed())
    }

    /// A row for each step, and for all of them until now.
    fn text(&self) -> String {
        let all = self.start.elapsed();
        let rows = self.done.iter().copied().chain([("all", all)]);
        let rows: Vec<[String; 2]> =
            rows.map(|(name, time)| [name.to_owned(), format!("{:.1}", time.as_secs_f64())]).collect();
        table(["Step", "Time, s"], &rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps() -> Steps {
        Steps { start: Instant::now(), done: Vec::new() }
    }

    #[test]
    fn a_step_gives_its_result_and_its_name_with_an_error() {
        let mut steps = steps();
        assert_eq!(steps.step("format", || Ok(3)), Ok(3));
        assert_eq!(steps.step("lints", || Err::<(), _>("a warning".into())), Err("lints: a warning".into()));
        assert_eq!(steps.both(("images", || Ok(1)), ("tests", || Ok(2))), Ok((1, 2)));
        let failed = || Err::<(), _>("a fault".into());
        assert_eq!(steps.both(("images", || Ok(1)), ("tests", failed)), Err("tests: a fault".into()));
        let names: Vec<_> = steps.done.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["format", "lints", "images", "tests", "images", "tests"]);
    }

    #[test]
    fn every_step_has_a_row_and_the_last_one_is_the_whole_time() {
        let done = vec![("format", Duration::from_millis(1_500)), ("lints", Duration::from_secs(2))];
        let text = Steps { done, ..steps() }.text();
        let words = |row: &str| row.split_whitespace().collect::<Vec<_>>().join(" ");
        let rows: Vec<String> = text.trim().lines().skip(2).map(words).collect();
        assert_eq!(rows, ["| format | 1.5 |", "| lints | 2.0 |", "| all | 0.0 |"]);
    }
}
