//! Uploads a controller's scheme to the board, and reads the layout of the board's signals.

use dimsart_core::{Command, KindId, TypeRef, Word};
use dimsart_link::auth::Key;
use dimsart_link::exchange::Tag;
use dimsart_link::protocol::{
    self, DeviceInfo, KeyAction, KeyState, MAX_FRAME_BYTES, PROTOCOL_VERSION, Receiver, Refusal, Request,
    RequestSealer, Response, decode_response, request_id,
};

use super::wire::{BoardKey, Wire};
use super::{EmulatedError, words};
use crate::rig::SimulatedDimsart;

/// Client id of this process.
pub(super) const CLIENT: u8 = 1;
/// Timeout of a request in ticks; it is answered in the tick of its arrival.
const ANSWER_TICKS: u32 = 8;

/// Slots of the board's signals in the copy's Data Base, in the order of the board.
#[derive(Debug)]
pub(super) struct Layout {
    /// Slot of the copy (`None` if missing), and number of words.
    signals: Vec<(Option<u8>, usize)>,
    words: usize,
}

impl Layout {
    /// Overwrites the copy with the board's data: a revision, then the words.
    pub(super) fn show(&self, content: &[u8], copy: &mut SimulatedDimsart) -> Result<(), EmulatedError> {
        let (expected, found) = (4 * (1 + self.words), content.len());
        if found != expected {
            return Err(EmulatedError::UnexpectedAnswer { what: "the Data Base", expected, found });
        }
        let mut words = words(content).skip(1);
        for (slot, count) in &self.signals {
            let words = words.by_ref().take(*count);
            match slot {
                Some(slot) => copy.overwrite(*slot, words),
                None => words.for_each(drop),
            }
        }
        Ok(())
    }
}

/// Uploads the scheme of `copy`, and a key. Without measurements the scheme is not computed meanwhile.
pub(super) fn upload(
    wire: &mut Wire,
    copy: &mut SimulatedDimsart,
    key: Option<BoardKey>,
) -> Result<Layout, EmulatedError> {
    let nothing_measured = vec![Word::from(f32::NAN); copy.frame().output_words()];
    let mut line = CommandLine { wire, nothing_measured, number: 0, content: Vec::new() };
    line.compare_devices(copy)?;
    line.compare_libraries(copy)?;
    line.carry_out([Command::Close])?;
    if let Some(key) = key {
        line.lock(key)?;
    }
    line.carry_out(copy.engine_mut().rebuild_commands())?;
    line.carry_out([Command::Check])?;
    line.layout(copy)
}

/// Returns the answer of this command's library to a request.
fn answer_here(copy: &mut SimulatedDimsart, request: &Request) -> Response<'static> {
    protocol::serve(request_id(CLIENT, 0), request, copy, &mut <DeviceInfo>::new("").with_laws())
}

fn unexpected(answer: &Response<'_>) -> EmulatedError {
    match answer {
        Response::Refused(refusal) => EmulatedError::Refused(*refusal),
        _ => EmulatedError::NoAnswer { ticks: ANSWER_TICKS },
    }
}

/// Command line of the board, one request at a time.
struct CommandLine<'a> {
    wire: &'a mut Wire,
    nothing_measured: Vec<Word>,
    number: u8,
    content: Vec<u8>,
}

