//! Draws known states: the important content is visible in every size.

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::Color;
use serde_json::{Value, json};

use super::draw::draw;
use super::live::Column;
use super::screen::{Screen, Wish};
use dimsart_core::Format;

const SIZES: [(u16, u16); 3] = [(80, 24), (40, 15), (160, 50)];
const FAULT: &str = "DES_FORCE has no writer: plug in a module that writes it";

fn tell(screen: &mut Screen, kind: &str, content: &Value) {
    screen.hear(0, &json!({ "kind": kind, "station": 0, "content": content }).to_string());
}

fn status(screen: &mut Screen, state: &str, is_commanded: bool) {
    let live = json!({ "ticks": 1234, "is_commanded": is_commanded, "state": state, "holder": null,
        "dropped": 0, "damaged": 0, "silence_s": null });
    tell(screen, "status", &json!({ "live": live, "holder": is_commanded.then_some(0) }));
}

/// Returns a screen with two stations; the first one has a fault.
fn known() -> Screen {
    let mut screen = Screen::new(&["joint", "wrist"], true);
    status(&mut screen, "the device is NOT commanded: the scheme is stopped", false);
    let parameter = |name: &str, value: f64, unit: &str| {
        json!({ "name": name, "values": [value], "unit": unit, "range": "0 to 1000, per axis", "summary": "A gain.",
            "default": 6.0, "choices": [], "is_structural": false })
    };
    let parameters = [parameter("K_PARAM", 150.0, "N·m/rad"), parameter("D_PARAM", 6.0, "N·m·s/rad")];
    tell(
        &mut screen,
        "overview",
        &json!({ "identity": { "sample_period_s": 0.001 },
        "modules": [{ "name": "PIDCTRL_MOD", "place": 1, "parameters": parameters }],
        "signals": [{ "name": "POSITION", "unit": "rad", "values": [0.25] },
            { "name": "DES_FORCE", "unit": "N·m", "values": [1.5, -1.5] }] }),
    );
    tell(
        &mut screen,
        "faults",
        &json!({ "first_fault": null, "drive": "SWITCH ON DISABLED", "cut_out": null,
        "findings": [{ "is_fault": true, "text": FAULT }] }),
    );
    tell(
        &mut screen,
        "events",
        &json!([{ "number": 7, "tick": 12, "what": 3, "name": "STARTED", "text": "" }]),
    );
    screen
}

/// Draws the screen and returns the lines of the terminal.
fn drawn(screen: &Screen, (width, height): (u16, u16)) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, screen)).unwrap();
    let cells = terminal.backend().buffer().content().chunks(width.into());
    cells.map(|line| line.iter().map(ratatui::buffer::Cell::symbol).collect()).collect()
}

/// Joins the words of all lines.
fn words(lines: &[String]) -> String {
    lines.iter().flat_map(|line| line.split_whitespace()).collect::<Vec<_>>().join(" ")
}

fn press(screen: &mut Screen, keys: &str) -> Vec<Wish> {
    let code = |letter| match letter {
        '\n' => KeyCode::Enter,
        '→' => KeyCode::Right,
        '↓' => KeyCode::Down,
        other => KeyCode::Char(other),
    };
    keys.chars().filter_map(|letter| screen.key(KeyEvent::new(code(letter), KeyModifiers::NONE))).collect()
}

#[test]
fn state_fault_and_stop_are_seen_in_every_size() {
    for size in SIZES {
        let text = words(&drawn(&known(), size));
        for wanted in
            ["1 joint", "2 wrist", "NOT commanded: the scheme is stopped", FAULT, "STOP", "no client holds"]
        {
            assert!(text.contains(wanted), "{wanted} is not in {size:?}: {text}");
        }
    }
}

#[test]
fn the_smallest_terminal_is_no_error() {
    for size in [(1, 1), (7, 3), (20, 6)] {
        drawn(&known(), size);
    }
    assert!(words(&drawn(&Screen::new(&[], true), (80, 24))).contains("STOP"));
}

#[test]
fn a_value_has_its_unit_and_its_default_and_is_marked_where_it_differs() {
    let text = words(&drawn(&known(), (160, 50)));
    assert!(text.contains("*K_PARAM 150 N·m/rad 0 to 1000 N·m/rad, per axis, default 6 N·m/rad"), "{text}");
    assert!(text.contains(" D_PARAM 6 N·m·s/rad"), "{text}");
    assert!(!text.contains("*D_PARAM"), "{text}");
    for signal in ["POSITION 0.25 rad", "DES_FORCE[0] 1.5 N·m", "DES_FORCE[1] -1.5 N·m", "7 tick 12 STARTED"]
    {
        assert!(text.contains(signal), "{signal}: {text}");
    }
}

