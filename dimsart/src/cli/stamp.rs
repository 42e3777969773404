//! `dimsart stamp`: writes the costs of modules and the start-up scheme into an image.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use std::{env, fs};

use clap::Args;
use dimsart_core::limits::MAX_DOF;
use dimsart_core::online::Opcode;
use dimsart_core::{Cost, KindId, ModuleKinds};
use dimsart_link::saved_scheme::{self, SchemeBytes};
use serde::Serialize;

use super::Ending;
use super::output::say;
use crate::budget::{Budget, share};
use crate::cycles::{Firmware, ImageCosts, Memory, name_of, runs_laws};
use crate::stamp::StampedImage;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::schemes::{self, SchemeText, device};

/// Write module costs and the start-up scheme into a firmware image.
///
/// The costs are upper bounds, in cycles, computed from this image. The board uses the costs to refuse schemes whose tick
/// would exceed the limit. If the image changed, the costs are recomputed. An unstamped image does not limit the tick time.
/// Each build of an image removes the stamp (docs/cycles.md).
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Stamp {
    /// Firmware image (ELF; default: built by `cargo board BOARD`).
    elf: Option<PathBuf>,
    /// Side of the scheme.
    #[arg(long, default_value = "master", value_parser = super::side::side())]
    side: &'static str,
    /// Scheme file or built-in scheme (default: scheme of the image).
    #[arg(long, value_name = "FILE")]
    scheme: Option<String>,
    /// Limit of a tick in per cent of its period, 1 to 100 (default: limit of the board).
    #[arg(long, value_name = "PERCENT", value_parser = clap::value_parser!(u32).range(1..=100))]
    tick_percent: Option<u32>,
    /// Memory from which the image runs (default: code memory of the board).
    #[arg(long)]
    memory: Option<Memory>,
    /// Output file (default: the image itself).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the stamp as one JSON object.
    #[arg(long)]
    json: bool,
}

/// The stamp, as JSON.
#[derive(Serialize)]
struct Stamped<'a> {
    image: &'a Path,
    scheme: &'a str,
    side: &'static str,
    /// Limit of a tick, cycles.
    limit_cycles: u32,
    memory: &'static str,
    compiler: String,
    /// Modules without a bound, which the board refuses, with the reasons.
    unknown: &'a [(String, String)],
}

const EXAMPLES: &str = "\
Examples:
  dimsart stamp                                      stamp the image built last, for side master
  dimsart stamp firmware.elf --side slave --out slave.elf
  dimsart stamp firmware.elf --scheme my.scheme      set another scheme, without a rebuild
  dimsart stamp firmware.elf --tick-percent 30       limit a tick to 30 % of its period";

