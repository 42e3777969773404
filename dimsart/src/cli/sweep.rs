//! `dimsart sweep`: runs a grid of settings and draws a map of the results.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::Args;
use dimsart_core::ModuleKinds;
use indicatif::ProgressBar;
use serde::Serialize;

use super::Ending;
use super::output::say;
use super::run::{stop_on_interrupt, style};
use crate::report;
use crate::rig_argument;
use crate::sweep::{self, Grid, GridAxis, Shard, SweepFile, SweepTable, map};

/// Run a grid of settings on all cores, and write a CSV and a map.
///
/// The map shows one figure over two settings, with two stability borders: the largest eigenvalue of the loop reaches 1, and
/// the border of theory (docs/delay.md). Without --vary, runs the shipped stability map.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Sweep {
    /// Rig file, file of settings, or shipped rig such as `joint` (default: bilateral).
    file: Option<PathBuf>,
    /// Setting to vary, with its values; repeatable.
    ///
    /// `KEY=A,B,C`, `KEY=FROM:TO:STEP` or `KEY=log:FROM:TO:COUNT`; `KEY+KEY=...` sets several keys to the same value. Default:
    /// round-trip time and wall stiffness, for the stability map.
    #[arg(long = "vary", value_name = "KEY=VALUES")]
    vary: Vec<GridAxis>,
    /// Change a setting of all points, such as `dof=1`; repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder of `sweep.csv` and the map; an interrupted sweep in this folder is continued.
    #[arg(long, value_name = "FOLDER", default_value = "runs/sweep")]
    out: PathBuf,
    /// Run only part NUMBER of COUNT and write a separate file, to divide a sweep among machines.
    #[arg(long, value_name = "NUMBER/COUNT")]
    shard: Option<Shard>,
    /// Merge all shards in the folder --out into `sweep.csv`, without running points.
    #[arg(long, conflicts_with = "shard")]
    merge: bool,
    /// Figure shown in the map, by the name of a column of the CSV file.
    #[arg(long, value_name = "FIGURE", default_value = "stable")]
    map: String,
    /// Print the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Result, as JSON.
#[derive(Serialize)]
struct Done<'a> {
    /// File of all rows.
    file: &'a Path,
    /// Points in the file, and in the grid.
    points: usize,
    of: usize,
    /// The picture; none for a shard or a single key.
    map: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  dimsart sweep                          stability of the bilateral loop: round-trip time up to 1 s, wall up to 1e5 N/m
  dimsart sweep joint --vary device.joint.axis.0.plant.load.inertia=log:0.01:1:9 --map axes.0.overshoot
  dimsart sweep joint --vary device.joint.delay_ticks=0:3:0.25 --shard 3/16      on machine 3 of 16
  dimsart sweep joint --vary device.joint.delay_ticks=0:3:0.25 --merge           merge the shards afterwards

Each row is written as soon as its point is computed. The same command continues an interrupted sweep if the settings are
unchanged (settings.toml). With Slurm:
  sbatch --array=1-16 --wrap 'dimsart sweep ... --shard $SLURM_ARRAY_TASK_ID/16'";

const WHOLE_FILE: &str = "sweep.csv";
/// Settings common to all points.
const SETTINGS_FILE: &str = "settings.toml";

/// Default grid: a weakly damped loop over its round trip and the stiffness of the wall.
const STABILITY_MAP: [&str; 2] = [
    "wall.stiffness_n_per_m=log:1e4:1e5:21",
    "link.forward_delay_ticks+link.backward_delay_ticks=1,2,3,5,7,10,15,20,30,50,70,100,150,200,300,400,500",
];
const STABILITY_SETTINGS: [&str; 7] = [
    "dof=1",
    "master.time_delay_ticks=0",
    "slave.time_delay_ticks=0",
    "hand.damping_n_s_per_m=0.5",
    "slave.device.mass_kg=0.05",
    "slave.device.damping_n_s_per_m=2",
    "wall.damping_n_s_per_m=0",
];

