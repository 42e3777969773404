//! A page per safety reason and event, from the core's texts.

use dimsart_core::SafetyReason;
use dimsart_link::EventKind;

use super::{Page, read_text};

/// A reason or an event.
struct Fault {
    number: u8,
    name: &'static str,
    meaning: &'static str,
    remedy: &'static str,
    /// Its category.
    is: &'static str,
}

fn faults() -> impl Iterator<Item = Fault> {
    let reasons = SafetyReason::ALL.iter().map(|reason| Fault {
        number: reason.number(),
        name: reason.name(),
        meaning: reason.meaning(),
        remedy: reason.remedy(),
        is: match (reason.is_fault(), reason.is_limit()) {
            _ if *reason == SafetyReason::LinkDown => {
                "A fault: the device moves to its safe value, within its rate limit, until the first packet. The lease is kept."
            }
            (true, _) => {
                "A fault: the device moves to its safe value, within its rate limit. Motion needs `reset` and a \
                 new lease (`arm`)."
            }
            (_, true) => "A limit: the scheme commands the device, and the command was limited.",
            _ => "No fault: the device gets its safe value until the cause is removed.",
        },
    });
    let events = EventKind::ALL.iter().map(|kind| Fault {
        number: *kind as u8,
        name: kind.name(),
        meaning: kind.meaning(),
        remedy: kind.remedy(),
        is: "An event in the log: see `dimsart connect PORT events`.",
    });
    reasons.chain(events)
}

fn file(number: u8, name: &str) -> String {
    format!("faults/{number}-{}.md", name.replace(' ', "-"))
}

/// Returns all pages.
pub(super) fn pages() -> Result<Vec<Page>, String> {
    let table = read_text("docs/faults.md")?;
    Ok(faults().map(|fault| page(&fault, &table)).collect())
}

fn page(fault: &Fault, table: &str) -> Page {
    let Fault { number, name, meaning, remedy, is } = fault;
    let title = format!("{number} {name}");
    let mut text = format!("# {title}\n\n{meaning}\n\n{is}\n");
    if !remedy.is_empty() {
        text += &format!("\n## Remedy\n\n{remedy}\n");
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
        text += "\n## Detection time\n\n| Fault | Ticks |\n|---|---:|\n";
        text += &noticed;
        text += "\nTicks from the first faulty tick: [method](../faults.md#how-soon-a-fault-is-noticed).\n";
    }
    text += "\n[All reasons and events](../faults.md); [if the device does not move](../howto/why-it-does-not-move.md).\n";
    Page { title, path: format!("docs/{}", file(*number, name)), text }
}

/// Adds links from the numbers of the overview page.
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
        assert_eq!(pages.len(), SafetyReason::ALL.len() + EventKind::ALL.len());
        for Page { path, .. } in &pages {
            assert!(page.contains(&format!("]({})", path.trim_start_matches("docs/"))), "{path}");
        }
        let lost = pages.iter().find(|page| page.title == "48 link lost").unwrap();
        assert!(lost.text.contains("| no packets arrive on a link | 19 |"), "{}", lost.text);
        assert!(lost.text.contains("## Remedy\n\nCheck the peer"), "{}", lost.text);
    }
}