impl CommandLine<'_> {
    fn carry_out(&mut self, commands: impl IntoIterator<Item = Command>) -> Result<(), EmulatedError> {
        for command in commands {
            match self.ask(&Request::Command(command))? {
                Response::Effect(protocol::Effect { refused: None, .. }) => {}
                Response::Effect(protocol::Effect { refused: Some(error), .. }) => {
                    return Err(EmulatedError::Refused(Refusal::Engine(error)));
                }
                answer => return Err(unexpected(&answer)),
            }
        }
        Ok(())
    }

    /// Sets the board's key and completes the handshake.
    fn lock(&mut self, BoardKey { bytes, salt }: BoardKey) -> Result<(), EmulatedError> {
        match self.ask(&Request::Key(KeyAction::Set { key: bytes, salt }))? {
            Response::Key(KeyState::Locked) => {}
            answer => return Err(unexpected(&answer)),
        }
        let mut sealer = RequestSealer::new(&Key::new(&bytes.0), salt);
        let mut receiver = Receiver::new();
        for _ in 0..ANSWER_TICKS {
            // First a hello, finally the answer to the challenge.
            let has_session = sealer.has_session();
            if let Ok(Some(handshake)) = sealer.handshake(&mut [0; MAX_FRAME_BYTES]) {
                self.wire.send(Tag::Command, handshake);
            }
            self.wire.exchange(&self.nothing_measured)?;
            if has_session {
                self.wire.sealer = Some(sealer);
                return Ok(());
            }
            for bytes in self.wire.sections(|tag| tag == Tag::Command) {
                receiver.push_all(bytes, |content| {
                    sealer.receive(content);
                });
            }
        }
        Err(EmulatedError::NoAnswer { ticks: ANSWER_TICKS })
    }

    fn ask(&mut self, request: &Request) -> Result<Response<'_>, EmulatedError> {
        self.number = self.number.wrapping_add(1);
        let id = request_id(CLIENT, self.number);
        self.wire.ask(request, id);
        let mut receiver = Receiver::new();
        let mut is_there = false;
        for _ in 0..ANSWER_TICKS {
            self.wire.exchange(&self.nothing_measured)?;
            for bytes in self.wire.sections(|tag| tag == Tag::Command) {
                receiver.push_all(bytes, |content| {
                    // Skips heartbeats.
                    if matches!(decode_response(content), Ok((found, _)) if found == id) {
                        is_there = true;
                        content.clone_into(&mut self.content);
                    }
                });
            }
            if is_there {
                break;
            }
        }
        match decode_response(&self.content) {
            Ok((_, response)) if is_there => Ok(response),
            _ => Err(EmulatedError::NoAnswer { ticks: ANSWER_TICKS }),
        }
    }

    fn compare_devices(&mut self, copy: &SimulatedDimsart) -> Result<(), EmulatedError> {
        let scenario_s = copy.engine().device().sample_period_s();
        match self.ask(&Request::Identify)? {
            Response::Identity(board) if board.protocol_version != PROTOCOL_VERSION => {
                Err(EmulatedError::IncompatibleModules { what: "protocol".to_owned() })
            }
            Response::Identity(board) if board.sample_period_s.to_bits() != scenario_s.to_bits() => {
                Err(EmulatedError::SamplePeriod { board_s: board.sample_period_s, scenario_s })
            }
            Response::Identity(_) => Ok(()),
            answer => Err(unexpected(&answer)),
        }
    }

    /// Checks that kinds, parameters and types of board and host are equal: commands refer to them by number. Kinds
    /// and types missing in the board's image are not compared.
    fn compare_libraries(&mut self, copy: &mut SimulatedDimsart) -> Result<(), EmulatedError> {
        for place in 0..=u8::MAX {
            let kind = match self.ask(&Request::Module { place })? {
                Response::Refused(_) => break,
                Response::Module(found) => KindId::from_name(found.name),
                answer => return Err(unexpected(&answer)),
            };
            if copy.engine().kinds().kind(kind).is_none() {
                return Err(EmulatedError::IncompatibleModules { what: "the list of modules".to_owned() });
            }
            for index in 0..=u8::MAX {
                if !self.is_same(copy, Request::Parameter { kind, index }, "the list of parameters")? {
                    break;
                }
            }
        }
        let here: Vec<Response<'_>> = (0..=u16::MAX)
            .map(|index| answer_here(copy, &Request::DataType { index }))
            .take_while(|answer| !matches!(answer, Response::Refused(_)))
            .collect();
        for index in 0..=u16::MAX {
            match self.ask(&Request::DataType { index })? {
                Response::Refused(_) => break,
                there if here.contains(&there) => (),
                _ => {
                    return Err(EmulatedError::IncompatibleModules {
                        what: "the list of data types".to_owned(),
                    });
                }
            }
        }
        Ok(())
    }

    /// Whether an item of this number exists; it must be equal on board and host.
    fn is_same(
        &mut self,
        copy: &mut SimulatedDimsart,
        request: Request,
        what: &str,
    ) -> Result<bool, EmulatedError> {
        let here = answer_here(copy, &request);
        match self.ask(&request)? == here {
            true => Ok(!matches!(here, Response::Refused(_))),
            false => Err(EmulatedError::IncompatibleModules { what: what.to_owned() }),
        }
    }

    fn layout(&mut self, copy: &SimulatedDimsart) -> Result<Layout, EmulatedError> {
        let data_base = copy.engine().data_base();
        let mut signals = Vec::new();
        for index in 0..=u8::MAX {
            let signal = match self.ask(&Request::Entry { index })? {
                Response::Entry(signal) => signal,
                Response::Refused(Refusal::NotFound) => break,
                answer => return Err(unexpected(&answer)),
            };
            signals.push((data_base.slot(signal), self.words(signal)?));
        }
        let shown = signals.iter().filter(|(slot, _)| slot.is_some()).count();
        if shown != data_base.signals().count() {
            return Err(EmulatedError::IncompatibleModules { what: "the signals of this scheme".to_owned() });
        }
        let words = signals.iter().map(|(_, words)| words).sum();
        Ok(Layout { signals, words })
    }

    fn words(&mut self, signal: TypeRef) -> Result<usize, EmulatedError> {
        match self.ask(&Request::Signal { signal, from: 0 })? {
            Response::Signal(found) => Ok(found.total_words.into()),
            answer => Err(unexpected(&answer)),
        }
    }
}
