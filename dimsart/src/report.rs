//! Report of a run: signals as CSV, pictures as SVG, and a page that shows them.
//!
//! ```text
//! folder/report.html ── shows ──▶ positions.svg, forces.svg, ..., timeline.svg
//!                    └─ links ──▶ signals.csv, or signals.mcap; recorder_….csv
//! ```

mod bode;
mod bus_timeline;
mod contour;
mod csv;
mod cycle_bars;
mod decimate;
mod error;
mod facts;
mod field_map;
mod figure;
mod html;
mod mcap;
mod plot;
mod plots;
mod signals;
mod simplify;
mod tick_map;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;
use serde::Serialize;

pub use bode::Bode;
pub use bus_timeline::{BusRow, BusTimeline, Transmission};
pub use contour::{ContourSegment, contour};
pub use cycle_bars::{CycleBar, CycleBars};
pub(crate) use decimate::decimate;
pub use error::ReportError;
pub use facts::{ControllerMetadata, RunMetadata, TimeBase};
pub use field_map::{Boundary, CellValue, SweepMap};
pub use figure::{Curve, Figure, Panel};
pub(crate) use mcap::{
    DEVICE_END, Field as SignalField, INPUTS_DEFINITION, INPUTS_TOPIC, InputsMessage, PacketMessage,
    SCHEME_END, STAMP_BYTES, STAMP_DEFINITION, write as write_mcap,
};
pub use plots::{Level, Span};
pub use signals::{SignalsFile, SignalsFormat, SignalsKind};
pub use tick_map::{TickMap, TypeRow};

use crate::recorder_files::RecorderFile;
use figure::FigurePicture;
use hil_sim::recording::Recording;
use html::PageImage;
use plot::Picture;
use plots::PagePlot;
use tick_map::TimelinePicture;

const PAGE_FILE: &str = "report.html";
const TIMELINE_STEM: &str = "timeline";
const BUS_STEM: &str = "bus";
const CYCLES_STEM: &str = "cycles";
const MAP_STEM: &str = "map";
const BODE_STEM: &str = "bode";

/// Content of a report.
#[derive(Debug)]
pub struct Report<'a> {
    /// Title of the page.
    pub title: String,
    /// Main results.
    pub summary: Vec<SummaryRow>,
    /// Results per axis; hidden without rows.
    pub axes: Table,
    /// Faults, one sentence each; empty for a clean run.
    pub faults: Vec<String>,
    /// Pictures of signals over time, in the order of the page.
    pub figures: Vec<Figure>,
    /// One map per controller, shown together as the Data Base timeline; hidden if empty.
    pub tick_maps: Vec<TickMap>,
    /// Timeline of the simulated buses, if any.
    pub bus: Option<BusTimeline>,
    /// Settings that repeat the run, as TOML.
    pub settings_toml: String,
    /// Signals.
    pub recording: &'a Recording,
    /// File format of the signals.
    pub signals: SignalsKind,
    /// Files of the controllers' recorders.
    pub recorders: Vec<RecorderFile>,
}

/// One row of the summary.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SummaryRow {
    /// Name.
    pub name: String,
    /// Value as text.
    pub value: String,
    /// Unit; empty for a pure number or a word.
    pub unit: String,
    /// Explanation or reference value; may be empty.
    pub note: String,
}

/// A table of text.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Table {
    /// Names of the columns, units included.
    pub header: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
}

/// Files of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportFiles {
    /// The page to open first.
    pub page: PathBuf,
    /// Pictures, in the order of the page.
    pub pictures: Vec<PathBuf>,
    /// One file per recorder.
    pub recorders: Vec<RecorderFile>,
}

/// Checks before a run whether a report can be written to `folder`. Leaves files and folders unchanged.
///
/// # Errors
/// [`ReportError`] names the folder or file and the remedy.
pub fn check_folder_writable(folder: &Path) -> Result<(), ReportError> {
    let is_missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
    let missing: Vec<&Path> = folder.ancestors().take_while(is_missing).collect();
    let result = make_folder(folder).and_then(|()| try_file(folder.join(SignalsKind::Csv.file_name())));
    for made in missing {
        // A folder that could not be created does not exist.
        let _ = fs::remove_dir(made);
    }
    result
}

pub(crate) fn make_folder(folder: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(folder).map_err(|source| ReportError::Folder { path: folder.to_owned(), source })
}

fn try_file(path: PathBuf) -> Result<(), ReportError> {
    let is_new = !path.exists();
    let opened = fs::OpenOptions::new().append(true).create(true).open(&path);
    match opened.and_then(|_| if is_new { fs::remove_file(&path) } else { Ok(()) }) {
        Ok(()) => Ok(()),
        Err(source) => Err(ReportError::File { path, source }),
    }
}

