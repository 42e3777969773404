//! Requests to a device, with the device's names.

use std::io::{Read, Write};

use dimsart_core::scheme::{RowError, SchemeError, SourceLocation};
use dimsart_core::{ModuleKinds, ModuleRef, TypeRef, Vocabulary};
use dimsart_link::protocol::LawAction;
use dimsart_link::protocol::{
    InstanceDescription, OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, Refusal, Request, Response, Status,
};

use super::description::{Description, Identity};
use super::{ConnectError, LineError, RequestLine, Timeouts};
use hil_sim::law::{Law, LawVocabulary};
use hil_sim::schemes::SchemeErrorMessage;

/// Requests to a restarting board, each with the line's timeouts.
const RESTARTING_LOOKS: u32 = 4;

/// A device at the other end of a line, and its cached description.
#[derive(Debug)]
pub struct Device<S> {
    line: RequestLine<S>,
    description: Description,
    /// Whether this client has taken the lease and not released it.
    pub(super) has_taken_lease: bool,
}

/// Takes the content of the expected response.
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
    /// Identifies the device at the other end of `stream`. `kinds` are the module kinds of this program: their names are not
    /// read from the device, and their help texts are shown.
    ///
    /// # Errors
    /// [`ConnectError::Line`] without an answer, or for one that cannot be decoded; [`ConnectError::TooOld`].
    pub fn identify(stream: S, patience: Timeouts, kinds: ModuleKinds) -> Result<Self, ConnectError> {
        let mut line = RequestLine::new(stream, patience);
        let identity = match line.request(&Request::Identify)? {
            Response::Identity(identity) if identity.protocol_version < OLDEST_PROTOCOL_VERSION => {
                return Err(ConnectError::TooOld(identity.protocol_version));
            }
            Response::Identity(identity) => identity.into(),
            Response::Refused(refusal) => return Err(ConnectError::Refused(refusal)),
            _ => return Err(ConnectError::UnexpectedAnswer),
        };
        Ok(Self { line, description: Description::new(identity, kinds), has_taken_lease: false })
    }

    pub(super) fn line(&self) -> &RequestLine<S> {
        &self.line
    }

    pub(super) fn line_mut(&mut self) -> &mut RequestLine<S> {
        &mut self.line
    }

    /// Returns the identity of the device.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.description.identity
    }

    /// Returns the module kinds of this program.
    pub(super) fn known_kinds(&self) -> ModuleKinds {
        self.description.kinds
    }

    /// Returns the protocol version of the device if it is newer. Such a device is read-only: the effect of commands is
    /// unknown.
    fn newer_version(&self) -> Option<u16> {
        let theirs = self.identity().protocol_version;
        (theirs > PROTOCOL_VERSION).then_some(theirs)
    }

    pub(super) fn may_change(&self) -> Result<(), ConnectError> {
        self.newer_version().map_or(Ok(()), |theirs| Err(ConnectError::ReadOnly(theirs)))
    }

    /// Returns a note about the limits for a device of a newer protocol version.
    #[must_use]
    pub fn version_note(&self) -> Option<String> {
        self.newer_version().map(|theirs| {
            format!(
                "the device has protocol version {theirs}, this program {PROTOCOL_VERSION}: only reading and `stop` \
                 are possible, and newer content is not shown; use the `dimsart` of the image's version for full access"
            )
        })
    }

    /// Reads the ticks since the start, and whether the scheme commands the device, with the first reason if not.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn state(&mut self) -> Result<String, ConnectError> {
        let status = self.status()?;
        Ok(format!("tick {}: {}", status.ticks, self.state_text(status.blocked)?))
    }

    /// Reads the ticks since the start.
    ///
    /// # Errors
    /// [`ConnectError`] when the device does not answer.
    pub fn ticks(&mut self) -> Result<u64, ConnectError> {
        Ok(self.status()?.ticks)
    }

    /// Sends a request; `None` for an unused index. Renews a held lease first if it is due. Refuses to change or move a device
    /// of a newer version.
    pub(super) fn ask<T>(
        &mut self,
        request: &Request,
        take: impl FnOnce(Response<'_>) -> Option<T>,
    ) -> Result<Option<T>, ConnectError> {
        if is_beyond_every_list(request) {
            return Err(ConnectError::ListTooLong);
        }
        if request.needs_key() {
            self.may_change()?;
        }
        if !matches!(request, Request::Lease(_)) {
            self.renew_if_due()?;
        }
        match self.line.request(request)? {
            Response::Refused(Refusal::NotFound) => Ok(None),
            Response::Refused(refusal) => Err(ConnectError::Refused(refusal)),
            response => take(response).map(Some).ok_or(ConnectError::UnexpectedAnswer),
        }
    }

    /// Restarts the board and waits until it answers again.
    ///
    /// # Errors
    /// [`ConnectError::Refused`] while a client holds the lease, or by a device that cannot restart; [`ConnectError::Line`] if
    /// the device does not answer again.
    pub fn restart(&mut self) -> Result<(), ConnectError> {
        let begins = |response: Response<'_>| matches!(response, Response::Restarts).then_some(());
        self.ask(&Request::Restart, begins)?.ok_or(ConnectError::Refused(Refusal::NotFound))?;
        let mut answer = self.status();
        for _ in 0..RESTARTING_LOOKS {
            if answer.is_ok() {
                break;
            }
            answer = self.status();
        }
        answer.map(|_| ())
    }

    pub(super) fn status(&mut self) -> Result<Status, ConnectError> {
        self.ask(&Request::Status, take!(Status))?.ok_or(ConnectError::UnexpectedAnswer)
    }

    pub(super) fn instances(&mut self) -> Result<Vec<InstanceDescription>, ConnectError> {
        let mut found = Vec::new();
        for index in 0..=u8::MAX {
            let Some(instance) = self.ask(&Request::Instance { index }, take!(Instance))? else { break };
            found.push(instance);
        }
        Ok(found)
    }

    /// Looks something up in the description of the device, and reads missing parts from the device.
    ///
    /// `look` is called again after each missing part: it must have no side effects.
    pub(super) fn know<T>(&mut self, look: impl Fn(&Description) -> T) -> Result<T, ConnectError> {
        self.description.forget_ports();
        loop {
            let seen = look(&self.description);
            let Some(request) = self.description.take_missing() else { return Ok(seen) };
            let is_there = match self.ask(&request, |response| {
                let is_it = matches!(
                    (request, response),
                    (Request::Module { .. }, Response::Module(_))
                        | (Request::Parameter { .. }, Response::Parameter(_))
                        | (Request::Port { .. }, Response::Port(_))
                        | (Request::DataType { .. }, Response::DataType(_))
                );
                is_it.then_some(())
            }) {
                // Content of a newer version counts as missing.
                Err(ConnectError::Line(LineError::Unsupported)) => None,
                is_there => is_there?,
            };
            let content = is_there.map(|()| self.line.content().to_vec());
            self.description.learn(request, content);
        }
    }

    /// Parses words with the names of the device, and of a law that a module runs.
    pub(super) fn read<'a, T>(
        &mut self,
        law: Option<&(ModuleRef, Law)>,
        read: impl Fn(&LawVocabulary<'_, Description>) -> Result<T, SchemeError<'a>>,
    ) -> Result<T, ConnectError> {
        self.know(|known| {
            let known = &LawVocabulary::new(known, law);
            read(known)
                .map_err(|error| ConnectError::InvalidWord(SchemeErrorMessage { error, known }.to_string()))
        })?
    }

    /// Finds a module by its name; it need not exist yet.
    pub(super) fn module(&mut self, word: &str) -> Result<ModuleRef, ConnectError> {
        self.read(None, |known| known.find_module(word).ok_or(misread(word, RowError::ModuleValue)))
    }

    /// Finds a signal by its name, `FORCE` or `FORCE.2`.
    pub(super) fn signal_named(&mut self, word: &str) -> Result<TypeRef, ConnectError> {
        self.read(None, |known| known.signal_named(word).ok_or(misread(word, RowError::Type)))
    }

    /// Returns the name of a module, `PDCTRL_MOD` or `PDCTRL_MOD.2`; `?` for a kind that is not in the image.
    pub(super) fn module_name(&mut self, module: ModuleRef) -> Result<String, ConnectError> {
        self.know(|known| known.module_name(module).to_string())
    }

    /// Returns the name of a signal, `FORCE` or `FORCE.2`; `?` for an unknown type.
    pub(super) fn signal_name(&mut self, signal: TypeRef) -> Result<String, ConnectError> {
        self.know(|known| known.signal_name(signal).to_string())
    }
}

/// Error for an invalid word that is not part of a text.
fn misread(word: &str, problem: RowError) -> SchemeError<'_> {
    SchemeError { place: SourceLocation { line: 1, column: 1, word }, problem }
}

/// Returns whether an index exceeds the maximum list length: a device that answered all lower ones never ends its list.
fn is_beyond_every_list(request: &Request) -> bool {
    const LISTED: u8 = 128;
    const WORDS: u16 = 1024;
    match *request {
        Request::Instance { index }
        | Request::Entry { index }
        | Request::DeviceType { index }
        | Request::Parameter { index, .. }
        | Request::Port { index, .. }
        | Request::Cycles { place: index, .. }
        | Request::Law(LawAction::Status { number: index }) => index >= LISTED,
        Request::Module { place: index } | Request::Finding { index } => index == u8::MAX,
        Request::DataType { index } => index >= WORDS,
        Request::SchemeCommand { place, index } => place >= LISTED || index >= WORDS,
        Request::Signal { from, .. } => from >= WORDS,
        _ => false,
    }
}