impl Stamp {
    pub(super) fn execute(self, kinds: ModuleKinds, out: &mut impl Write) -> Ending {
        let firmware = Firmware::find(self.elf.as_deref(), None)?;
        let board = firmware.board().ok_or_else(|| {
            format!(
                "image `{}` is for an unknown board: build an image with `cargo board BOARD`",
                firmware.name
            )
        })?;
        let budget = Budget::of(board.name)?;
        let mut image = StampedImage::read(&firmware.path)?;
        let scheme = self.scheme.unwrap_or_else(|| format!("builtin:{}", image.scheme_name()));
        image.set_scheme(name(&scheme), self.side, &saved(&scheme, self.side, kinds)?)?;
        let memory = self.memory.unwrap_or_else(|| firmware.memory());
        let start = Instant::now();
        let costs = costs(&firmware, &image, memory, kinds)?;
        let limit = share(budget.period_cycles(), self.tick_percent.unwrap_or(budget.tick_percent));
        image.set_costs(&costs.lines, memory.name(), limit)?;
        let path = self.out.unwrap_or(firmware.path);
        image.write(&path)?;
        let (side, memory, compiler) = (self.side, memory.name(), image.compiler());
        say(self.json, out, |out| {
            writeln!(
                out,
                "{}: scheme {scheme} for the {side}, limit of a tick {limit} cycles (memory {memory}), costs for rustc \
                 {compiler} computed in {:.0} s",
                path.display(),
                start.elapsed().as_secs_f32()
            )?;
            let mut refused: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
            for (kind, reason) in &costs.unknown {
                refused.entry(reason).or_default().push(kind);
            }
            refused.iter().try_for_each(|(reason, kinds)| {
                writeln!(
                    out,
                    "  modules without a bound, which the board refuses ({reason}): {}",
                    kinds.join(", ")
                )
            })
        })?;
        if self.json {
            let (image, scheme, unknown) = (path.as_path(), scheme.as_str(), costs.unknown.as_slice());
            let stamped = Stamped { image, scheme, side, limit_cycles: limit, memory, compiler, unknown };
            writeln!(out, "{}", serde_json::to_string(&stamped)?)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Name of a scheme in a stamp: of a built-in scheme its name, which a later stamp reads, else the file name.
fn name(scheme: &str) -> &str {
    let file = Path::new(scheme).file_name().and_then(|name| name.to_str()).unwrap_or(scheme);
    scheme.strip_prefix("builtin:").unwrap_or(file)
}

/// Encodes the rows of a scheme for one side, for a device with the maximum number of axes.
fn saved(
    scheme: &str,
    side: &'static str,
    kinds: ModuleKinds,
) -> Result<SchemeBytes, Box<dyn std::error::Error>> {
    let text = SchemeText::read(scheme)?;
    let device = device(side, MAX_DOF, SAMPLE_PERIOD_S)?;
    let mut dimsart = SimulatedDimsart::new(device, kinds).map_err(dimsart_core::CommandError::from)?;
    let loaded = schemes::load(&text, side, &[], &mut dimsart);
    if !loaded.is_valid() {
        let problems: Vec<String> = loaded.problems().collect();
        return Err(
            format!("scheme {scheme} does not run on the {}:\n  {}", side, problems.join("\n  ")).into()
        );
    }
    let bytes = saved_scheme::save(dimsart.engine_mut());
    Ok(bytes.map_err(|_| format!("scheme {scheme} is too long for an image: remove rows from the scheme"))?)
}

const SAMPLE_PERIOD_S: f64 = 1e-3;

/// Returns the costs of the image's modules, from the file IMAGE.costs if it is current, else computed and stored there.
fn costs(
    firmware: &Firmware,
    image: &StampedImage,
    memory: Memory,
    kinds: ModuleKinds,
) -> Result<ImageCosts, Box<dyn std::error::Error>> {
    let file = firmware.path.with_added_extension("costs");
    let (key, ids) = (key(image, memory)?, image.kinds());
    let names = names(&ids, kinds);
    if let Some(known) = fs::read_to_string(&file).ok().and_then(|text| read(&text, &key, &names)) {
        return Ok(known);
    }
    let costs = ImageCosts::of(firmware, memory.upper(), &ids, kinds)?;
    fs::write(&file, text(&costs, &key, &names))
        .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    Ok(costs)
}

/// Hash of all inputs of the costs: the image, the memory and this program.
fn key(image: &StampedImage, memory: Memory) -> Result<String, Box<dyn std::error::Error>> {
    let mut hasher = DefaultHasher::new();
    image.without_stamp().hash(&mut hasher);
    memory.name().hash(&mut hasher);
    fs::read(env::current_exe()?)?.hash(&mut hasher);
    Ok(format!("{:016x}", hasher.finish()))
}

/// Names of the cost lines of an image with these kinds, in order; with instructions if it runs laws.
fn names(ids: &[KindId], kinds: ModuleKinds) -> Vec<String> {
    let opcodes: &[Opcode] = if runs_laws(ids) { Opcode::ALL } else { &[] };
    let instructions = opcodes.iter().map(|opcode| opcode.name().to_owned());
    let modules = ids.iter().map(|id| name_of(*id, kinds));
    std::iter::once("tick".to_owned()).chain(modules).chain(instructions).collect()
}

/// A line for each cost: name, cycles, cycles per axis, why they are unknown.
fn text(costs: &ImageCosts, key: &str, names: &[String]) -> String {
    let reason = |name: &str| costs.unknown.iter().find(|(kind, _)| kind == name).map(|(_, reason)| reason);
    let line = |(name, cost): (&String, &Cost)| {
        let ((offset, per_dof), reason) = (cost.coefficients(), reason(name).map_or("", String::as_str));
        format!("{name} {offset} {per_dof} {}\n", reason.replace('\n', " "))
    };
    format!("{key}\n{}", names.iter().zip(&costs.lines).map(line).collect::<String>())
}

/// Parses costs; none if the key differs.
fn read(text: &str, key: &str, names: &[String]) -> Option<ImageCosts> {
    let lines = text.strip_prefix(key)?.strip_prefix('\n')?;
    let mut costs = ImageCosts::default();
    for (name, line) in names.iter().zip(lines.lines()) {
        let [found, offset, per_dof, reason] = line.splitn(4, ' ').collect::<Vec<_>>().try_into().ok()?;
        let cost = Cost::new(offset.parse().ok()?, per_dof.parse().ok()?);
        if cost == Cost::UNKNOWN && !reason.is_empty() {
            costs.unknown.push((found.to_owned(), reason.to_owned()));
        }
        costs.lines.push(cost);
        (found == name).then_some(())?;
    }
    (costs.lines.len() == names.len() && lines.lines().count() == names.len()).then_some(costs)
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;

    #[test]
    fn costs_are_kept_for_the_same_key_alone() {
        let names = names(&["PCTRL_MOD", "ONLINE_MOD"].map(KindId::from_name), ALL);
        let mut lines: Vec<Cost> = names.iter().map(|_| Cost::new(100, 10)).collect();
        lines[1] = Cost::UNKNOWN;
        let unknown = vec![("PCTRL_MOD".to_owned(), "no bound: why".to_owned())];
        let costs = ImageCosts { lines, unknown };
        let kept = text(&costs, "1f", &names);
        assert_eq!(read(&kept, "1f", &names), Some(costs));
        assert_eq!(read(&kept, "2f", &names), None);
        assert_eq!(read(&kept.replace("tick 100", "tock 100"), "1f", &names), None);
        assert_eq!(read(kept.trim_end().rsplit_once('\n').unwrap().0, "1f", &names), None);
    }

    #[test]
    fn a_scheme_that_does_not_run_is_not_stamped() {
        assert!(!saved("builtin:bilateral", "slave", ALL).unwrap().is_empty());
        let message = saved("builtin:table1", "slave", ALL).unwrap_err().to_string();
        assert!(message.contains("does not run on the slave"), "{message}");
    }
}
