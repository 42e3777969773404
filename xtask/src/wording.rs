//! `cargo xtask step wording`: spelling, and habits of style that a field engineer stumbles over, in documents, messages
//! and comments.

mod prose;

use std::fs;

use regex::Regex;

use crate::setup;
use crate::shell::{Outcome, command, run, top};

/// A habit, a pattern that detects it, and the remedy.
struct Habit {
    name: &'static str,
    pattern: &'static str,
    remedy: &'static str,
}

const HABITS: [Habit; 5] = [
    Habit {
        name: "clause as a noun",
        pattern: r"(?:^|[.!?;|] )(?:What|Who|Whoever|Wherever) [a-z][^.!?]*(?:[.!]|$)",
        remedy: "name the thing: subject, verb, object",
    },
    Habit {
        name: "light verb",
        pattern: r"\b(?:says|tells|told|knows|goes on|go on|going on)\b",
        remedy: "use the technical verb: reports, contains, continues",
    },
    Habit {
        name: "home-made term",
        pattern: r"\b(?:anew|untold|lessens?|mends?|mended|whoever|out of it|beside)\b",
        remedy: "use the term of the field: restart, reduce, correct, next to",
    },
    Habit {
        name: "stand-in without a noun",
        pattern: r"\bthe one (?:that|of|in|with)\b",
        remedy: "repeat the noun",
    },
    Habit {
        name: "negated noun",
        pattern: r"\bnobody\b|\bthat (?:is|are) none\b|\b(?:is|are) no [a-z]+ (?:that|of)\b",
        remedy: "state the positive: invalid, unknown, missing, disarmed",
    },
];

/// Fails with every habit that it finds, and with misspelled words.
pub(crate) fn hold() -> Outcome {
    let found = findings()?;
    if !found.is_empty() {
        return Err(format!("{}\n{} texts to reword", found.join("\n"), found.len()));
    }
    let python = setup::python()?;
    run(&mut command(python.with_file_name("typos"), ["--format", "brief"]))
}

fn findings() -> Result<Vec<String>, String> {
    let compiled = HABITS.iter().map(|habit| Ok((habit, Regex::new(habit.pattern)?)));
    let habits: Vec<_> = compiled.collect::<Result<_, regex::Error>>().map_err(|error| error.to_string())?;
    let mut found = Vec::new();
    for path in prose::files()? {
        let text =
            fs::read_to_string(top().join(&path)).map_err(|error| format!("cannot read {path}: {error}"))?;
        for (line, part) in prose::texts(&path, &text) {
            let matching = habits.iter().filter(|(_, pattern)| pattern.is_match(part));
            found.extend(matching.map(|(Habit { name, remedy, .. }, _)| {
                format!("{path}:{line}: {name}: {}\n    {remedy}", part.trim())
            }));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn habits(text: &str) -> Vec<&'static str> {
        let is_found = |habit: &&Habit| Regex::new(habit.pattern).unwrap().is_match(text);
        HABITS.iter().filter(is_found).map(|habit| habit.name).collect()
    }

    #[test]
    fn each_habit_is_detected_and_plain_english_passes() {
        for (text, habit) in [
            ("Runs. What reads from it comes soon.", "clause as a noun"),
            ("Who moves a device moves it alone", "clause as a noun"),
            ("the board says why", "light verb"),
            ("the integrator goes on", "light verb"),
            ("modules begin anew", "home-made term"),
            ("its range and the one of its sensor", "stand-in without a noun"),
            ("nobody holds the lease", "negated noun"),
            ("a unit that is none", "negated noun"),
            ("which is no number that fits", "negated noun"),
        ] {
            assert_eq!(habits(text), [habit], "{text}");
        }
        for text in
            ["What moves the joint?", "There is no CAN bus.", "The encoder reports standstill.", "stands for"]
        {
            assert!(habits(text).is_empty(), "{text}");
        }
    }
}
