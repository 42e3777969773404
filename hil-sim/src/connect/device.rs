//! A device that is asked: what it answers, under its own names.

use std::io::{Read, Write};

use dimsart_core::protocol::{InstanceText, PROTOCOL_VERSION, PortText, Refusal, Request, Response, Status};
use dimsart_core::{Direction, ModuleRef, TypeRef, Value};

use super::description::{DataType, Identity, Kind, Parameter, Range, ValueText};
use super::{ConnectError, Line, Patience};

/// A device at the other end of a line, and what is known of it so far.
#[derive(Debug)]
pub struct Device<S> {
    line: Line<S>,
    identity: Identity,
    kinds: List<Kind>,
    types: List<DataType>,
    /// Whether this client has taken the lease, and not given it back.
    pub(super) has_taken_lease: bool,
}

/// The part of a list on the device that has been asked for.
#[derive(Debug)]
struct List<T> {
    items: Vec<T>,
    is_whole: bool,
}

impl<T> Default for List<T> {
    fn default() -> Self {
        Self { items: Vec::new(), is_whole: false }
    }
}

/// A port of a module.
#[derive(Debug)]
pub(super) struct Port {
    pub(super) name: String,
    pub(super) direction: Direction,
    pub(super) bound: Option<TypeRef>,
}

impl From<PortText<'_>> for Port {
    fn from(found: PortText<'_>) -> Self {
        Self { name: found.name.to_owned(), direction: found.direction, bound: found.bound }
    }
}

/// Takes the content of the response that was asked for.
macro_rules! take {
    ($variant:ident) => {
        |response| match response {
            Response::$variant(content) => Some(content.into()),
            _ => None,
        }
    };
}
pub(super) use take;

impl<S: Read + Write> Device<S> {
    /// Asks who is at the other end of `stream`.
    ///
    /// # Errors
    /// [`ConnectError::Line`] when nobody answers, or in a way that is not understood.
    pub fn greet(stream: S, patience: Patience) -> Result<Self, ConnectError> {
        let mut line = Line::new(stream, patience);
        let identity = match line.ask(&Request::Identify)? {
            Response::Identity(identity) => identity.into(),
            Response::Refused(refusal) => return Err(ConnectError::Refused(refusal)),
            _ => return Err(ConnectError::OtherAnswer),
        };
        Ok(Self { line, identity, kinds: List::default(), types: List::default(), has_taken_lease: false })
    }

    pub(super) fn line(&self) -> &Line<S> {
        &self.line
    }

    pub(super) fn line_mut(&mut self) -> &mut Line<S> {
        &mut self.line
    }

    /// Who is there.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// What is to be expected of a device of another protocol version; none when it is ours.
    #[must_use]
    pub fn version_note(&self) -> Option<String> {
        let theirs = self.identity.protocol_version;
        let older = if theirs < PROTOCOL_VERSION { "the device" } else { "this command" };
        (theirs != PROTOCOL_VERSION).then(|| {
            format!(
                "the device speaks protocol {theirs} and this command {PROTOCOL_VERSION}: what {older} does not know \
                 yet is refused or not shown, everything else works"
            )
        })
    }

