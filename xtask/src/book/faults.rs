//! A page per reason why a device does not get what the scheme commands, and per event, by what the core says of them.

use dimsart_core::Reason;
use dimsart_link::EventKind;

use super::{Page, read_text};

/// What the pages are about.
struct Fault {
    number: u8,
    name: &'static str,
    meaning: &'static str,
    next_step: &'static str,
    /// What kind of thing it is.
    is: &'static str,
}

fn faults() -> impl Iterator<Item = Fault> {
    let reasons = Reason::ALL.iter().map(|reason| Fault {
        number: reason.number(),
        name: reason.name(),
        meaning: reason.meaning(),
        next_step: reason.next_step(),
        is: match (reason.is_fault(), reason.is_limit()) {
            _ if *reason == Reason::LinkDown => {
                "A fault: the device gets its safe value, within its rate, until the first packet. The lease is kept."
            }
            (true, _) => {
                "A fault: the device gets its safe value, within its rate, until a `reset`, and motion takes a new \
                 lease (`arm`)."
            }
            (_, true) => "A limit: the scheme commands the device, and its command was cut.",
            _ => "Nothing is wrong: the device gets its safe value until the reason is over.",
        },
    });
    let events = EventKind::ALL.iter().map(|kind| Fault {
        number: *kind as u8,
        name: kind.name(),
        meaning: kind.meaning(),
        next_step: kind.next_step(),
        is: "An event: it stands in the log that `dimsart connect PORT events` shows.",
    });
    reasons.chain(events)
}

fn file(number: u8, name: &str) -> String {
    format!("faults/{number}-{}.md", name.replace(' ', "-"))
}

/// All of them.
pub(super) fn pages() -> Result<Vec<Page>, String> {
    let table = read_text("docs/faults.md")?;
    Ok(faults().map(|fault| page(&fault, &table)).collect())
}

fn page(fault: &Fault, table: &str) -> Page {
    let Fault { number, name, meaning, next_step, is } = fault;
    let title = format!("{number} {name}");
    let mut text = format!("# {title}\n\n{meaning}\n\n{is}\n");
    if !next_step.is_empty() {
        text += &format!("\n## What to do next\n\n{next_step}\n");
    }
    let reason = format!("| {number} |");
    let noticed: String = table
        .split("## How soon a fault is noticed")
        .nth(1)
        .into_iter()
        .flat_map(|section| section.lines().take_while(|line| !line.starts_with("## ")))
        .filter_map(|line| line.strip_prefix("| ")?.strip_suffix(&reason)?.split_once(" | "))
        .map(|(fault, ticks)| format!("| {fault} | {} |\n", ticks.trim()))
        .collect();
    if !noticed.is_empty() {
        text += "\n## How soon it is noticed\n\n| Fault | Ticks |\n|---|---:|\n";
        text += &noticed;
        text += "\nTicks from the first one with the fault: [how they are measured](../faults.md#how-soon-a-fault-is-noticed).\n";
    }
    text += "\n[All reasons and events](../faults.md), and [why it does not move](../howto/why-it-does-not-move.md).\n";
    Page { title, path: format!("docs/{}", file(*number, name)), text }
}

/// The page of all of them, whose numbers lead to theirs.
pub(super) fn with_links(page: &str) -> String {
    faults().fold(page.to_owned(), |page, Fault { number, name, .. }| {
        let row = |cell: &str| format!("\n| {cell} | {name} |");
        page.replace(&row(&number.to_string()), &row(&format!("[{number}]({})", file(number, name))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_the_page_leads_to_its_own() {
        let page = with_links(&read_text("docs/faults.md").unwrap());
        let pages = pages().unwrap();
        assert_eq!(pages.len(), Reason::ALL.len() + EventKind::ALL.len());
        for Page { path, .. } in &pages {
            assert!(page.contains(&format!("]({})", path.trim_start_matches("docs/"))), "{path}");
        }
        let lost = pages.iter().find(|page| page.title == "48 link lost").unwrap();
        assert!(lost.text.contains("| nothing comes over a link | 19 |"), "{}", lost.text);
        assert!(lost.text.contains("## What to do next\n\nCheck the peer"), "{}", lost.text);
    }
}
