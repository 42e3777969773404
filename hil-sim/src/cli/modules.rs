//! `dimsart modules`: every module with its ports and parameters.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Args;
use comfy_table::{ContentArrangement, Table, presets};
use dimsart_core::modules::Standard;
use dimsart_core::protocol::ParameterText;
use dimsart_core::scheme::switch;
use dimsart_core::{
    Accepts, AxisKind, Direction, Engine, ModuleList, ModuleRef, Parameter, PortSpec, Unit, UnitRelation,
    Value,
};

use super::Ending;
use crate::bilateral::device;
use crate::connect::range_text;
use crate::schemes::suggestion;

/// List the modules with their ports, parameters, units and ranges.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Modules {
    /// Only this module, such as `PDCTRL_MOD`.
    name: Option<String>,
    /// Prints a page of Markdown, as `docs/modules.md` is one.
    #[arg(long)]
    markdown: bool,
}

const EXAMPLES: &str = "\
In a scheme:
  all  PDCTRL_MOD    K_PARAM        3000           sets a parameter, on every axis
  all  PDCTRL_MOD    K_PARAM[0]     1000           sets it on axis 0 alone
  all  SUM_MOD       PORT_A         DES_FORCE      binds a port to another type of the same unit and shape
  all  MOD_ENG       MOD_ON         PDCTRL_MOD     plugs the module in
  all  MOD_ENG       MOD_ON         PDCTRL_MOD.2   plugs a second one in";

/// Columns of a terminal that everything fits into.
const WIDTH: u16 = 100;

/// Head of the page.
const MARKDOWN_HEAD: &str = "\
# The modules

Written by `dimsart modules --markdown > docs/modules.md`, from what the modules say of themselves: change a module
and run it again. Ports can be bound to other data types of the same unit, format and shape (`PORT_NAME TYPE` in a
scheme); `any` is every one.

Every module but the ends of links takes `EVERY_TICKS`, too: 1 (the default), 2, 4, 5, 10, 20, 50 or 100, while it is
unplugged ([commands.md](commands.md#modules-that-do-not-run-in-every-tick)).
";

/// What a module says of itself.
struct Description {
    name: &'static str,
    summary: &'static str,
    ports: Rows<5>,
    /// Parameters that add a port for each type they are given.
    lists: Vec<&'static str>,
    parameters: Rows<5>,
}

/// A table, its head first.
type Rows<const COLUMNS: usize> = Vec<[String; COLUMNS]>;

impl Modules {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let names: Vec<String> = Standard::KINDS.iter().map(|kind| kind.name.to_owned()).collect();
        if let Some(name) = &self.name
            && !names.contains(name)
        {
            return Err(format!("there is no module '{name}'; {}", suggestion(name, &names)).into());
        }
        if self.markdown && self.name.is_none() {
            write!(out, "{MARKDOWN_HEAD}")?;
        }
        let mut engine: Engine = Engine::new(device("device", 1, 1e-3)?);
        let is_wanted = |name: &str| self.name.as_deref().is_none_or(|wanted| wanted == name);
        for (number, kind) in (0..).zip(Standard::KINDS).filter(|(_, kind)| is_wanted(kind.name)) {
            let description = Description::new(&mut engine, number, kind.name, kind.summary.text());
            if self.markdown { description.markdown(out) } else { description.print(out) }?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl Description {
    fn new(engine: &mut Engine, number: u8, name: &'static str, summary: &'static str) -> Self {
        let ports = engine.ports(ModuleRef { kind: number, number: 1 }).unwrap_or_default();
        let parameters: Vec<_> =
            (0..).map_while(|index| <Engine>::describe_parameter(number, index)).collect();
        let lists = parameters.iter().filter(|parameter| parameter.accepts == Accepts::Types);
        Self {
            name,
            summary,
            lists: lists.map(|list| list.name).collect(),
            ports: rows(
                ["port", "reads or writes", "unit", "format", "shape"],
                ports.iter().filter_map(|port| port_row(port, &ports)),
            ),
            parameters: rows(
                ["parameter", "unit", "range", "default", "meaning"],
                parameters.iter().map(parameter_row),
            ),
        }
    }

    fn print(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "{}: {}", self.name, self.summary)?;
        print_table(out, &self.ports)?;
        for list in &self.lists {
            writeln!(out, "Every {list} adds a port for its type.")?;
        }
        print_table(out, &self.parameters)?;
        writeln!(out)
    }

    fn markdown(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "\n## {}\n\n{}", self.name, self.summary)?;
        markdown_table(out, &self.ports)?;
        for list in &self.lists {
            writeln!(out, "\nEvery `{list}` adds a port for its type.")?;
        }
        markdown_table(out, &self.parameters)
    }
}

fn rows<const COLUMNS: usize>(
    header: [&str; COLUMNS],
    rows: impl Iterator<Item = [String; COLUMNS]>,
) -> Rows<COLUMNS> {
    std::iter::once(header.map(str::to_owned)).chain(rows).collect()
}

fn port_row(port: &PortSpec, ports: &[PortSpec]) -> Option<[String; 5]> {
    let (data_type, _) = port.data_type?;
    let any_or = |text: String| match port.tie.filter(|_| port.takes_any_type) {
        None if port.takes_any_type => "any".to_owned(),
        None => text.to_lowercase(),
        Some(_) => port_unit(port, ports),
    };
    let verb = if port.direction == Direction::Read { "reads" } else { "writes" };
    Some([
        port.name.to_owned(),
        format!("{verb} {}", data_type.name),
        port_unit(port, ports),
        any_or(format!("{:?}", data_type.format)),
        any_or(format!("{:?}", data_type.shape)),
    ])
}

fn parameter_row(parameter: &Parameter) -> [String; 5] {
    let when = if parameter.is_structural { " Only while unplugged." } else { "" };
    [
        parameter.name.to_owned(),
        if parameter.accepts == Accepts::Types { String::new() } else { units(parameter.unit) },
        ParameterText::try_from(*parameter).map_or_else(|_| String::new(), |text| range_text(&text)),
        default(parameter),
        format!("{}{when}", parameter.summary.text()),
    ]
}

fn print_table<const COLUMNS: usize>(out: &mut impl Write, rows: &Rows<COLUMNS>) -> io::Result<()> {
    let [header, rows @ ..] = rows.as_slice() else { return Ok(()) };
    if rows.is_empty() {
        return Ok(());
    }
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(WIDTH);
    writeln!(out, "{}", table.set_header(header).add_rows(rows))
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