#[test]
fn a_signal_moves_over_the_chart() {
    let mut screen = known();
    let columns = vec![Column { signal: "POSITION".to_owned(), place: 0, format: Format::F32 }];
    let rows = (0..12_000_u32).map(|tick| (tick, vec![f64::from(tick % 1000) * 1e-3]));
    screen.stations[0].live.take(columns, rows);
    let text = words(&drawn(&screen, (80, 24)));
    assert!(text.contains("POSITION 0.9990 rad"), "{text}");
    assert!(text.contains("-10 s"), "{text}");
    let is_braille = |letter: char| ('\u{2801}'..='\u{28ff}').contains(&letter);
    assert!(text.chars().filter(|letter| is_braille(*letter)).count() > 40, "{text}");
}

#[test]
fn a_small_terminal_shows_one_pane_after_the_other() {
    let mut screen = known();
    assert!(words(&drawn(&screen, (40, 15))).contains("*K_PARAM"));
    press(&mut screen, "→");
    let text = words(&drawn(&screen, (40, 15)));
    assert!(text.contains("POSITION 0.25 rad") && !text.contains("*K_PARAM"), "{text}");
}

#[test]
fn without_colours_there_are_none() {
    let has_colour = |has_colours| {
        let mut screen = known();
        screen.has_colours = has_colours;
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        terminal.draw(|frame| draw(frame, &screen)).unwrap();
        let cells = terminal.backend().buffer().content();
        cells.iter().any(|cell| cell.fg != Color::Reset || cell.bg != Color::Reset)
    };
    assert_eq!([true, false].map(has_colour), [true, false]);
}

#[test]
fn arming_is_asked_for_and_only_yes_is_yes() {
    let mut screen = known();
    assert_eq!(press(&mut screen, "a"), []);
    assert!(words(&drawn(&screen, (40, 15))).contains("joint may move: arm?"));
    assert_eq!(press(&mut screen, "n"), []);
    assert_eq!(press(&mut screen, "ay"), [Wish::Arm { station: 0 }]);
    assert_eq!(press(&mut screen, "2ay"), [Wish::Arm { station: 1 }]);
    status(&mut screen, "the scheme runs and commands the device", true);
    screen.at = 0;
    let text = words(&drawn(&screen, (40, 15)));
    assert!(text.contains("1 joint*") && text.contains("ARMED by this terminal"), "{text}");
}

#[test]
fn what_is_armed_is_not_started() {
    let mut screen = known();
    assert_eq!(press(&mut screen, "cr"), [Wish::Check { station: 0 }, Wish::Reset { station: 0 }]);
    status(&mut screen, "the device is NOT commanded: the scheme is stopped", true);
    assert_eq!(press(&mut screen, "c"), []);
    assert!(words(&drawn(&screen, (80, 24))).contains("armed: the device would move at once"));
}

#[test]
fn help_is_whole_and_leaves_the_keys() {
    for size in SIZES {
        let mut screen = known();
        press(&mut screen, "?");
        let text = words(&drawn(&screen, size));
        assert!(text.contains("Space STOPS every station") && text.contains("Space STOP a arm"), "{text}");
        assert!(size.0 < 80 || text.contains("q: disarm and quit."), "{text}");
    }
}

#[test]
fn space_stops_whatever_is_being_typed() {
    for before in ["", "a", "/posi", "\n12", "?"] {
        let mut screen = known();
        press(&mut screen, before);
        assert_eq!(press(&mut screen, " "), [Wish::Stop], "after {before:?}");
    }
    assert_eq!(press(&mut known(), "s"), [Wish::Stop]);
}

#[test]
fn the_parameter_that_is_found_is_edited() {
    let mut screen = known();
    press(&mut screen, "/d_par\n");
    assert!(!words(&drawn(&screen, (80, 24))).contains("*K_PARAM"));
    press(&mut screen, "\n7.5");
    let text = words(&drawn(&screen, (80, 24)));
    assert!(text.contains("PIDCTRL_MOD D_PARAM (0 to 1000 N·m·s/rad, per axis) = 7.5_"), "{text}");
    let set = Wish::Set {
        station: 0,
        module: "PIDCTRL_MOD".to_owned(),
        parameter: "D_PARAM".to_owned(),
        value: "7.5".to_owned(),
    };
    assert_eq!(press(&mut screen, "\n"), [set]);
}

#[test]
fn a_line_that_is_gone_and_motion_that_is_lost_are_told() {
    let mut screen = known();
    tell(&mut screen, "lost", &json!({ "reason": "lease lost" }));
    tell(&mut screen, "gone", &json!("the device closed the line"));
    for size in SIZES {
        let text = words(&drawn(&screen, size));
        assert!(text.contains("NO CONNECTION to the device: the device closed the line"), "{text}");
        assert!(text.contains("1 joint!") && text.contains("joint: lease lost"), "{text}");
    }
    screen.tell("wrist STOP: stopped".to_owned(), false);
    assert!(words(&drawn(&screen, (80, 24))).contains("joint: lease lost"), "an error stays visible");
}
