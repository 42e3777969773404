//! `dimsart connect PORT capture`.

use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::{ArgGroup, Args, value_parser};

use super::Device;
use super::answer::{Json, write_recorded};
use crate::cli::line::seconds;
use crate::cli::run::stop_on_interrupt;
use crate::connect::{Capture, Captured};

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("edge").required(true).args(["above", "below"]))]
pub(super) struct CaptureArguments {
    /// Signal, such as `POSITION`.
    signal: String,
    /// Trigger when the signal rises above LEVEL, in its unit.
    #[arg(long, value_name = "LEVEL", allow_negative_numbers = true)]
    above: Option<f32>,
    /// Trigger when the signal falls below LEVEL, in its unit.
    #[arg(long, value_name = "LEVEL", allow_negative_numbers = true)]
    below: Option<f32>,
    /// Index of the value in the signal, from 0: the axis, or row by row in a matrix.
    #[arg(long, value_name = "PLACE", default_value_t = 0)]
    word: u32,
    /// Rows to record before the edge.
    #[arg(long, value_name = "ROWS", default_value_t = 100, value_parser = value_parser!(u32).range(..=30_000))]
    before: u32,
    /// Rows to record after the edge.
    #[arg(long, value_name = "ROWS", default_value_t = 100, value_parser = value_parser!(u32).range(..=29_999))]
    after: u32,
    /// Ticks per recorded row; the edge is checked in every tick.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = value_parser!(u32).range(1..=1_000_000))]
    every_ticks: u32,
    /// Maximum time to wait for the edge, s (default: until Ctrl-C).
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    wait_s: Option<Duration>,
    /// Write the rows to this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Captures rows around an edge. Without an edge, returns an error.
pub(super) fn capture(
    arguments: CaptureArguments,
    device: &mut Device,
    json: &Json,
    out: &mut impl Write,
) -> Result<bool, Box<dyn Error>> {
    let CaptureArguments { signal, above, below, word, before, after, every_ticks, wait_s, out: file } =
        arguments;
    let capture = Capture {
        signal,
        word,
        level: above.or(below).unwrap_or_default(),
        is_falling: below.is_some(),
        rows_before: before,
        rows_after: after,
        every_ticks,
    };
    let (stop, start) = (stop_on_interrupt()?, Instant::now());
    eprintln!("dimsart: waiting for an edge of {}", capture.signal);
    let is_over = || stop.load(Ordering::Relaxed) || wait_s.is_some_and(|wait| start.elapsed() >= wait);
    let Captured { recorded, stays } = device.capture(&capture, is_over)?;
    if let Some(stays) = stays {
        eprintln!("dimsart: note: {stays}");
    }
    match recorded {
        Some(recorded) => {
            write_recorded(&recorded, file.as_deref(), json, out)?;
            Ok(true)
        }
        None => Err(format!(
            "no edge of {}: correct --above or --below, or wait longer (--wait-s)",
            capture.signal
        )
        .into()),
    }
}