impl Sweep {
    pub(super) fn execute(mut self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        if self.vary.is_empty() && self.file.is_none() {
            self.vary = STABILITY_MAP.iter().map(|values| values.parse()).collect::<Result<_, _>>()?;
            self.sets.splice(0..0, STABILITY_SETTINGS.map(str::to_owned));
            let settings = self.sets.iter().flat_map(|set| ["--set", set]);
            let vary = STABILITY_MAP.iter().flat_map(|values| ["--vary", values]);
            let words: Vec<&str> = vary.chain(settings).collect();
            say(self.json, out, |text| {
                writeln!(text, "shipped stability map: dimsart sweep {}\n", words.join(" "))
            })?;
        }
        let grid = Grid::new(self.vary.clone())?;
        if self.merge {
            return self.merge(&grid, out);
        }
        let rig = |settings: &[String]| {
            rig_argument::read(self.file.as_deref(), &[self.sets.as_slice(), settings].concat(), kinds)
        };
        sweep::check(rig, &grid)?;
        report::make_folder(&self.out)?;
        // A file that only the grid completes has no settings to compare.
        if let Ok(file) = rig(&[]) {
            self.keep_settings(&file.to_toml())?;
        }
        let shard = self.shard.unwrap_or(Shard::WHOLE);
        let name = match self.shard {
            Some(Shard { number, of }) => format!("sweep-{number}-of-{of}.csv"),
            None => WHOLE_FILE.to_owned(),
        };
        let rows = self.out.join(name);
        let mut file = SweepFile::open(&rows, &grid)?;
        let count = shard.points(&grid).count();
        let todo = shard.points(&grid).filter(|point| !file.has(&grid.values(*point))).count();
        let bar = ProgressBar::new(count as u64);
        bar.set_style(style("sweeping   [{bar:40}] {pos}/{len} points, {eta} left"));
        bar.set_position((count - todo) as u64);
        let stop = stop_on_interrupt()?;
        let swept = sweep::sweep(rig, &grid, shard, &mut file, &stop, || bar.inc(1));
        let was_stopped = stop.swap(false, Ordering::Relaxed);
        bar.finish_and_clear();
        swept?;
        let points = file.len().min(count);
        say(self.json, out, |text| {
            writeln!(text, "{}: {points} of {count} points", rows.display())?;
            if was_stopped {
                writeln!(text, "sweep interrupted: repeat the command to continue")
            } else {
                Ok(())
            }
        })?;
        let map = match self.shard {
            Some(_) => None,
            None => self.finish(&grid, SweepTable::read(&rows)?.0, out)?,
        };
        self.tell(&Done { file: &rows, points, of: count, map }, out)
    }

    /// Writes the common settings; existing rows must have the same settings.
    fn keep_settings(&self, settings_toml: &str) -> Result<(), String> {
        let path = self.out.join(SETTINGS_FILE);
        match std::fs::read_to_string(&path) {
            Ok(text) if text == settings_toml => Ok(()),
            Ok(_) => Err(format!(
                "{}: the settings of this folder differ from the settings of this sweep: give another folder with --out, or \
                 delete this folder",
                path.display()
            )),
            Err(_) => std::fs::write(&path, settings_toml)
                .map_err(|error| format!("cannot write {}: {error}", path.display())),
        }
    }

    fn tell(&self, done: &Done<'_>, out: &mut impl Write) -> Ending {
        if self.json {
            writeln!(out, "{}", serde_json::to_string(done)?)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn merge(&self, grid: &Grid, out: &mut impl Write) -> Ending {
        let unreadable = |error| {
            format!(
                "cannot read the folder {}: {error}; give the folder of the shards with --out",
                self.out.display()
            )
        };
        let mut paths: Vec<PathBuf> = std::fs::read_dir(&self.out)
            .map_err(unreadable)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .collect();
        paths.retain(|path| {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            name.starts_with("sweep-") && name.ends_with(".csv")
        });
        paths.sort();
        let mut merged: Option<SweepTable> = None;
        for path in &paths {
            let (table, _) = SweepTable::read(path)?;
            match &mut merged {
                None => merged = Some(table),
                Some(merged) => merged.merge(table, grid.axes().len()).map_err(|_| {
                    format!(
                        "{}: columns differ from the first shard: remove this file of another sweep from the folder",
                        path.display()
                    )
                })?,
            }
        }
        let merged = merged.ok_or_else(|| {
            format!(
                "no sweep-N-of-M.csv found in {}: run the shards first, or give their folder with --out",
                self.out.display()
            )
        })?;
        let (points, of) = (merged.rows.len(), grid.points());
        say(self.json, out, |text| writeln!(text, "{points} of {of} points from {} shards", paths.len()))?;
        let map = self.finish(grid, merged, out)?;
        self.tell(&Done { file: &self.out.join(WHOLE_FILE), points, of, map }, out)
    }

    /// Writes the rows in order, and the map if there is more than one key.
    fn finish(
        &self,
        grid: &Grid,
        mut table: SweepTable,
        out: &mut impl Write,
    ) -> Result<Option<PathBuf>, Box<dyn std::error::Error>> {
        table.sort(grid);
        table.write(&self.out.join(WHOLE_FILE))?;
        if grid.axes().len() < 2 {
            return Ok(None);
        }
        let map = map(grid, &table, &self.map).ok_or_else(|| {
            let known = table.header.iter().skip(grid.axes().len()).cloned().collect::<Vec<_>>();
            let near = hil_sim::schemes::suggestion(&self.map, &known);
            format!("--map {}: unknown column; {near}. All rows are saved in {WHOLE_FILE}", self.map)
        })?;
        let svg = report::write_map(&self.out, &map)?;
        say(self.json, out, |text| writeln!(text, "map: {}", svg.display()))?;
        Ok(Some(svg))
    }
}
