//! `dimsart motor`: checks, simulates, identifies and stores the configuration of a drive's motor.

mod board;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use boards::current_loop::identification_failure;
use clap::{Args, Subcommand};
use dimsart_core::ModuleKinds;
use drive::{Configuration, Modulation, MotorEstimate};
use hil_sim::recording::{Column, Recording};

use super::line::{LineOptions, is_port};
use super::output::text_table;
use super::{Ending, UsageError};
use crate::motor::{self, CurrentStepResponse};
use crate::report::{self, Curve, Figure, Panel};

/// Default identification current of a simulated motor.
const SIMULATED_A: f32 = 5.0;
/// Worst-case errors of resistance (heat) and inductance (saturation), as factors.
const SHARES: [(f64, f64); 5] = [(1.0, 1.0), (0.7, 0.7), (0.7, 1.3), (1.3, 0.7), (1.3, 1.3)];

/// Check, identify and store the configuration of a drive's motor.
///
/// A configuration is a TOML file of motor, encoder, joint and limits: docs/drive.md, docs/motor.md.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Motor {
    #[command(subcommand)]
    action: Action,
    #[command(flatten)]
    line: LineOptions,
}

const EXAMPLES: &str = "\
Examples:
  dimsart motor example > motor.toml           an example configuration with comments
  dimsart motor check motor.toml               limits and current-loop step response of motor.toml
  dimsart motor identify motor.toml            identify a simulated motor with these values, at 5 A
  dimsart motor identify motor.toml --friction-nm 1.5
  dimsart motor show /dev/ttyACM0 > motor.toml write the configuration of the board to motor.toml
  dimsart motor set /dev/ttyACM0 motor.toml --restart
                                               store motor.toml on the board, and restart the board
  dimsart motor identify /dev/ttyACM0 --current-a 2 --store";

#[derive(Debug, Subcommand)]
enum Action {
    /// Print an example configuration with comments.
    Example,
    /// Compute the limits of a configuration and simulate a current step.
    ///
    /// Also simulates ±30 % errors in the motor's resistance and inductance. Exit status 1 if the current overshoots by more
    /// than 20 % or does not settle in any of these simulations.
    Check {
        /// Configuration (TOML).
        file: PathBuf,
        /// Folder for the plot of the current step.
        #[arg(long, value_name = "FOLDER", default_value = "runs/motor")]
        out: PathBuf,
    },
    /// Print the motor configuration that a board uses, stored or from its image.
    Show {
        /// Port of the board, such as `/dev/ttyACM0`.
        port: String,
    },
    /// Store a configuration on a board, for its next start.
    ///
    /// Stops the running scheme if the write would delay ticks.
    Set {
        /// Port of the board.
        port: String,
        /// Configuration (TOML).
        file: PathBuf,
        /// Restart the board to use the stored configuration now.
        #[arg(long)]
        restart: bool,
    },
    /// Delete a board's stored configuration: the next start uses the image's configuration.
    Forget {
        /// Port of the board.
        port: String,
        /// Restart the board to use the image's configuration now.
        #[arg(long)]
        restart: bool,
    },
    /// Identify a simulated motor, or a board's motor, which TURNS.
    ///
    /// With a file, identifies a simulated motor with the values of this file. With a port, identifies the board's motor: the
    /// joint must be free to turn, and a scheme must run.
    Identify {
        /// Configuration (TOML), or port of a board.
        source: String,
        /// Peak phase current, A, up to `limits.current_a` (default for a simulated motor: 5).
        #[arg(long, value_name = "AMPERES")]
        current_a: Option<f32>,
        /// Store the identified values on the board, for its next start.
        #[arg(long)]
        store: bool,
        /// Inertia of the simulated rotor and load, kg m², above 0.
        #[arg(long, value_name = "KG_M2", default_value_t = 1e-4)]
        inertia_kg_m2: f64,
        /// Dry friction of the simulated rotor and load, N m.
        #[arg(long, value_name = "NM", default_value_t = 0.0)]
        friction_nm: f64,
    },
}

impl Motor {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let open = |port: &str| self.line.open(port, kinds);
        match self.action {
            Action::Example => {
                write!(out, "{}", motor::EXAMPLE)?;
                Ok(ExitCode::SUCCESS)
            }
            Action::Check { file, out: folder } => check(&motor::read(&file, warn)?, &folder, out),
            Action::Show { port } => board::show(&mut open(&port)?, &port, out),
            Action::Set { port, file, restart } => board::set(&mut open(&port)?, &file, restart, out),
            Action::Forget { port, restart } => board::forget(&mut open(&port)?, restart, out),
            Action::Identify { source, current_a, store, .. } if is_port(&source) => {
                let current_a = current_a.ok_or_else(|| {
                    UsageError(
                        "missing --current-a: give the peak phase current, A, that turns the board's motor"
                            .to_owned(),
                    )
                })?;
                board::identify(&mut open(&source)?, current_a, store, out)
            }
            Action::Identify { store: true, .. } => Err(UsageError(
                "--store applies to boards only: give the port of a board instead of a file".to_owned(),
            )
            .into()),
            Action::Identify { source, current_a, inertia_kg_m2, friction_nm, .. } => {
                let told = motor::read(Path::new(&source), warn)?;
                let current_a = current_a.unwrap_or(SIMULATED_A);
                let found = motor::identify(&told, current_a, inertia_kg_m2, friction_nm)?
                    .map_err(identification_failure)?;
                print_found(&told, &found, "true", out)?;
                Ok(ExitCode::SUCCESS)
            }
        }
    }
}