/// Writes `report` to `folder`, next to the [signals](SignalsFile), replacing files of the same names. Creates the folder if
/// it is missing. `bar` counts the written files ([`ProgressBar::hidden`] for no output). Stops soon after `stop` is set.
///
/// # Errors
/// [`ReportError`] names the file and the remedy. Complete files stay.
pub fn write(
    folder: &Path,
    report: &Report<'_>,
    stop: &AtomicBool,
    bar: &ProgressBar,
) -> Result<ReportFiles, ReportError> {
    make_folder(folder)?;
    let images = images(report);
    bar.set_length(1 + images.len() as u64);
    let figures = report.figures.iter().map(|figure| FigurePicture::new(figure, report.recording));
    let figures: Vec<FigurePicture<'_>> = figures.collect();
    let pictures = write_pictures(folder, report, &figures, stop, bar)?;
    let page = folder.join(PAGE_FILE);
    let plots: Vec<PagePlot> = figures.iter().map(FigurePicture::plot).collect();
    let text = html::page(report, &images, &plots).map_err(|error| content(&page, &error))?;
    write_file(page.clone(), text.as_bytes(), bar)?;
    Ok(ReportFiles { page, pictures, recorders: report.recorders.clone() })
}

/// Lists the pictures in the order of the page.
fn images(report: &Report<'_>) -> Vec<PageImage> {
    let figures = report.figures.iter().map(|figure| PageImage {
        stem: figure.file_stem.clone(),
        title: figure.title.clone(),
        alt: figure.description(),
        is_plot: true,
    });
    let timeline = (!report.tick_maps.is_empty()).then(|| PageImage {
        stem: TIMELINE_STEM.to_owned(),
        title: "Data Base timeline".to_owned(),
        alt: tick_map::description(&report.tick_maps),
        is_plot: false,
    });
    let bus = report.bus.as_ref().map(|bus| PageImage {
        stem: BUS_STEM.to_owned(),
        title: "Bus timeline".to_owned(),
        alt: bus.description(),
        is_plot: false,
    });
    figures.chain(bus).chain(timeline).collect()
}

fn write_pictures(
    folder: &Path,
    report: &Report<'_>,
    figures: &[FigurePicture<'_>],
    stop: &AtomicBool,
    bar: &ProgressBar,
) -> Result<Vec<PathBuf>, ReportError> {
    let mut written = Vec::new();
    for (figure, picture) in report.figures.iter().zip(figures) {
        if is_stopped(stop) {
            return Err(ReportError::Stopped { folder: folder.to_owned() });
        }
        written.push(write_picture(folder, &figure.file_stem, picture, bar)?);
    }
    if let Some(bus) = &report.bus {
        written.push(write_picture(folder, BUS_STEM, bus, bar)?);
    }
    if !report.tick_maps.is_empty() {
        let picture = TimelinePicture { maps: &report.tick_maps };
        written.push(write_picture(folder, TIMELINE_STEM, &picture, bar)?);
    }
    Ok(written)
}

/// Writes only one picture of recorded signals to `folder`, created if missing.
///
/// # Errors
/// [`ReportError`] names the file and the remedy.
pub fn write_figure(folder: &Path, figure: &Figure, recording: &Recording) -> Result<PathBuf, ReportError> {
    make_folder(folder)?;
    let picture = FigurePicture::new(figure, recording);
    write_picture(folder, &figure.file_stem, &picture, &ProgressBar::hidden())
}

/// Writes only the picture of a bus to `folder`, created if missing.
///
/// # Errors
/// [`ReportError`] names the file and the remedy.
pub fn write_bus(folder: &Path, bus: &BusTimeline) -> Result<PathBuf, ReportError> {
    make_folder(folder)?;
    write_picture(folder, BUS_STEM, bus, &ProgressBar::hidden())
}

/// Writes only the picture of a tick's cycles to `folder`, created if missing.
///
/// # Errors
/// [`ReportError`] names the file and the remedy.
pub fn write_cycles(folder: &Path, cycles: &CycleBars) -> Result<PathBuf, ReportError> {
    make_folder(folder)?;
    write_picture(folder, CYCLES_STEM, cycles, &ProgressBar::hidden())
}

/// Writes only a frequency response to `folder`, created if missing.
///
/// # Errors
/// [`ReportError`] names the file and the remedy.
pub fn write_bode(folder: &Path, bode: &Bode) -> Result<PathBuf, ReportError> {
    make_folder(folder)?;
    write_picture(folder, BODE_STEM, bode, &ProgressBar::hidden())
}

/// Writes only the map of a sweep to `folder`, created if missing.
///
/// # Errors
/// [`ReportError`] names the file and the remedy.
pub fn write_map(folder: &Path, map: &SweepMap) -> Result<PathBuf, ReportError> {
    make_folder(folder)?;
    write_picture(folder, MAP_STEM, map, &ProgressBar::hidden())
}

fn write_picture(
    folder: &Path,
    stem: &str,
    picture: &impl Picture,
    bar: &ProgressBar,
) -> Result<PathBuf, ReportError> {
    let path = picture_file(folder, stem);
    let text = plot::svg(picture).map_err(|reason| content(&path, &reason))?;
    write_file(path.clone(), text.as_bytes(), bar)?;
    Ok(path)
}

fn picture_file(folder: &Path, stem: &str) -> PathBuf {
    folder.join(format!("{stem}.svg"))
}

fn write_file(path: PathBuf, bytes: &[u8], bar: &ProgressBar) -> Result<(), ReportError> {
    bar.inc(1);
    fs::write(&path, bytes).map_err(|source| ReportError::File { path, source })
}

fn is_stopped(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}

fn content(path: &Path, reason: &impl ToString) -> ReportError {
    ReportError::Content { path: path.to_owned(), reason: reason.to_string() }
}

#[cfg(test)]
mod tests;