    /// Ticks since the start, and whether the scheme commands the device, with the first reason if not.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn state(&mut self) -> Result<String, ConnectError> {
        let status = self.status()?;
        Ok(format!("tick {}: {}", status.ticks, self.state_text(status.blocked)?))
    }

    /// Asks; none when nothing has that number. A lease that is held is renewed before, when it is time to.
    pub(super) fn ask<T>(
        &mut self,
        request: &Request,
        take: impl FnOnce(Response<'_>) -> Option<T>,
    ) -> Result<Option<T>, ConnectError> {
        if !matches!(request, Request::Lease(_)) {
            self.renew_in_time()?;
        }
        match self.line.ask(request)? {
            Response::Refused(Refusal::NotThere) => Ok(None),
            Response::Refused(refusal) => Err(ConnectError::Refused(refusal)),
            response => take(response).map(Some).ok_or(ConnectError::OtherAnswer),
        }
    }

    pub(super) fn status(&mut self) -> Result<Status, ConnectError> {
        self.ask(&Request::Status, take!(Status))?.ok_or(ConnectError::OtherAnswer)
    }

    pub(super) fn instances(&mut self) -> Result<Vec<InstanceText>, ConnectError> {
        let mut found = Vec::new();
        for index in 0..=u8::MAX {
            let Some(instance) = self.ask(&Request::Instance { index }, take!(Instance))? else { break };
            found.push(instance);
        }
        Ok(found)
    }

    pub(super) fn ports(&mut self, module: ModuleRef) -> Result<Vec<Port>, ConnectError> {
        let mut found = Vec::new();
        for index in 0..=u8::MAX {
            let Some(port) = self.port(module, index)? else { break };
            found.push(port);
        }
        Ok(found)
    }

    pub(super) fn port(&mut self, module: ModuleRef, index: u8) -> Result<Option<Port>, ConnectError> {
        self.ask(&Request::Port { module, index }, take!(Port))
    }

    pub(super) fn parameters(&mut self, kind: u8) -> Result<Vec<Parameter>, ConnectError> {
        self.learn_kinds(Some(kind))?;
        let known = self.kinds.items.get(usize::from(kind)).and_then(|kind| kind.parameters.clone());
        if let Some(known) = known {
            return Ok(known);
        }
        let mut found = Vec::new();
        for index in 0..=u8::MAX {
            let Some(parameter) = self.ask(&Request::Parameter { kind, index }, take!(Parameter))? else {
                break;
            };
            found.push(parameter);
        }
        if let Some(kind) = self.kinds.items.get_mut(usize::from(kind)) {
            kind.parameters = Some(found.clone());
        }
        Ok(found)
    }

    /// Learns the kinds of modules up to one of them, or all.
    fn learn_kinds(&mut self, last: Option<u8>) -> Result<(), ConnectError> {
        while !self.kinds.is_whole {
            let known = u8::try_from(self.kinds.items.len()).ok();
            let Some(kind) = known.filter(|kind| last.is_none_or(|last| *kind <= last)) else { break };
            match self.ask(&Request::Module { kind }, take!(Module))? {
                Some(kind) => self.kinds.items.push(kind),
                None => self.kinds.is_whole = true,
            }
        }
        Ok(())
    }

    fn learn_types(&mut self) -> Result<&[DataType], ConnectError> {
        while !self.types.is_whole {
            let Ok(index) = u16::try_from(self.types.items.len()) else { break };
            match self.ask(&Request::DataType { index }, take!(DataType))? {
                Some(data_type) => self.types.items.push(data_type),
                None => self.types.is_whole = true,
            }
        }
        Ok(&self.types.items)
    }

    /// Names of all kinds of modules in the image.
    pub(super) fn kind_names(&mut self) -> Result<Vec<String>, ConnectError> {
        self.learn_kinds(None)?;
        Ok(self.kinds.items.iter().map(|kind| kind.name.clone()).collect())
    }

    /// Names of all data types of the device.
    pub(super) fn type_names(&mut self) -> Result<Vec<String>, ConnectError> {
        Ok(self.learn_types()?.iter().map(|data_type| data_type.name.clone()).collect())
    }

    pub(super) fn type_named(&mut self, name: &str) -> Result<Option<u16>, ConnectError> {
        let found = self.learn_types()?.iter().find(|data_type| data_type.name == name);
        Ok(found.map(|data_type| data_type.id))
    }

    /// Name of a module, `PDCTRL_MOD` or `PDCTRL_MOD.2`; `?` for a kind that is not in the image.
    pub(super) fn module_name(&mut self, module: ModuleRef) -> Result<String, ConnectError> {
        self.learn_kinds(Some(module.kind))?;
        let name = self.kinds.items.get(usize::from(module.kind)).map_or("?", |kind| &kind.name);
        Ok(numbered(name, module.number))
    }

    /// Name of a signal, `FORCE` or `FORCE.2`; `?` for a type that the device does not have.
    pub(super) fn signal_name(&mut self, signal: TypeRef) -> Result<String, ConnectError> {
        let name = self.find_type(signal.id)?.map_or("?", |data_type| &data_type.name);
        Ok(numbered(name, signal.number))
    }

    /// Unit of a data type on this device; empty for a type that it does not have.
    pub(super) fn unit(&mut self, id: u16) -> Result<String, ConnectError> {
        let units = self.find_type(id)?.map(|data_type| data_type.units.clone());
        Ok(units.map(|units| units.on(&self.identity.axes)).unwrap_or_default())
    }

    fn find_type(&mut self, id: u16) -> Result<Option<&DataType>, ConnectError> {
        Ok(self.learn_types()?.iter().find(|data_type| data_type.id == id))
    }

    /// A value in the device's words.
    pub(super) fn value_text(&mut self, value: Value, range: &Range) -> Result<ValueText, ConnectError> {
        Ok(match value {
            Value::Real(value) => ValueText::Real(value),
            Value::Count(value) => ValueText::Whole(value.into()),
            Value::Flag(value) => ValueText::Flag(value),
            Value::Choice(index) => match range {
                Range::Choice(names) => names
                    .get(usize::from(index))
                    .map_or(ValueText::Whole(index.into()), |name| ValueText::Name(name.clone())),
                _ => ValueText::Whole(index.into()),
            },
            Value::Type(signal) => ValueText::Name(self.signal_name(signal)?),
        })
    }
}

fn numbered(name: &str, number: u8) -> String {
    if number == 1 { name.to_owned() } else { format!("{name}.{number}") }
}
