//! A chore with its name, and lists of chores.

use crate::shell::Outcome;

/// A chore.
pub(crate) struct Chore {
    pub(crate) name: &'static str,
    help: &'static str,
    run: Run,
}

enum Run {
    Plain(fn() -> Outcome),
    /// With arguments as shown in the usage; returns `None` for invalid ones.
    With(&'static str, fn(&[&str]) -> Option<Outcome>),
    /// One of a list, which is printed without an argument.
    OneOf(&'static [Chore]),
}

impl Chore {
    pub(crate) const fn new(name: &'static str, help: &'static str, run: fn() -> Outcome) -> Self {
        Self { name, help, run: Run::Plain(run) }
    }

    pub(crate) const fn with(
        name: &'static str,
        arguments: &'static str,
        help: &'static str,
        run: fn(&[&str]) -> Option<Outcome>,
    ) -> Self {
        Self { name, help, run: Run::With(arguments, run) }
    }

    pub(crate) const fn one_of(name: &'static str, help: &'static str, chores: &'static [Self]) -> Self {
        Self { name, help, run: Run::OneOf(chores) }
    }

    fn line(&self) -> String {
        let arguments = match self.run {
            Run::Plain(_) => "",
            Run::With(arguments, _) => arguments,
            Run::OneOf(_) => "NAME",
        };
        let call = format!("{} {arguments}", self.name);
        format!("  {}\n      {}\n", call.trim_end(), self.help)
    }
}

/// Runs the chore named by the first word with the other words; `None` if they are invalid.
pub(crate) fn run(chores: &[Chore], words: &[&str]) -> Option<Outcome> {
    let (name, arguments) = words.split_first()?;
    let chore = chores.iter().find(|chore| chore.name == *name)?;
    match (&chore.run, arguments) {
        (Run::Plain(run), []) => Some(run()),
        (Run::Plain(_), _) => None,
        (Run::With(_, run), _) => run(arguments),
        (Run::OneOf(chores), []) => {
            print!("{}", list(chores));
            Some(Ok(()))
        }
        (Run::OneOf(chores), _) => self::run(chores, arguments),
    }
}

/// Returns the usage of all chores.
pub(crate) fn list(chores: &[Chore]) -> String {
    chores.iter().map(Chore::line).collect()
}

/// Returns whether the words start with a chore's name and one of its list.
#[cfg(test)]
pub(crate) fn names(chores: &[Chore], words: &[&str]) -> bool {
    let Some((name, words)) = words.split_first() else { return true };
    chores.iter().find(|chore| chore.name == *name).is_some_and(|chore| match chore.run {
        Run::OneOf(chores) => names(chores, words),
        Run::Plain(_) | Run::With(..) => true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const INNER: &[Chore] = &[Chore::new("fails", "fail", || Err("failed".to_owned()))];
    const OUTER: &[Chore] = &[
        Chore::new("does", "nothing", || Ok(())),
        Chore::with("takes", "N", "one argument", |words| (words.len() == 1).then_some(Ok(()))),
        Chore::one_of("step", "of a list", INNER),
    ];

    #[test]
    fn a_chore_runs_by_its_name_and_takes_its_arguments_alone() {
        for right in [&["does"][..], &["takes", "3"], &["step"]] {
            assert_eq!(run(OUTER, right), Some(Ok(())), "{right:?}");
        }
        assert_eq!(run(OUTER, &["step", "fails"]), Some(Err("failed".to_owned())));
        for wrong in [&[][..], &["other"], &["does", "3"], &["takes"], &["step", "does"], &["fails"]] {
            assert_eq!(run(OUTER, wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn a_list_has_names_arguments_and_help() {
        let text = "  does\n      nothing\n  takes N\n      one argument\n  step NAME\n      of a list\n";
        assert_eq!(list(OUTER), text);
    }
}
