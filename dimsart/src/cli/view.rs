//! `dimsart view`: shows recordings in the scope of the page.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use clap::Args;
use dimsart_core::ModuleKinds;

use super::Ending;
use super::run::stop_on_interrupt;
use super::serve::page_listener;
use crate::page::{Page, Recording};

/// Show recordings in the scope of the web page.
///
/// The first recording is shown; further recordings are drawn as dashed traces, aligned at their start. If a recording
/// contains controller inputs, it is replayed, and the first difference is marked in the plots.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct View {
    /// Recordings (MCAP) of `dimsart run --signals mcap`, `serve --record`, `record` or the page.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// TCP port of the page on this computer (default: 8060; 0: any free port).
    #[arg(long, value_name = "PORT")]
    page_port: Option<u16>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart view runs/latest/signals.mcap                    one recording
  dimsart view runs/page/joint-1/signals.mcap runs/page/joint-2/signals.mcap     compare two recordings";

/// Interval of checks for Ctrl-C.
const A_MOMENT: Duration = Duration::from_millis(100);

impl View {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let stop = stop_on_interrupt()?;
        let recordings: Result<_, _> = self.files.iter().map(|file| Recording::open(file, kinds)).collect();
        let page = Page::view(recordings?, kinds, page_listener(self.page_port)?)?;
        writeln!(out, "page: {} (until Ctrl-C)", page.url())?;
        out.flush()?;
        while !stop.load(Ordering::Relaxed) {
            thread::sleep(A_MOMENT);
        }
        Ok(ExitCode::SUCCESS)
    }
}
