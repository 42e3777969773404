//! `dimsart modules`: the list of modules, and one with its ports and parameters.

mod cost;

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use dimsart_core::scheme::switch;
use dimsart_core::{
    Accepts, AxisKind, Direction, Engine, Kind, Kinds, ModuleRef, Parameter, ParameterText, PortSpec,
    ProvidedMemory, Unit, UnitRelation, Value, Word,
};
use dimsart_modules::{GROUPS, group_of};
use serde::Serialize;

use self::cost::KindCost;
use super::Ending;
use super::output::text_table;
use crate::connect::range_text;
use hil_sim::schemes::device;
use hil_sim::schemes::suggestion;

/// List the modules, or show one with its ports, parameters, units and ranges.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Modules {
    /// A module, such as `PDCTRL_MOD`, or a group of them, such as `filters`.
    name: Option<String>,
    /// Prints a page of Markdown, as `docs/modules.md` is one.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Shows what they cost by the stamp of a firmware image (ELF), in place of nucleo-g474re's.
    #[arg(long, value_name = "FILE", conflicts_with = "markdown")]
    image: Option<PathBuf>,
    /// Prints a JSON list of the modules, and nothing else.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
In a scheme:
  all  PDCTRL_MOD    K_PARAM        3000           sets a parameter, on every axis
  all  PDCTRL_MOD    K_PARAM[0]     1000           sets it on axis 0 alone
  all  SUM_MOD       PORT_A         DES_FORCE      binds a port to another type of the same unit and shape
  all  MOD_ENG       MOD_ON         PDCTRL_MOD     plugs the module in
  all  MOD_ENG       MOD_ON         PDCTRL_MOD.2   plugs a second one in";

/// Head of the page.
const MARKDOWN_HEAD: &str = "\
# The modules

Written by `dimsart modules --markdown > docs/modules.md`, from what the modules say of themselves: change a module
and run it again. Ports can be bound to other data types of the same unit, format and shape (`PORT_NAME TYPE` in a
scheme); `any` is every one.

Cycles are what a module adds to a tick at most on nucleo-g474re, whose tick runs from CCM SRAM: bounds of the machine code
([cycles.md](cycles.md)), by `cargo xtask write module-costs`. `dimsart modules --image FILE` shows those of an image that is
stamped. Bytes are those of the Data Base. Both are without axes, and for each axis.

