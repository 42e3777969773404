//! The steps of a tier, with progress and times.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::shell::Outcome;
use crate::table::table;

/// The completed steps of a tier.
pub(crate) struct Steps {
    start: Instant,
    done: Mutex<Vec<(&'static str, Duration)>>,
}

impl Steps {
    /// Runs a tier; shows the times of its steps at the end, also after a failure.
    pub(crate) fn run(tier: impl FnOnce(&Self) -> Outcome) -> Outcome {
        let steps = Self { start: Instant::now(), done: Mutex::default() };
        let outcome = tier(&steps);
        println!("{}", steps.text());
        outcome
    }

    /// Runs a step; adds its name to an error.
    pub(crate) fn step<T>(
        &self,
        name: &'static str,
        work: impl FnOnce() -> Result<T, String>,
    ) -> Result<T, String> {
        println!("=== {name} (after {} s)", self.start.elapsed().as_secs());
        let start = Instant::now();
        let result = work();
        self.done.lock().unwrap_or_else(PoisonError::into_inner).push((name, start.elapsed()));
        result.map_err(|error| format!("{name}: {error}"))
    }

    /// Runs two groups of steps in parallel.
    pub(crate) fn both<A: Send>(
        one: impl FnOnce() -> Result<A, String> + Send,
        other: impl FnOnce() -> Outcome,
    ) -> Result<A, String> {
        let (one, other) = std::thread::scope(|scope| {
            let one = scope.spawn(one);
            let other = other();
            (one.join().unwrap_or_else(|_| Err("a thread panicked".to_owned())), other)
        });
        other.and(one)
    }

    /// Returns a table of the steps and the total time.
    fn text(&self) -> String {
        let all = self.start.elapsed();
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        let rows = done.iter().copied().chain([("all", all)]);
        let rows: Vec<[String; 2]> =
            rows.map(|(name, time)| [name.to_owned(), format!("{:.1}", time.as_secs_f64())]).collect();
        table(["Step", "Time, s"], &rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(done: Vec<(&'static str, Duration)>) -> Steps {
        Steps { start: Instant::now(), done: Mutex::new(done) }
    }

    #[test]
    fn a_step_gives_its_result_and_its_name_with_an_error() {
        let steps = steps(Vec::new());
        let failed = || steps.step("lints", || Err("a warning".into()));
        assert_eq!(steps.step("format", || Ok(3)), Ok(3));
        assert_eq!(failed(), Err::<(), _>("lints: a warning".into()));
        assert_eq!(Steps::both(|| steps.step("images", || Ok(1)), || steps.step("tests", || Ok(()))), Ok(1));
        assert_eq!(Steps::both(|| Ok(1), failed), Err("lints: a warning".into()));
        assert_eq!(Steps::both(failed, || Ok(())), Err("lints: a warning".into()));
        let mut names: Vec<_> = steps.done.lock().unwrap().iter().map(|(name, _)| *name).collect();
        names.sort_unstable();
        assert_eq!(names, ["format", "images", "lints", "lints", "lints", "tests"]);
    }

    #[test]
    fn every_step_has_a_row_and_the_last_one_is_the_whole_time() {
        let text =
            steps(vec![("format", Duration::from_millis(1_500)), ("lints", Duration::from_secs(2))]).text();
        let words = |row: &str| row.split_whitespace().collect::<Vec<_>>().join(" ");
        let rows: Vec<String> = text.trim().lines().skip(2).map(words).collect();
        assert_eq!(rows, ["| format | 1.5 |", "| lints | 2.0 |", "| all | 0.0 |"]);
    }
}