fn check(told: &Configuration, folder: &Path, out: &mut impl Write) -> Ending {
    print_figures(told, out)?;
    let follows =
        SHARES.map(|(resistance, inductance)| motor::simulate_current_step(told, resistance, inductance));
    let mut found = Vec::new();
    for follow in follows {
        found.push(follow?);
    }
    let mut table = text_table();
    table.set_header(["R factor", "L factor", "overshoot, %", "settling time to 10 %, ms", ""]);
    for ((resistance, inductance), follow) in SHARES.iter().zip(&found) {
        table.add_row([
            format!("{resistance}"),
            format!("{inductance}"),
            format!("{:.1}", 100.0 * follow.overshoot),
            follow.settled_s.map_or("never".to_owned(), |settled_s| format!("{:.2}", 1e3 * settled_s)),
            if follow.is_well_damped() { String::new() } else { "FAILED".to_owned() },
        ]);
    }
    writeln!(out, "{table}")?;
    let (figure, recording) = picture(told, &found);
    let svg = report::write_figure(folder, &figure, &recording)?;
    writeln!(out, "picture: {}", svg.display())?;
    if found.iter().all(CurrentStepResponse::is_well_damped) {
        return Ok(ExitCode::SUCCESS);
    }
    writeln!(
        out,
        "in the FAILED rows (up to ±30 % error of R and L), the current overshoots by more than 20 % or does not settle: \
         reduce bandwidth_rad_per_s"
    )?;
    Ok(ExitCode::FAILURE)
}

fn print_figures(told: &Configuration, out: &mut impl Write) -> std::io::Result<()> {
    let Configuration { motor, limits, bandwidth_rad_per_s, .. } = told;
    let constant = motor.torque_constant_nm_per_a();
    let speed = |bus_v: f32| {
        let free = Modulation::new(told).supply(bus_v).max_v / motor.flux_linkage_vs;
        free / f32::from(motor.pole_pairs)
    };
    let rows = [
        ("torque constant", format!("{constant:.4} N m/A")),
        ("maximum torque", format!("{:.3} N m at {} A", constant * limits.current_a, limits.current_a)),
        (
            "no-load speed",
            format!(
                "{:.0} rad/s at {} V, {:.0} rad/s at {} V",
                speed(limits.min_bus_v),
                limits.min_bus_v,
                speed(limits.max_bus_v),
                limits.max_bus_v
            ),
        ),
        (
            "electrical time constant",
            format!("{:.3} ms", 1e3 * motor.quadrature_inductance_h / motor.resistance_ohm),
        ),
        ("current-loop bandwidth", format!("{:.0} Hz", bandwidth_rad_per_s / std::f32::consts::TAU)),
        (
            "copper loss at maximum torque",
            format!("{:.0} W", 1.5 * motor.resistance_ohm * limits.current_a * limits.current_a),
        ),
    ];
    rows.iter().try_for_each(|(name, value)| writeln!(out, "{name:28} {value}"))
}

/// Plots all steps in one panel.
fn picture(told: &Configuration, found: &[CurrentStepResponse]) -> (Figure, Recording) {
    let label = |(resistance, inductance)| format!("R × {resistance}, L × {inductance}");
    let columns = SHARES.map(|shares| Column {
        source: "motor".to_owned(),
        signal: label(shares),
        indices: Vec::new(),
        unit: String::new(),
        format: None,
    });
    let mut recording = Recording::new(columns.to_vec());
    let periods = found.iter().map(|follow| follow.response.len()).min().unwrap_or(0);
    for (period, time_s) in (0..periods)
        .zip(std::iter::successors(Some(0.0), |time_s| Some(time_s + f64::from(told.inverter.period_s))))
    {
        for (value, follow) in recording.add_row(time_s).iter_mut().zip(found) {
            *value = follow.response.get(period).copied().unwrap_or(f64::NAN);
        }
    }
    let curves = (0..).zip(SHARES).map(|(column, shares)| Curve {
        label: label(shares),
        column,
        subtracted_column: None,
    });
    let panel = Panel {
        title: "q-axis current, rotor locked".to_owned(),
        y_label: "current / step".to_owned(),
        curves: curves.collect(),
        levels: Vec::new(),
    };
    let figure = Figure {
        file_stem: "current_step".to_owned(),
        title: "Current step".to_owned(),
        panels: vec![panel],
        spans: Vec::new(),
    };
    (figure, recording)
}

fn print_found(
    told: &Configuration,
    found: &MotorEstimate,
    beside: &str,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let mut table = text_table();
    table.set_header(["", "found", beside]);
    let motor = &told.motor;
    let digits = |value: f32| format!("{value:.6}");
    for (name, found, truth) in [
        ("resistance_ohm", digits(found.resistance_ohm), digits(motor.resistance_ohm)),
        ("direct_inductance_h", digits(found.direct_inductance_h), digits(motor.direct_inductance_h)),
        (
            "quadrature_inductance_h",
            digits(found.quadrature_inductance_h),
            digits(motor.quadrature_inductance_h),
        ),
        ("pole_pairs", found.pole_pairs.to_string(), motor.pole_pairs.to_string()),
        ("is_encoder_reversed", found.is_encoder_reversed.to_string(), motor.is_encoder_reversed.to_string()),
        ("encoder_offset_rad", digits(found.encoder_offset_rad), digits(motor.encoder_offset_rad)),
    ] {
        table.add_row([name.to_owned(), found, truth]);
    }
    writeln!(out, "{table}")
}

fn warn(key: hil_sim::renamed_keys::RenamedKey) {
    eprintln!("dimsart: warning: {key}");
}