Every module but the ends of links takes `EVERY_TICKS`, too: 1 (the default), 2, 4, 5, 10, 20, 50 or 100, while it is
unplugged ([commands.md](commands.md#modules-that-do-not-run-in-every-tick)).
";

const PORTS_OF_A_LAW: &str = "Its law adds a port for each input and output.";

/// What a module says of itself.
#[derive(Serialize)]
struct Description {
    name: &'static str,
    /// The feature that leaves it out of an image; empty for one that every image has.
    group: &'static str,
    summary: &'static str,
    ports: Vec<PortRow>,
    /// Parameters that add a port for each type they are given.
    port_lists: Vec<&'static str>,
    /// Whether its ports are those of a law that it is given.
    has_ports_of_a_law: bool,
    parameters: Vec<ParameterRow>,
    /// Memory that an instance takes without axes, and for each.
    bytes: usize,
    bytes_per_axis: usize,
    #[serde(flatten)]
    cost: KindCost,
}

/// A port and what it is bound to at first.
#[derive(Serialize)]
struct PortRow {
    name: &'static str,
    /// `reads` or `writes`.
    direction: &'static str,
    signal: &'static str,
    unit: String,
    format: String,
    shape: String,
}

impl PortRow {
    const HEADER: [&str; 5] = ["port", "reads or writes", "unit", "format", "shape"];

    fn cells(&self) -> [String; 5] {
        let Self { name, direction, signal, unit, format, shape } = self;
        [(*name).to_owned(), format!("{direction} {signal}"), unit.clone(), format.clone(), shape.clone()]
    }
}

/// A parameter.
#[derive(Serialize)]
struct ParameterRow {
    name: &'static str,
    unit: String,
    range: String,
    default: String,
    meaning: &'static str,
    only_while_unplugged: bool,
}

impl ParameterRow {
    const HEADER: [&str; 5] = ["parameter", "unit", "range", "default", "meaning"];

    fn cells(&self) -> [String; 5] {
        let Self { name, unit, range, default, meaning, only_while_unplugged } = self;
        let when = if *only_while_unplugged { " Only while unplugged." } else { "" };
        [(*name).to_owned(), unit.clone(), range.clone(), default.clone(), format!("{meaning}{when}")]
    }
}

/// A table, its head first.
type Rows<const COLUMNS: usize> = Vec<[String; COLUMNS]>;

impl Modules {
    pub(super) fn execute(self, kinds: Kinds, out: &mut impl Write) -> Ending {
        let names = kinds.list().iter().map(|kind| kind.name);
        let names: Vec<String> =
            names.chain(GROUPS.iter().map(|(name, _)| *name)).map(str::to_owned).collect();
        if let Some(name) = &self.name
            && !names.contains(name)
        {
            let capitals = name.to_uppercase();
            let within: Vec<_> = names.iter().filter(|known| known.contains(&capitals)).cloned().collect();
            let near = match within.is_empty() {
                true => suggestion(name, &names),
                false => format!("there is {}", within.join(", ")),
            };
            return Err(format!("there is no module or group '{name}'; {near}").into());
        }
        if self.markdown && self.name.is_none() {
            write!(out, "{MARKDOWN_HEAD}")?;
        }
        let mut engine = Engine::new(ProvidedMemory::leaked(), device("device", 1, 1e-3)?, kinds);
        let is_wanted =
            |kind: &Kind| self.name.as_deref().is_none_or(|name| [kind.name, group(kind)].contains(&name));
        let wanted = kinds.list().iter().filter(|kind| is_wanted(kind));
        let costs = self.image.as_deref().map(KindCost::of_image).transpose()?;
        let cost = |kind: &Kind| match &costs {
            Some(costs) => costs.get(&kind.id).cloned().unwrap_or_default(),
            None => KindCost::of_board(kind.name),
        };
        let described = wanted.map(|kind| Description::new(&mut engine, kind, cost(kind)));
        let mut descriptions: Vec<Description> = described.collect();
        // In the order of the list within a group.
        descriptions.sort_by_key(|description| description.group);
        if self.json {
            writeln!(out, "{}", serde_json::to_string(&descriptions)?)?;
            return Ok(ExitCode::SUCCESS);
        }
        if descriptions.len() > 1 {
            let list = rows(Description::HEADER, descriptions.iter().map(Description::cells));
            if self.markdown { markdown_table(out, &list) } else { print_table(out, &list) }?;
        }
        if self.markdown {
            descriptions.iter().try_for_each(|description| description.markdown(out))?;
        } else if let [one] = descriptions.as_slice() {
            one.print(out)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The group of a kind; empty for one of a project.
fn group(kind: &Kind) -> &'static str {
    group_of(kind.id).unwrap_or_default()
}

impl Description {
    const HEADER: [&str; 5] =
        ["group", "module", "what it does", "cycles, for each axis", "bytes, for each axis"];

    fn new(engine: &mut Engine, kind: &Kind, cost: KindCost) -> Self {
        let ports = engine.ports(ModuleRef { kind: kind.id, number: 1 }).unwrap_or_default();
        let parameters: Vec<_> =
            (0..).map_while(|index| engine.kinds().describe_parameter(kind.id, index)).collect();
        let lists = parameters.iter().filter(|parameter| parameter.accepts == Accepts::Types);
        Self {
            name: kind.name,
            group: group(kind),
            summary: kind.summary.text(),
            bytes: size_of::<Word>() * kind.words(0),
            bytes_per_axis: size_of::<Word>() * (kind.words(1) - kind.words(0)),
            cost,
            port_lists: lists.map(|list| list.name).collect(),
            has_ports_of_a_law: kind.runs_program(),
            ports: ports.iter().filter_map(|port| port_row(port, &ports)).collect(),
            parameters: parameters.iter().map(parameter_row).collect(),
        }
    }

    /// Its line in the list.
    fn cells(&self) -> [String; 5] {
        let Self { name, group, summary, bytes, bytes_per_axis, cost, .. } = self;
        let bytes = format!("{bytes} + {bytes_per_axis}");
        [(*group).to_owned(), (*name).to_owned(), (*summary).to_owned(), cost.cell(), bytes]
    }

    /// Why its cycles are not known.
    fn no_bound(&self) -> Option<String> {
        self.cost.no_bound.as_ref().map(|reason| format!("Its cycles are not known: {reason}."))
    }

    fn port_table(&self) -> Rows<5> {
        rows(PortRow::HEADER, self.ports.iter().map(PortRow::cells))
    }

    fn parameter_table(&self) -> Rows<5> {
        rows(ParameterRow::HEADER, self.parameters.iter().map(ParameterRow::cells))
    }

    fn print(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "{}: {}", self.name, self.summary)?;
        print_table(out, &self.port_table())?;
        for list in &self.port_lists {
            writeln!(out, "Every {list} adds a port for its type.")?;
        }
        if self.has_ports_of_a_law {
            writeln!(out, "{PORTS_OF_A_LAW}")?;
        }
        print_table(out, &self.parameter_table())?;
        if let Some(no_bound) = self.no_bound() {
            writeln!(out, "{no_bound}")?;
        }
        writeln!(out)
    }

    fn markdown(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "\n## {}\n\n{}", self.name, self.summary)?;
        if let Some(no_bound) = self.no_bound() {
            writeln!(out, "\n{no_bound}")?;
        }
        markdown_table(out, &self.port_table())?;
        for list in &self.port_lists {
            writeln!(out, "\nEvery `{list}` adds a port for its type.")?;
        }
        if self.has_ports_of_a_law {
            writeln!(out, "\n{PORTS_OF_A_LAW}")?;
        }
        markdown_table(out, &self.parameter_table())
    }
}

fn rows<const COLUMNS: usize>(
    header: [&str; COLUMNS],
    rows: impl Iterator<Item = [String; COLUMNS]>,
) -> Rows<COLUMNS> {
    std::iter::once(header.map(str::to_owned)).chain(rows).collect()
}

fn port_row(port: &PortSpec, ports: &[PortSpec]) -> Option<PortRow> {
    let (data_type, _) = port.data_type?;
    let any_or = |text: String| match port.tie.filter(|_| port.takes_any_type) {
        None if port.takes_any_type => "any".to_owned(),
        None => text.to_lowercase(),
        Some(_) => port_unit(port, ports),
    };
    Some(PortRow {
        name: port.name,
        direction: if port.direction == Direction::Read { "reads" } else { "writes" },
        signal: data_type.name,
        unit: port_unit(port, ports),
        format: any_or(format!("{:?}", data_type.format)),
        shape: any_or(format!("{:?}", data_type.shape)),
    })
}

fn parameter_row(parameter: &Parameter) -> ParameterRow {
    let is_list = parameter.accepts == Accepts::Types;
    ParameterRow {
        name: parameter.name,
        unit: if is_list { String::new() } else { units(parameter.unit) },
        range: ParameterText::try_from(*parameter).map_or_else(|_| String::new(), |text| range_text(&text)),
        default: default(parameter),
        meaning: parameter.summary.text(),
        only_while_unplugged: parameter.is_structural,
    }
}

fn print_table<const COLUMNS: usize>(out: &mut impl Write, rows: &Rows<COLUMNS>) -> io::Result<()> {
    let [header, rows @ ..] = rows.as_slice() else { return Ok(()) };
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(out, "{}", text_table().set_header(header).add_rows(rows))
}

fn markdown_table<const COLUMNS: usize>(out: &mut impl Write, rows: &Rows<COLUMNS>) -> io::Result<()> {
    let [header, rows @ ..] = rows.as_slice() else { return Ok(()) };
    if rows.is_empty() {
        return Ok(());
    }
    let line = |cells: &[String]| format!("| {} |", cells.join(" | ").trim_end());
    let rule = ["---"; COLUMNS].map(str::to_owned);
    writeln!(out, "\n{}\n{}", line(header), line(&rule))?;
    rows.iter().try_for_each(|row| writeln!(out, "{}", line(row)))
}

/// The unit a port takes: its own, or what follows from the port that it is tied to.
fn port_unit(port: &PortSpec, ports: &[PortSpec]) -> String {
    let other = port.tie.and_then(|tie| Some((tie.relation, ports.get(usize::from(tie.port))?.name)));
    match (other, port.data_type) {
        (Some((UnitRelation::Same | UnitRelation::Alike, other)), _) => format!("that of {other}"),
        (Some((UnitRelation::Integral, other)), _) => format!("that of {other}, times s"),
        (Some((UnitRelation::Derivative, other)), _) => format!("that of {other}, over s"),
        (None, _) if port.takes_any_unit || port.takes_any_type => units(Unit::Any),
        (None, Some((data_type, _))) => units(data_type.unit),
        (None, None) => String::new(),
    }
}

/// The unit on a linear and, where it differs, on a rotary axis.
fn units(unit: Unit) -> String {
    unit.on(&[AxisKind::Linear, AxisKind::Rotary]).to_string()
}

fn default(parameter: &Parameter) -> String {
    match (parameter.default, parameter.accepts) {
        (Some(Value::Real(value)), _) => value.to_string(),
        (Some(Value::Count(value)), _) => value.to_string(),
        (Some(Value::Integer(value)), _) => value.to_string(),
        (Some(Value::Flag(value)), _) => switch(value).to_owned(),
        (Some(Value::Choice(index)), Accepts::Choice(names)) => {
            names.get(usize::from(index)).map_or_else(String::new, |name| (*name).to_owned())
        }
        _ => "none".to_owned(),
    }
}
