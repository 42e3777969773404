//! `dimsart modules`: every module with its ports and parameters.

use std::process::ExitCode;

use clap::Args;
use comfy_table::Table;
use dimsart_core::modules::Standard;
use dimsart_core::{Accepts, AxisKind, Direction, Engine, ModuleList, ModuleRef, Parameter, PortSpec, Value};

use super::Ending;
use crate::experiment::device;
use crate::schemes::nearest;

/// List the modules with their ports, parameters, units and ranges.
#[derive(Debug, Args)]
pub(super) struct Modules {
    /// Only this module, such as `PDCTRL_MOD`.
    name: Option<String>,
}

impl Modules {
    pub(super) fn execute(self) -> Ending {
        let names: Vec<String> = Standard::KINDS.iter().map(|kind| kind.name.to_owned()).collect();
        if let Some(name) = &self.name
            && !names.contains(name)
        {
            let hint =
                nearest(name, &names).map(|near| format!("; did you mean '{near}'?")).unwrap_or_default();
            return Err(format!("there is no module '{name}'{hint}").into());
        }
        let mut engine: Engine = Engine::new(device("device", 1, 1e-3)?);
        for (number, kind) in (0..).zip(Standard::KINDS) {
            if self.name.as_deref().is_some_and(|name| name != kind.name) {
                continue;
            }
            println!("{}: {}", kind.name, kind.summary);
            let ports = engine.ports(ModuleRef { kind: number, number: 1 }).unwrap_or_default();
            print_ports(&ports);
            print_parameters((0..).map_while(|index| <Engine>::describe_parameter(number, index)));
            println!();
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn print_ports(ports: &[PortSpec]) {
    let mut table = Table::new();
    table.set_header(["port", "", "type", "unit", "format", "shape"]);
    for port in ports {
        let Some((data_type, _)) = port.data_type else { continue };
        table.add_row([
            port.name.to_owned(),
            if port.direction == Direction::Read { "reads".to_owned() } else { "writes".to_owned() },
            data_type.name.to_owned(),
            units(data_type.unit),
            format!("{:?}", data_type.format).to_lowercase(),
            format!("{:?}", data_type.shape).to_lowercase(),
        ]);
    }
    if !table.is_empty() {
        println!("{table}");
    }
}

fn print_parameters(parameters: impl Iterator<Item = Parameter>) {
    let mut table = Table::new();
    table.set_header(["parameter", "unit", "range", "default", "meaning"]);
    for parameter in parameters {
        let when = if parameter.is_structural { " Only while unplugged." } else { "" };
        table.add_row([
            parameter.name.to_owned(),
            units(parameter.unit),
            range(&parameter),
            default(&parameter),
            format!("{}{when}", parameter.summary),
        ]);
    }
    if !table.is_empty() {
        println!("{table}");
    }
}

/// The unit on a linear and, where it differs, on a rotary axis.
fn units(unit: dimsart_core::Unit) -> String {
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
        Accepts::Types => "a data type; adds it".to_owned(),
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
