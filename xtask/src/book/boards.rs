//! A page per board from the catalogue: clock, memory, pins, motor, interrupts, budgets, test status.

use boards::BOARDS;
use boards::catalogue::BoardInfo;
use boards::motor::Motor;

use super::{Page, head_of, pins, read_text};

/// Returns all pages.
pub(super) fn pages() -> Result<Vec<Page>, String> {
    let readme = read_text("README.md")?;
    BOARDS.iter().map(|board| page(board, &readme)).collect()
}

fn page(board: &BoardInfo, readme: &str) -> Result<Page, String> {
    let BoardInfo { name, tooling, memory_map, budget } = board;
    let head = head_of(&read_text(&format!("boards/src/{}.rs", name.replace('-', "_")))?);
    let chip = tooling.chip.map_or_else(|| "none (emulated)".to_owned(), |chip| format!("`{chip}`"));
    let variants: Vec<String> = tooling.variants.iter().map(|variant| format!("`{variant}`")).collect();
    let mut rows = vec![
        ("Clock, MHz", (f64::from(tooling.clock_hz) / 1e6).to_string()),
        ("Ticks per second", tooling.tick_hz.to_string()),
        ("Axes", tooling.axes.to_string()),
        ("Data base, words", tooling.sizes.words.to_string()),
        ("Modules", tooling.sizes.modules.to_string()),
        ("Links", tooling.sizes.links.to_string()),
        ("Built-in scheme", format!("`builtin:{}`", tooling.scheme.name)),
        ("Chip, for probe-rs", chip),
        ("Image variants", variants.join(", ")),
    ];
    rows.extend(tooling.motor.iter().flat_map(motor_rows));
    rows.extend(status(name, readme));
    let rows: String = rows.iter().map(|(what, value)| format!("| {what} | {value} |\n")).collect();
    let handlers: String = tooling
        .interrupts
        .iter()
        .map(|(handler, priority)| format!("| `{handler}` | {priority} |\n"))
        .collect();
    let text = format!(
        "# {name}\n\n{head}\n{}## In figures\n\n| Property | Value |\n|---|---|\n{rows}\n\
         ## Interrupts\n\nLower numbers have higher priority.\n\n| Handler | Priority |\n|---|---:|\n{handlers}\n\
         ## Budget\n\nMeasured figures: [firmware](../firmware.md).\n\n```toml\n{}\n```\n\n\
         ## Memory map\n\n```text\n{}\n```\n",
        pins::section(board),
        budget.trim_end(),
        memory_map.trim_end()
    );
    Ok(Page { title: (*name).to_owned(), path: format!("docs/boards/{name}.md"), text })
}

fn motor_rows(motor: &Motor) -> [(&'static str, String); 6] {
    [
        ("Motor: torque constant, N·m/A", motor.torque_constant_nm_per_a.to_string()),
        ("Motor: resistance, ohm", motor.resistance_ohm.to_string()),
        ("Motor: maximum current, A", motor.max_current_a.to_string()),
        ("Motor: supply, V", motor.supply_v.to_string()),
        ("Motor: counts per turn", motor.counts_per_turn.to_string()),
        ("Motor: pole pairs", motor.pole_pairs.to_string()),
    ]
}

/// Returns the test status from README.md.
fn status(name: &str, readme: &str) -> Vec<(&'static str, String)> {
    let row = format!("| `firmware` on `{name}` | ");
    let cells =
        readme.lines().find_map(|line| line.strip_prefix(&row)?.strip_suffix(" |")?.split_once(" | "));
    let cells = cells.map(|(runs, never)| (runs.replace("](docs/", "](../"), never.to_owned()));
    cells.into_iter().flat_map(|(runs, never)| [("Runs", runs), ("Has never run", never)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_board_has_a_page_with_its_pins_its_clock_and_what_has_run_on_it() {
        let pages = pages().unwrap();
        for Page { title, text, .. } in &pages {
            for part in ["| Clock, MHz | ", "| Runs | ", "| Has never run | ", "tick_percent = ", "ORIGIN"] {
                assert!(text.contains(part), "{title} lacks {part}: {text}");
            }
        }
        let nucleo = pages.iter().find(|page| page.title == "nucleo-g474re").unwrap();
        for part in ["| PC0 | axis 1: direction |", "| Clock, MHz | 168 |", "`classic-can`", "| `TIM5` | 1 |"]
        {
            assert!(nucleo.text.contains(part), "{part}: {}", nucleo.text);
        }
    }
}
