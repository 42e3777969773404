//! `dimsart modules`: every module with its ports and parameters.

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Args;
use comfy_table::{ContentArrangement, Table, presets};
use dimsart_core::modules::Standard;
use dimsart_core::{
    Accepts, AxisKind, Direction, Engine, ModuleList, ModuleRef, Parameter, PortSpec, Unit, UnitRelation,
    Value,
};

use super::Ending;
use crate::experiment::device;
use crate::schemes::nearest;

/// List the modules with their ports, parameters, units and ranges.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Modules {
    /// Only this module, such as `PDCTRL_MOD`.
    name: Option<String>,
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

impl Modules {
    pub(super) fn execute(self, out: &mut impl Write) -> Ending {
        let names: Vec<String> = Standard::KINDS.iter().map(|kind| kind.name.to_owned()).collect();
        if let Some(name) = &self.name
            && !names.contains(name)
        {
            let hint = match nearest(name, &names) {
                Some(near) => format!("did you mean '{near}'?"),
                None => format!("there is {}", names.join(", ")),
            };
            return Err(format!("there is no module '{name}'; {hint}").into());
        }
        let mut engine: Engine = Engine::new(device("device", 1, 1e-3)?);
        for (number, kind) in (0..).zip(Standard::KINDS) {
            if self.name.as_deref().is_some_and(|name| name != kind.name) {
                continue;
            }
            writeln!(out, "{}: {}", kind.name, kind.summary)?;
            let ports = engine.ports(ModuleRef { kind: number, number: 1 }).unwrap_or_default();
            let parameters: Vec<_> =
                (0..).map_while(|index| <Engine>::describe_parameter(number, index)).collect();
            print_ports(out, &ports)?;
            for list in parameters.iter().filter(|parameter| parameter.accepts == Accepts::Types) {
                writeln!(out, "Every {} adds a port for its type.", list.name)?;
            }
            print_parameters(out, &parameters)?;
            writeln!(out)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn table<const COLUMNS: usize>(header: [&str; COLUMNS]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(WIDTH).set_header(header);
    table
}

fn print_ports(out: &mut impl Write, ports: &[PortSpec]) -> io::Result<()> {
    let mut table = table(["port", "reads or writes", "unit", "format", "shape"]);
    for port in ports {
        let Some((data_type, _)) = port.data_type else { continue };
        let verb = if port.direction == Direction::Read { "reads" } else { "writes" };
        table.add_row([
            port.name.to_owned(),
            format!("{verb} {}", data_type.name),
            port_unit(port, ports),
            format!("{:?}", data_type.format).to_lowercase(),
            format!("{:?}", data_type.shape).to_lowercase(),
        ]);
    }
    print(out, &table)
}

fn print_parameters(out: &mut impl Write, parameters: &[Parameter]) -> io::Result<()> {
    let mut table = table(["parameter", "unit", "range", "default", "meaning"]);
    for parameter in parameters {
        let when = if parameter.is_structural { " Only while unplugged." } else { "" };
        table.add_row([
            parameter.name.to_owned(),
            if parameter.accepts == Accepts::Types { String::new() } else { units(parameter.unit) },
            range(parameter),
            default(parameter),
            format!("{}{when}", parameter.summary),
        ]);
    }
    print(out, &table)
}

fn print(out: &mut impl Write, table: &Table) -> io::Result<()> {
    if table.is_empty() { Ok(()) } else { writeln!(out, "{table}") }
}

/// The unit a port takes: its own, or what follows from the port that it is tied to.
fn port_unit(port: &PortSpec, ports: &[PortSpec]) -> String {
    let other = port.tie.and_then(|tie| Some((tie.relation, ports.get(usize::from(tie.port))?.name)));
    match (other, port.data_type) {
        (Some((UnitRelation::Same, other)), _) => format!("that of {other}"),
        (Some((UnitRelation::Integral, other)), _) => format!("that of {other}, times s"),
        (Some((UnitRelation::Derivative, other)), _) => format!("that of {other}, over s"),
        (None, _) if port.takes_any_unit => units(Unit::Any),
        (None, Some((data_type, _))) => units(data_type.unit),
        (None, None) => String::new(),
    }
}

/// The unit on a linear and, where it differs, on a rotary axis.
fn units(unit: Unit) -> String {
    let (linear, rotary) = (unit.symbol(AxisKind::Linear), unit.symbol(AxisKind::Rotary));
    if linear == rotary { linear.to_owned() } else { format!("{linear} or {rotary}") }
}

fn range(parameter: &Parameter) -> String {
    match parameter.accepts {
        Accepts::Real { min, max, per_axis } => {
            format!("{min} to {max}{}", if per_axis { ", per axis" } else { "" })
        }
        Accepts::Count { min, max } => format!("{min} to {max}"),
        Accepts::Flag => "OFF, ON".to_owned(),
        Accepts::Choice(names) => names.join(", "),
        Accepts::Types => "a data type".to_owned(),
    }
}

fn default(parameter: &Parameter) -> String {
    match (parameter.default, parameter.accepts) {
        (Some(Value::Real(value)), _) => value.to_string(),
        (Some(Value::Count(value)), _) => value.to_string(),
        (Some(Value::Flag(value)), _) => if value { "ON" } else { "OFF" }.to_owned(),
        (Some(Value::Choice(index)), Accepts::Choice(names)) => {
            names.get(usize::from(index)).map_or_else(String::new, |name| (*name).to_owned())
        }
        _ => "none".to_owned(),
    }
}
