use super::*;
use hil_sim::recording::Column;

/// Never stops the report.
static NEVER: AtomicBool = AtomicBool::new(false);

fn recording() -> Recording {
    let column = |source: &str| Column {
        source: source.into(),
        signal: "POSITION".into(),
        indices: vec![0],
        unit: "m".into(),
        format: None,
    };
    let mut recording = Recording::new(vec![column("master"), column("slave")]);
    for tick in 0..200_u32 {
        let time_s = f64::from(tick) * 1e-3;
        recording.add_row(time_s).copy_from_slice(&[time_s, 2.0 * time_s]);
    }
    recording
}

fn report(recording: &Recording) -> Report<'_> {
    let text = |text: &str| text.to_owned();
    Report {
        title: text("Table 1 <script>alert('x')</script> & friends"),
        summary: vec![SummaryRow {
            name: text("stable"),
            value: text("yes"),
            unit: String::new(),
            note: text("a < b > c \"quoted\""),
        }],
        axes: Table {
            header: vec![text("axis"), text("k_perceived (N/m)")],
            rows: vec![vec![text("0"), text("<1>")]],
        },
        faults: vec![],
        figures: vec![Figure {
            file_stem: text("positions"),
            title: text("Positions"),
            panels: vec![Panel {
                title: text("Axis 0"),
                y_label: text("position (m)"),
                curves: vec![
                    Curve { label: text("master"), column: 0, subtracted_column: None },
                    Curve { label: text("slave"), column: 1, subtracted_column: None },
                ],
                levels: vec![],
            }],
            spans: vec![],
        }],
        tick_maps: vec![TickMap {
            title: text("master"),
            steps: vec![text("frame writes"), text("frame reads")],
            types: vec![],
        }],
        bus: None,
        settings_toml: text("name = \"</pre><b>\""),
        recording,
        signals: SignalsKind::Csv,
        recorders: Vec::new(),
    }
}

#[test]
fn a_folder_that_was_tried_is_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    check_folder_writable(&folder.path().join("new/run")).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let signals = folder.path().join(SignalsKind::Csv.file_name());
    fs::write(&signals, "an older report").unwrap();
    check_folder_writable(folder.path()).unwrap();
    assert_eq!(fs::read_to_string(&signals).unwrap(), "an older report");
    let below = signals.join("run");
    assert!(matches!(check_folder_writable(&below), Err(ReportError::Folder { path, .. }) if path == below));
}

#[test]
fn a_report_that_is_stopped_says_so_and_leaves_no_page() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording();
    let stop = AtomicBool::new(true);
    let error = write(folder.path(), &report(&recording), &stop, &ProgressBar::hidden()).unwrap_err();
    assert!(matches!(error, ReportError::Stopped { .. }), "{error}");
    assert!(!folder.path().join(PAGE_FILE).exists());
}

#[test]
fn everything_said_to_be_written_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recording();
    let bar = ProgressBar::hidden();
    let written = write(&folder.path().join("new/run"), &report(&recording), &NEVER, &bar).unwrap();
    assert_eq!(bar.length(), Some(bar.position()), "the bar ends full");
    assert_eq!(written.pictures.len(), 2);
    for path in written.pictures.iter().chain([&written.page]) {
        assert!(path.metadata().unwrap().len() > 0, "{} is empty", path.display());
    }
    let page = fs::read_to_string(&written.page).unwrap();
    let pictures = written.pictures.iter().map(|path| path.file_name().unwrap().to_str().unwrap());
    for name in pictures.chain([SignalsKind::Csv.file_name()]) {
        assert!(page.contains(&format!("href=\"{name}\"")), "the page does not link {name}");
    }
    let page = page.replace("/*! https://github.com/leeoniya/uPlot (v1.6.32) */", "");
    assert!(!page.contains("://"), "the page loads no external content");
}

#[test]
fn a_run_that_was_stopped_at_once_still_gets_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let empty = Recording::new(vec![]);
    let (signals, _) = SignalsFile::create(folder.path(), &[], SignalsFormat::Csv).unwrap();
    write(folder.path(), &report(&empty), &NEVER, &ProgressBar::hidden()).unwrap();
    assert_eq!(fs::read_to_string(signals.finish().unwrap()).unwrap(), "time_s (s)\n");
}

fn page(report: &Report<'_>) -> String {
    let plots = report.figures.iter().map(|figure| FigurePicture::new(figure, report.recording).plot());
    html::page(report, &images(report), &plots.collect::<Vec<_>>()).unwrap()
}

#[test]
fn text_from_outside_cannot_become_markup() {
    let recording = recording();
    let mut report = report(&recording);
    report.faults = vec!["axis 0 <img src=x>".to_owned(), "axis 1".to_owned()];
    let page = page(&report);
    for markup in ["<script>alert", "<img src=x>", "</pre><b>", "<1>", "a < b"] {
        assert!(!page.contains(markup), "`{markup}` is not escaped");
    }
    assert!(page.contains("axis 0 &lt;img src=x&gt;"));
    assert!(page.contains("2 faults"));
}

#[test]
fn a_clean_run_says_so() {
    let recording = recording();
    let report = report(&recording);
    let page = page(&report);
    assert!(page.contains("no faults"));
    assert!(!page.contains("class=\"faults\""));
}

#[test]
fn a_folder_that_cannot_be_made_is_named_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("occupied");
    fs::write(&file, "a regular file").unwrap();
    let below = file.join("run");
    let recording = recording();
    let error = write(&below, &report(&recording), &NEVER, &ProgressBar::hidden()).unwrap_err();
    assert!(matches!(&error, ReportError::Folder { path, .. } if *path == below));
    let message = error.to_string();
    assert!(message.starts_with(&format!("cannot create {}: ", below.display())), "{message}");
    assert!(message.ends_with("choose another folder"), "{message}");
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let occupied = folder.path().join("timeline.svg");
    fs::create_dir(&occupied).unwrap();
    let recording = recording();
    let error = write(folder.path(), &report(&recording), &NEVER, &ProgressBar::hidden()).unwrap_err();
    assert!(matches!(&error, ReportError::File { path, .. } if *path == occupied), "{error}");
    assert!(folder.path().join("positions.svg").exists(), "files written before stay");
}
