//! Pin plans of a board's chip, as pictures and tables.

use boards::catalogue::{BoardInfo, Pin, PinDirection, PinGroup, PinMode, PinPlan};
use svg::Document;
use svg::node::element::{Line, Rectangle, Text, Title};

const ROW: usize = 24;
const MARGIN: usize = 16;
const WIDTH: usize = 1000;
/// Size of the chip.
const CHIP: [usize; 2] = [420, 580];
/// Length of a pin's line.
const WIRE: usize = 40;
const FONT: &str = "sans-serif";

/// Returns the path of a plan's picture from the repository's top folder.
fn path(board: &BoardInfo, plan: &PinPlan) -> String {
    let variant = plan.variants.iter().find(|variant| !variant.is_empty() && !plan.variants.contains(&""));
    let dash = variant.map_or(String::new(), |variant| format!("-{variant}"));
    format!("docs/boards/{}{dash}-pins.svg", board.name)
}

/// Returns every picture with its path.
pub(super) fn pictures(board: &BoardInfo) -> Vec<(String, String)> {
    let plans = board.tooling.pins.iter();
    plans.map(|plan| (path(board, plan), draw(board, plan).to_string())).collect()
}

/// Returns the section of a board's page; empty without pins.
pub(super) fn section(board: &BoardInfo) -> String {
    let plans: String = board.tooling.pins.iter().map(|plan| of_plan(board, plan)).collect();
    if plans.is_empty() { plans } else { format!("## Pins\n\n{plans}") }
}

fn variants(plan: &PinPlan) -> String {
    let name = |variant: &&str| match *variant {
        "" => "the plain image".to_owned(),
        variant => format!("`{variant}`"),
    };
    plan.variants.iter().map(name).collect::<Vec<_>>().join(", ")
}

fn of_plan(board: &BoardInfo, plan: &PinPlan) -> String {
    let path = path(board, plan);
    let file = path.rsplit('/').next().unwrap_or_default();
    let mut text = format!("Of {}:\n\n![Pins of {}]({file})\n\n", variants(plan), board.name);
    text +=
        "| Pin | Signal | | Where | Function | On an oscilloscope | Note |\n|---|---|---|---|---|---|---|\n";
    for PinGroup { title, pins } in plan.groups {
        text += &format!("| **{title}** | | | | | | |\n");
        for Pin { name, mode, direction, signal, at, note, scope, .. } in *pins {
            let way = match direction {
                PinDirection::In => "in",
                PinDirection::Out => "out",
                PinDirection::Both => "both",
            };
            let mode = match mode {
                PinMode::Alternate(function) => format!("AF{function}"),
                PinMode::Output => "output".to_owned(),
                PinMode::Analog => "analog".to_owned(),
            };
            text += &format!("| {name} | {signal} | {way} | {at} | {mode} | {scope} | {note} |\n");
        }
    }
    text + "\n"
}

/// Returns the rows of groups, including a title each.
fn rows(groups: &[PinGroup]) -> usize {
    groups.iter().map(|group| group.pins.len() + 2).sum()
}

/// Splits the groups to both sides of the chip with about equal rows.
fn sides(groups: &[PinGroup]) -> [&[PinGroup]; 2] {
    let difference = |place: &usize| {
        let (left, right) = groups.split_at(*place);
        rows(left).abs_diff(rows(right))
    };
    let (left, right) = groups.split_at((0..=groups.len()).min_by_key(difference).unwrap_or_default());
    [left, right]
}

fn draw(board: &BoardInfo, plan: &PinPlan) -> Document {
    let sides = sides(plan.groups);
    let height = (sides.map(rows).into_iter().max().unwrap_or_default() + 1) * ROW;
    let [left, right] = CHIP;
    let title = format!("Pins of {}, {}", board.name, variants(plan).replace('`', ""));
    let chip = Rectangle::new()
        .set("x", left)
        .set("y", MARGIN)
        .set("width", right - left)
        .set("height", height)
        .set("rx", 6)
        .set("fill", "#eef2f6")
        .set("stroke", "#56616c");
    let mut document = Document::new()
        .set("viewBox", (0, 0, WIDTH, height + 2 * MARGIN))
        .set("font-family", FONT)
        .set("font-size", 13)
        .add(Title::new(title))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "white"))
        .add(chip)
        .add(text(board.name, usize::midpoint(left, right), MARGIN + height - 10, "middle", "#1d2429"));
    for (groups, is_left) in sides.into_iter().zip([true, false]) {
        let mut y = MARGIN + ROW;
        for PinGroup { title, pins } in groups {
            let (x, anchor) = if is_left { (left - WIRE, "end") } else { (right + WIRE, "start") };
            document = document.add(text(title, x, y, anchor, "#1d2429").set("font-weight", "bold"));
            for pin in *pins {
                y += ROW;
                document = draw_pin(document, pin, is_left, y);
            }
            y += 2 * ROW;
        }
    }
    document
}

fn text(words: &str, x: usize, y: usize, anchor: &str, fill: &str) -> Text {
    Text::new(words).set("x", x).set("y", y).set("text-anchor", anchor).set("fill", fill)
}

fn draw_pin(document: Document, pin: &Pin, is_left: bool, y: usize) -> Document {
    let [left, right] = CHIP;
    let (edge, end, inside, anchor, inner) = match is_left {
        true => (left, left - WIRE + 6, left + 8, "end", "start"),
        false => (right, right + WIRE - 6, right - 8, "start", "end"),
    };
    let outside = if is_left { left - WIRE } else { right + WIRE };
    let color = match pin.mode {
        PinMode::Analog => "#9c5700",
        PinMode::Output => "#1f6f43",
        PinMode::Alternate(_) => "#1f4e79",
    };
    let middle = y - 4;
    let line = |from: (usize, usize), to: (usize, usize)| {
        let line = Line::new().set("x1", from.0).set("y1", from.1).set("x2", to.0).set("y2", to.1);
        line.set("stroke", color).set("stroke-width", 1.5)
    };
    let mut document = document
        .add(line((edge, middle), (end, middle)))
        .add(text(pin.name, inside, y, inner, color).set("font-weight", "bold"))
        .add(text(&format!("{} ({})", pin.signal, pin.at), outside, y, anchor, "#1d2429"));
    // Arrow heads at the chip, the other end, or both.
    let inward = matches!(pin.direction, PinDirection::In | PinDirection::Both);
    let outward = matches!(pin.direction, PinDirection::Out | PinDirection::Both);
    let (behind_edge, before_end) = if is_left { (edge - 7, end + 7) } else { (edge + 7, end - 7) };
    for (is_there, tip, tail) in [(inward, edge, behind_edge), (outward, end, before_end)] {
        for side in [middle - 4, middle + 4].into_iter().filter(|_| is_there) {
            document = document.add(line((tip, middle), (tail, side)));
        }
    }
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_of_a_plan_is_drawn_and_stands_in_the_table() {
        for board in boards::BOARDS {
            for (plan, (path, picture)) in board.tooling.pins.iter().zip(pictures(board)) {
                assert!(section(board).contains(path.rsplit('/').next().unwrap()), "{path}");
                for pin in plan.groups.iter().flat_map(|group| group.pins) {
                    assert!(
                        picture.contains(pin.name) && picture.contains(pin.signal),
                        "{path}: {}",
                        pin.name
                    );
                    assert!(
                        section(board).contains(&format!("| {} | {} |", pin.name, pin.signal)),
                        "{}",
                        pin.name
                    );
                }
            }
        }
    }
}
